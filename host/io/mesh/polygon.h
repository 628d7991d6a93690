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
/// The corners are projected along the polygon's Newell normal (double precision). A convex polygon
/// becomes the fan around corner 0. With more than 64 corners, it is halved until its pieces have as
/// few. Others are cut by ear clipping (Meisters 1975). The first ear after corner 0 is always taken,
/// so the result depends on the input alone. A polygon that crosses itself or has no area may have no
/// ear. There, or beyond 16 n^2 (at most 2^22) point tests, the remainder is split as a convex polygon.
/// \param triangles  out: replaced
/// \returns false where something other than ears had to do
bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// The same by a rule (kiln/mesh.h). Blender's quads fold along corners 1 and 3 where the other way
/// turns a triangle over; its larger polygons are cut as its polyfill does, in single precision:
/// ears from corner 0 on, every other corner, to and fro. `shortest` takes the ear with the
/// shortest cut, the first of equals. Where no ear is left, the remainder becomes a fan.
bool triangulate(std::span<const std::array<double, 3>> corners, Triangulation rule,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace kiln
