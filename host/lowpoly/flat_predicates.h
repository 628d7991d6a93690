// Sides and crossings in the plane, in double precision with an error bound.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "lowpoly/flat_chart.h"

namespace kiln {

/// Whether a, b, c turn left beyond doubt: above the rounding of the determinant (Shewchuk 1997,
/// orient2d's first bound).
bool surely_left(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c);

/// Whether segments ab and cd are apart beyond doubt: one lies on one side of the other's line.
/// \param apart  and at least this far from it
bool surely_apart(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& d,
                  double apart = 0);

/// Whether the closed polygon does not touch itself, beyond doubt, but for neighbours at their corner.
/// Sorted along x: about n log n for outlines that are no worse than round.
/// \param apart  how far from each other sides must be that are not next to each other, nor next but one
bool is_simple(std::span<const FlatPoint> polygon, double apart = 0);

/// The first two sides found that touch, by the numbers of their first corners.
std::optional<std::pair<std::size_t, std::size_t>> first_touch(std::span<const FlatPoint> polygon,
                                                               double apart = 0);

/// All that are found, up to a number.
std::vector<std::pair<std::size_t, std::size_t>> touches(std::span<const FlatPoint> polygon,
                                                         double apart, std::size_t most);

/// How many sides of a counter-clockwise polygon have its inside on their right, too: there it lies twice. Looked
/// at beside the middle of each.
std::size_t covered_sides(std::span<const FlatPoint> polygon);

}  // namespace kiln
