// A very high poly brought near its goal fast.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vertex_lists.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Triangles that are left of each piece of a mesh.
using PresimplifiedPieces = std::vector<std::vector<Triangle>>;

/// Brings a mesh near `faces`, or less near if that would deviate by more than `error`, by
/// meshoptimizer: it places vertices less well than EdgeCollapser but is ten times as fast. Meshes of 250,000 triangles and more go piece by
/// piece, on all threads; the pieces depend on the mesh alone. Nothing is done
/// where it would not help, or would turn a triangle of a height field over. Nor where vertices have so many
/// triangles that EdgeCollapser is faster (a fan of 120,000: 2.8 s more with it).
/// \param untouched  where triangles stay as they are
/// \param parts      whether parts of which nothing would be left stay as they are; else they vanish
/// \param known      out without untouched places: the pieces; in with some: those of the same call without, of which
///                   all that have no triangle in a place are taken as they are. May be null
void presimplify(Work& work, std::size_t faces, double error, bool height_field,
                 std::span<const Place> untouched, bool parts = true,
                 PresimplifiedPieces* known = nullptr);

/// Drops small components: up to 64 triangles beside a cut, of a part of the dense mesh (that hangs together by edges) of
/// which more is left.
/// \param triangles  in, out
/// \param origin     of each vertex, the dense one; what cuts have made comes after the dense ones
void drop_small_components(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                           const std::vector<std::uint32_t>& origin, const SideLists& dense_sides);

}  // namespace kiln
