// Fast presimplification of very dense meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vertex_lists.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Remaining triangles of each piece of a mesh.
using PresimplifiedPieces = std::vector<std::vector<Triangle>>;

/// Reduces a mesh to about `faces` triangles by meshoptimizer, or to more if it would deviate by more than `error`.
/// meshoptimizer places vertices less well than EdgeCollapser, but is ten times as fast. Meshes of 250,000 triangles
/// and more are reduced in pieces on all threads; the pieces depend on the mesh alone. Does nothing if it would not
/// help, if a triangle of a height field would flip, or if vertices have so many triangles that EdgeCollapser is
/// faster (a fan of 120,000 triangles takes 2.8 s longer here).
/// \param untouched  places where triangles are kept
/// \param parts      true: components that would vanish are kept as they are
/// \param known      without untouched places: receives the pieces; with some: the pieces of the same call without
///               them; those that touch no place are reused. May be null
void presimplify(Work& work, std::size_t faces, double error, bool height_field,
                 std::span<const Place> untouched, bool parts = true,
                 PresimplifiedPieces* known = nullptr);

/// Removes small components: at most 64 triangles beside a cut, if more is left of the same component of the dense
/// mesh (connected over edges).
/// \param triangles  [in, out]
/// \param origin     by vertex, its dense vertex; vertices that cuts have created come after the dense ones
void drop_small_components(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                           const std::vector<std::uint32_t>& origin, const SideLists& dense_sides);

}  // namespace kiln
