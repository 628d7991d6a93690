// Edges without length: taken out where the surface stays what it is.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Corners of a triangle (the last one 0xFFFFFFFF) or a quad.
using PolygonCorners = std::array<std::uint32_t, 4>;

/// True if two places are one but for the rounding of floats.
bool same_place(const Vec3& a, const Vec3& b);

/// Joins neighbours at the same place: integer data at an integer value have the vertices of several
/// cells on one voxel. Polygons beside the edge lose a corner, and triangles vanish. An edge stays where
/// that would change the surface: where it is not between two polygons; where it would close the open
/// border; where polygons beside its ends meet otherwise (the link condition of Dey et al. 1999,
/// "Topology preserving edge contraction", with quads as wholes). Edges go in the order of the polygons.
/// \param at     a vertex's place
/// \param count  vertices from this number on are left alone
/// \return vertices that are gone, each with the one that stands for it (never one that is gone)
std::vector<std::pair<std::uint32_t, std::uint32_t>> collapse_short_edges(
    std::vector<PolygonCorners>& polygons, const std::function<Vec3(std::uint32_t)>& at,
    std::uint32_t count = 0xFFFFFFFF);

}  // namespace kiln
