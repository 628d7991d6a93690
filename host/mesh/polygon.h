// Triangulation of polygons.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Splits a polygon of n >= 3 corners into n - 2 triangles, whose corners are indices into `corners`.
///
/// The polygon is projected along its Newell normal, in double precision. A quad is cut between corners 0 and 2, as in
/// nearly all programs. It is cut between 1 and 3 only if this avoids a flipped triangle, or one with less than 1/10000
/// of the area. Other polygons are triangulated by ear clipping with the shortest cut first, then flipped to the
/// constrained Delaunay triangulation (mesh/ears.h). The triangles, their order and their corners do not depend on
/// which corner of the polygon comes first: ties are broken by the order of corners from the lexicographically smallest
/// position on. Every corner belongs to a triangle with area if the polygon has an area and does not touch itself.
/// \param triangles  [out] replaced by the result
/// \returns false if a corner that is no ear had to be cut off
bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Triangulates as other programs do (see Triangulation in kiln/mesh.h). Blender cuts a quad between corners 1 and 3 if
/// the other cut flips a triangle. It cuts larger polygons as its polyfill does, in single precision: ears from corner
/// 0 on, skipping every other corner, with alternating direction. `shortest` cuts the ear with the shortest cut, or the
/// first of several such ears. If Blender's algorithm finds no ear, the remaining polygon becomes a fan.
bool triangulate(std::span<const std::array<double, 3>> corners, Triangulation rule,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace kiln
