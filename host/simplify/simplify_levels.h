// Levels of detail of one high poly from one run of collapses.
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
  keep_uvs,  ///< SimplifyOptions::keep_uvs
  height_field,  ///< SimplifyOptions::height_field; levels have UVs by x and y over the field's rectangle.
};

/// Normals of a mesh with a map along hard edges of the high poly.
enum class EdgesUnderMap {
  hard,   ///< Split along them, so that small maps need not store the step
  smooth  ///< Smooth but at seams, which saves the split vertices
};

/// Intermediate meshes of one simplification. If the high poly needs no presimplification, each level equals the mesh
/// that simplify() makes for its face count. This also holds if no level has more than 5,000 faces (so that all share
/// one presimplification) and no flaw needs another run. Otherwise, smaller levels may differ slightly, since finer
/// levels need a finer presimplification.
class SimplifyLevels {
 public:
  /// \param high   must outlive this object
  /// \param faces  requested face counts, descending
  /// \throws as simplify()
  SimplifyLevels(const Mesh& high, std::span<const std::uint32_t> faces, LevelRule rule);
  ~SimplifyLevels();
  SimplifyLevels(const SimplifyLevels&) = delete;
  SimplifyLevels& operator=(const SimplifyLevels&) = delete;

  /// Number of different levels: requested counts below the fewest faces that keep the topology are left out.
  std::size_t count() const;
  std::uint32_t requested_faces_of(std::size_t level) const;  ///< Requested number of faces
  std::size_t faces(std::size_t level) const;                 ///< Number of triangles before repair
  std::size_t vertices(std::size_t level) const;

  /// A level's mesh, repaired as by simplify(), without vertex colours: call transfer_colors() for meshes that are
  /// kept. Cached. Flaws of the presimplification that cannot be repaired remain until solve() is called.
  /// \param report  receives the report; if null, nothing is measured, which saves time
  Mesh mesh(std::size_t level, SimplifyReport* report = nullptr) const;
  /// The level's report; measured once and cached.
  SimplifyReport report(std::size_t level) const;

  /// An unrepaired level, fitted with fewer samples, for measuring: the first copy with normals for plain shading,
  /// the second with normals for a normal map.
  std::array<Mesh, 2> draft_meshes(std::size_t level,
                                   EdgesUnderMap edges = EdgesUnderMap::hard) const;

  /// As kiln::fit_normals() for any low poly, such as a level with UVs. Hard edges are chosen as for levels.
  void fit_normals(Mesh& low, EdgesUnderMap edges = EdgesUnderMap::hard) const;

  /// True if mesh() has flaws that solve() may repair.
  bool can_be_solved(std::size_t level) const;
  /// True if mesh() has folded or degenerate triangles, or new holes.
  bool has_flaws(std::size_t level) const;
  /// Rebuilds a flawed level as simplify() does, from another presimplification or the high poly itself. Slow.
  void solve(std::size_t level) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
