// Fast presimplification of very dense meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vertex_lists.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// For each piece of a mesh, the triangles that remain.
using PresimplifiedPieces = std::vector<std::vector<Triangle>>;

/// Reduces a mesh to about `faces` triangles by meshoptimizer, or to more if the mesh would otherwise deviate by more
/// than `error`. meshoptimizer places vertices less well than EdgeCollapser, but is ten times as fast. Meshes of
/// 250,000 triangles and more are reduced in pieces on all threads; the pieces depend on the mesh alone. Does nothing
/// if the mesh is not much denser than `faces`, if a triangle of a height field would flip, or if vertices have so many
/// triangles that EdgeCollapser is faster (by 2.8 s for a fan of 120,000 triangles).
/// \param untouched     balls in which all triangles are kept
/// \param parts         true: components that would vanish stay as they are
/// \param known_pieces  simplified pieces for reuse; may be null. A call with empty `untouched` writes them. A later
///   call reads them, and reuses each piece that none of its balls touches
void presimplify(Work& work, std::size_t faces, double error, bool height_field,
                 std::span<const Ball> untouched, bool parts = true,
                 PresimplifiedPieces* known_pieces = nullptr);

/// Reduces a chunk of a mesh to about `faces` triangles by meshoptimizer, without changing its border. Where triangles
/// fold, vertices move slightly.
/// \param positions, triangles  [in, out]
void presimplify_chunk(std::vector<Vec3>& positions, std::vector<Triangle>& triangles,
                       std::size_t faces);

/// Removes small components. These have at most 64 triangles and lie beside a cut, while other triangles of the same
/// dense component (connected over edges) remain.
/// \param triangles  [in, out]
/// \param origin     for each vertex, the dense vertex; vertices that cuts have created have indices above the dense
///   ones
void drop_small_components(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                           const std::vector<std::uint32_t>& origin, const SideLists& dense_sides);

}  // namespace kiln
