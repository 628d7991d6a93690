// Many low polys of one high poly, from one run of collapses.
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

/// Attributes that all levels keep besides the shape.
enum class LevelRule {
  shape,
  keep_uvs,  ///< SimplifyOptions::keep_uvs
  height_field,  ///< SimplifyOptions::height_field; levels have UVs by x and y over the field's rectangle.
};

/// The meshes that simplify() passes on its way down. Where the high poly needs no presimplification, each is the
/// mesh that simplify() makes of that number of faces. The same holds if no level has more than 5,000
/// faces, so that all have one presimplification, and nothing is left to mend. Else the smaller ones may differ a
/// little, since finer meshes need a finer presimplification.
class SimplifyLevels {
 public:
  /// \param high   must outlive this
  /// \param faces  falling
  /// \throws as simplify()
  SimplifyLevels(const Mesh& high, std::span<const std::uint32_t> faces, LevelRule rule);
  ~SimplifyLevels();
  SimplifyLevels(const SimplifyLevels&) = delete;
  SimplifyLevels& operator=(const SimplifyLevels&) = delete;

  /// Levels that differ: those below the fewest faces that keep the shape are left out.
  std::size_t count() const;
  std::uint32_t asked(std::size_t level) const;  ///< Faces that were asked for
  std::size_t faces(std::size_t level) const;    ///< Triangles, before any is mended
  std::size_t vertices(std::size_t level) const;

  /// A level's mesh, mended as simplify() does; without vertex colours, which transfer_colors() gives to what is kept.
  /// Made once. What presimplification left and cannot be mended stays, unless solve() was called.
  /// \param report  where to write what was done; may be null (which saves measuring)
  Mesh mesh(std::size_t level, SimplifyReport* report = nullptr) const;
  /// Report of its making, measured once.
  SimplifyReport report(std::size_t level) const;

  /// A level to be measured, not kept: fitted roughly, nothing mended. First with normals for shading, then with
  /// those for a map.
  std::array<Mesh, 2> rough_meshes(std::size_t level) const;

  /// As kiln::fit_normals(), of any low poly, such as a level with UVs; hard where levels are.
  void fit_normals(Mesh& low) const;

  /// True if mesh() has flaws that solve() may mend.
  bool can_be_solved(std::size_t level) const;
  /// True if mesh() has triangles that are folded or without area, or new holes.
  bool has_flaws(std::size_t level) const;
  /// Makes a flawed level as simplify() does, from other presimplifications or the high poly itself, which takes long.
  void solve(std::size_t level) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
