// Predicates of orientation and intersection in the plane, in double precision with an error bound.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "unwrap/flat_chart.h"

namespace kiln {

/// True if a, b, c certainly turn left: the determinant exceeds its rounding error (Shewchuk 1997, first bound of
/// orient2d).
bool orient2d_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c);

/// True if segments ab and cd are certainly disjoint: one segment lies entirely on one side of the line through the
/// other.
/// \param min_distance  minimum distance between the segment and that line
bool segments_apart_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d,
                            double min_distance = 0);

/// True if the closed polygon certainly does not touch itself, except at the corners that neighbouring sides share.
/// Implemented as a sweep along x: time about n log n for outlines that are not much longer than wide.
/// \param min_distance  minimum distance between sides. It does not apply to neighbours, nor to two sides with only one
///   side between them
bool is_simple(std::span<const Vec2d> polygon, double min_distance = 0);

/// A pair of sides of the polygon that touch, as indices of their first corners; nullopt if there is none.
std::optional<std::pair<std::size_t, std::size_t>> first_touching_sides(
    std::span<const Vec2d> polygon, double min_distance = 0);

/// Pairs of sides of the polygon that touch, up to a maximum number.
std::vector<std::pair<std::size_t, std::size_t>> touching_sides(std::span<const Vec2d> polygon,
                                                                double min_distance,
                                                                std::size_t most);

}  // namespace kiln
