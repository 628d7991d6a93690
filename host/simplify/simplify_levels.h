// Several levels of detail of one high poly, from a single run of collapses.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kiln/normals.h"
#include "kiln/simplify.h"

namespace kiln {

/// Constraint that all levels obey.
enum class LevelRule {
  shape,
  keep_uvs,  ///< As SimplifyOptions::keep_uvs
  /// As SimplifyOptions::height_field; levels get UVs from x and y over the field's rectangle
  height_field,
};

/// Whether the normals of a simplified mesh are split along hard edges of the high poly if the mesh gets a normal map.
enum class EdgesUnderMap {
  hard,  ///< Normals are split along these edges, so small maps need not store the jump of the normal
  smooth  ///< Normals are only split at UV seams, which saves vertices
};

/// The intermediate meshes of one simplification. If the high poly needs no presimplification, each level equals the
/// mesh that simplify() makes for its number of faces. This also holds if no level has more than 5,000 faces, because
/// all levels then share one presimplification, unless a flaw requires another run. Otherwise, smaller levels may
/// differ slightly, since the presimplification must be fine enough for the largest level.
class SimplifyLevels {
 public:
  /// \param high   must outlive this object
  /// \param faces  requested face counts, descending
  /// \throws as simplify()
  SimplifyLevels(const Mesh& high, std::span<const std::uint32_t> faces, LevelRule rule);
  ~SimplifyLevels();
  SimplifyLevels(const SimplifyLevels&) = delete;
  SimplifyLevels& operator=(const SimplifyLevels&) = delete;

  /// Number of different levels. Requested numbers below the fewest faces that keep the topology are left out.
  std::size_t count() const;
  std::uint32_t requested_faces_of(std::size_t level) const;  ///< The requested number of faces
  /// The number of triangles before repair
  std::size_t faces(std::size_t level) const;
  std::size_t vertices(std::size_t level) const;

  /// The mesh of a level, repaired as by simplify(). It has no vertex colours: call transfer_colors() for meshes that
  /// are kept. Cached. Flaws of the presimplification that cannot be repaired remain until solve() is called.
  /// \param report  receives the report; if null, nothing is measured, which saves time
  Mesh mesh(std::size_t level, SimplifyReport* report = nullptr) const;
  /// The report of a level. It is measured once and cached.
  SimplifyReport report(std::size_t level) const;

  /// An unrepaired level, fitted with fewer samples, for measuring: a copy with normals for plain shading, and a copy
  /// with normals for a normal map.
  std::array<Mesh, 2> draft_meshes(std::size_t level,
                                   EdgesUnderMap edges = EdgesUnderMap::hard) const;

  /// Fits the normals of any low poly, such as a level with UVs, in the way of kiln::fit_normals(). Hard edges are
  /// chosen as for levels.
  void fit_normals(Mesh& low, EdgesUnderMap edges = EdgesUnderMap::hard) const;

  /// True if mesh() has flaws that solve() may repair.
  bool can_be_solved(std::size_t level) const;
  /// True if mesh() has folded or degenerate triangles, or new holes.
  bool has_flaws(std::size_t level) const;
  /// Rebuilds a flawed level as simplify() does, from another presimplification or from the high poly itself. Slow.
  void solve(std::size_t level) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
