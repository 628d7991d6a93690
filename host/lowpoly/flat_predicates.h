// Sides and crossings in the plane, in double precision with an error bound.
#pragma once

#include <span>

#include "lowpoly/flat_chart.h"

namespace kiln {

/// Whether a, b, c turn left beyond doubt: above the rounding of the determinant (Shewchuk 1997,
/// orient2d's first bound).
bool surely_left(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c);

/// Whether segments ab and cd are apart beyond doubt: one lies on one side of the other's line.
bool surely_apart(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& d);

/// Whether the closed polygon does not touch itself, beyond doubt, but for neighbours at their corner.
/// Sorted along x: about n log n for outlines that are no worse than round.
bool is_simple(std::span<const FlatPoint> polygon);

}  // namespace kiln
