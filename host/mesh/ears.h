// Ear clipping by the lengths of cuts, and flips of the cuts that it makes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

using PolygonCorners = std::span<const std::array<double, 3>>;
using FlatPolygon = std::vector<std::array<double, 2>>;
using CornerTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Twice the area of a, b, c; above 0 where they turn left.
double twice_area(const std::array<double, 2>& a, const std::array<double, 2>& b,
                  const std::array<double, 2>& c);

double squared_distance(const std::array<double, 3>& a, const std::array<double, 3>& b);

/// The polygon as seen along its Newell normal, turning left on the whole, scaled to about unit size. Empty
/// where it has no normal.
FlatPolygon seen_along_normal(PolygonCorners corners);

/// Takes the ear (Meisters 1975) with the shortest cut, of equal ones that of the lowest tip, again and again.
/// An ear has area and no other corner in it or on its sides, so corners on a straight edge end up in triangles
/// with area. Corners in one place with a neighbour, or with neighbours in one place, come off first: their
/// triangles have no sides to lose. Where no ear is left, since the polygon crosses itself, the shortest cut
/// that turns left is made all the same.
/// Time: n log n for most shapes; beyond 2^26 tests of corners the rest is halved as if convex.
/// \param triangles  out: n - 2 are added
/// \returns false where something other than ears had to do
bool shortest_ears(PolygonCorners corners, const FlatPolygon& flat, CornerTriangles& triangles);

/// Halves a convex polygon until its pieces have 64 corners, which become fans: large fans are needles on top
/// of each other, which no tree takes apart.
void split_as_convex(std::span<const std::uint32_t> corners, CornerTriangles& triangles);

/// Flips cuts where that raises the smallest angle of the two triangles at it (Lawson 1977): the constrained
/// Delaunay triangulation, if the polygon is simple. So no cut leaves a needle that another one spares,
/// such as at corners that rounding moved off a straight edge.
void raise_angles(const FlatPolygon& flat, CornerTriangles& triangles);

}  // namespace kiln
