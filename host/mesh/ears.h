// Polygon triangulation by ear clipping with the shortest cut, and by edge flips.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

using PolygonCorners = std::span<const std::array<double, 3>>;
using FlatPolygon = std::vector<std::array<double, 2>>;
using CornerTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Twice the signed area of the triangle a, b, c; positive if the three points turn left.
double twice_area(const std::array<double, 2>& a, const std::array<double, 2>& b,
                  const std::array<double, 2>& c);

double squared_distance(const std::array<double, 3>& a, const std::array<double, 3>& b);

/// Projects the polygon along its Newell normal. The result is counter-clockwise and of about unit size. It is empty if
/// the polygon has no normal.
FlatPolygon seen_along_normal(PolygonCorners corners);

/// Triangulates by ear clipping (Meisters 1975). The ear with the shortest cut is cut off first; of equal ones, the one
/// with the lowest tip. An ear has an area, and no other corner lies in it or on its sides, so corners on a straight
/// edge get triangles with area. Corners that coincide with a neighbour, or whose two neighbours coincide, are cut off
/// first, since their triangles are degenerate anyway. If there is no ear because the polygon intersects itself, the
/// convex corner with the shortest cut is cut off. O(n log n) for most shapes. After 2^26 corner tests, the remaining
/// polygon is split as if it were convex.
/// \param triangles  [out] n - 2 triangles are appended
/// \returns false if a corner that is no ear had to be cut off
bool shortest_ears(PolygonCorners corners, const FlatPolygon& flat, CornerTriangles& triangles);

/// Splits a convex polygon into halves until the pieces have at most 64 corners. Each piece becomes a fan. A larger fan
/// would consist of overlapping needles, which no bounding volume hierarchy separates.
void split_as_convex(std::span<const std::uint32_t> corners, CornerTriangles& triangles);

/// Flips a diagonal if that enlarges the smallest angle of the two adjacent triangles (Lawson 1977). The result is the
/// constrained Delaunay triangulation if the polygon is simple. This avoids needles at corners that rounding has moved
/// off a straight edge.
void raise_smallest_angles(const FlatPolygon& flat, CornerTriangles& triangles);

}  // namespace kiln
