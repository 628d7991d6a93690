// Triangulation of polygons.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Splits a polygon of n >= 3 corners into n - 2 triangles of indices into `corners`.
///
/// The polygon is projected along its Newell normal, in double precision. A quad is cut between corners 0 and 2, as
/// by nearly all programs; between 1 and 3 only if this avoids a flipped triangle, or one with less than 1/10000 of
/// the area. Other polygons are triangulated by ear clipping with the shortest cut first, then flipped to the
/// constrained Delaunay triangulation (mesh/ears.h). Triangles, their order and corners do not depend on the
/// polygon's first corner: ties are resolved from its lowest position. Every corner belongs to a triangle with area
/// if the polygon has area and does not touch itself.
/// \param triangles  [out] replaced
/// \returns false if a cut other than an ear was needed
bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Triangulation by another program's rule (kiln/mesh.h). Blender cuts quads between corners 1 and 3 if the other cut
/// flips a triangle. It cuts larger polygons as its polyfill does, in single precision: ears from corner 0 on,
/// skipping every other corner, with alternating direction. `shortest` cuts the ear with the shortest cut, or the
/// first of several such ears. If Blender's algorithm finds no ear, the remaining polygon becomes a fan.
bool triangulate(std::span<const std::array<double, 3>> corners, Triangulation rule,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace kiln
