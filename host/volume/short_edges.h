// Removes zero-length edges where the topology stays the same.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Corners of a quad, or of a triangle (the last one is 0xFFFFFFFF).
using PolygonCorners = std::array<std::uint32_t, 4>;

/// True if two positions are equal up to rounding of floats.
bool same_place(const Vec3& a, const Vec3& b);

/// Merges adjacent vertices that have the same position. Such vertices occur in integer data with
/// an integer iso value, where the vertices of several cells may lie on the same voxel. A quad at a
/// collapsed edge becomes a triangle; a triangle there is removed. An edge is kept if collapsing it
/// would change the topology: if it is not between two polygons, if it would close the open border,
/// or if polygons at both ends share other corners (the link condition of Dey et al. 1999,
/// "Topology preserving edge contraction", with quads as single faces). Edges are processed in the
/// order of the polygons.
/// \param at     position of a vertex
/// \param count  number of vertices that may be merged; higher ones are kept
/// \returns pairs of a removed vertex and the vertex that replaces it, which itself is not removed
std::vector<std::pair<std::uint32_t, std::uint32_t>> collapse_short_edges(
    std::vector<PolygonCorners>& polygons, const std::function<Vec3(std::uint32_t)>& at,
    std::uint32_t count = 0xFFFFFFFF);

}  // namespace kiln
