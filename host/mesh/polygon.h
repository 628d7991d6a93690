// Polygons into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Splits a polygon of n >= 3 corners into n - 2 triangles of indices into `corners`.
///
/// The corners are seen along the polygon's Newell normal, in double precision. A quad is cut along corners 0
/// and 2, as nearly all programs cut it; along 1 and 3 where that alone spares a triangle that turns over or
/// has less than 1/10000 of the area. More corners: ears, the shortest cut first, then flips to the
/// constrained Delaunay triangulation (mesh/ears.h). Its triangles, their order and corners are
/// the same wherever the polygon begins; of equal choices, the one nearest after the least position decides.
/// Every corner is one of a triangle with area, if the polygon has area and does not touch itself.
/// \param triangles  out: replaced
/// \returns false where something other than ears had to do
bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// The same by a rule (kiln/mesh.h). Blender's quads fold along corners 1 and 3 where the other way
/// turns a triangle over; its larger polygons are cut as its polyfill does, in single precision:
/// ears from corner 0 on, every other corner, to and fro. `shortest` takes the ear with the
/// shortest cut, the first of equals. Where Blender's has no ear left, the remainder becomes a fan.
bool triangulate(std::span<const std::array<double, 3>> corners, Triangulation rule,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace kiln
