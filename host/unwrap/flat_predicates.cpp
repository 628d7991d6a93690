#include "unwrap/flat_predicates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kiln {
namespace {

double length(const Vec2d& p) { return std::sqrt(dot(p, p)); }

/// Side of the line ab on which c lies. 1: left; -1: right; 0: c is nearer to the line than `min_distance`, or rounding
/// leaves the side undecided.
int side_of_line(const Vec2d& a, const Vec2d& b, const Vec2d& c, double min_distance = 0) {
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double det = left - right;
  const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right)) +
                       (min_distance > 0 ? min_distance * length(b - a) : 0);
  return det > bound ? 1 : det < -bound ? -1 : 0;
}

/// A side of a polygon and its bounding box.
struct BoxedSide {
  double left = 0, right = 0, low = 0, high = 0;
  std::uint32_t first = 0;
  bool operator<(const BoxedSide& other) const {
    return left < other.left || (left == other.left && first < other.first);
  }
};

/// Calls `found(a, b)` for each pair of sides of the polygon that touch. Stops when `found` returns false.
template <typename Found>
void for_each_touching_pair(std::span<const Vec2d> polygon, double min_distance,
                            const Found& found) {
  const std::size_t count = polygon.size();
  const auto end = [&](std::size_t i) -> const Vec2d& {
    return polygon[i + 1 < count ? i + 1 : 0];
  };
  std::vector<BoxedSide> sides(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec2d &p = polygon[i], &q = end(i);
    sides[i] = {std::min(p.x, q.x), std::max(p.x, q.x), std::min(p.y, q.y), std::max(p.y, q.y), i};
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t a = sides[i].first;
    const double right = sides[i].right + min_distance, low = sides[i].low - min_distance,
                 high = sides[i].high + min_distance;
    for (std::size_t j = i + 1; j < count && sides[j].left <= right; ++j) {
      if (sides[j].high < low || sides[j].low > high) continue;
      const std::size_t b = sides[j].first;
      const bool is_next = (a + 1) % count == b;
      if (is_next || (b + 1) % count == a) {
        // Neighbouring sides share a corner; they overlap only if the second folds back onto the first.
        const std::size_t first = is_next ? a : b, second = is_next ? b : a;
        if (side_of_line(polygon[first], end(first), end(second)) == 0 &&
            dot(end(first) - polygon[first], end(second) - polygon[second]) <= 0) {
          if (!found(a, b)) return;
        }
        continue;
      }
      // With a single side between them, two sides may be nearer than `min_distance`, since that side may be short.
      const bool have_one_between = (a + 2) % count == b || (b + 2) % count == a;
      if (!segments_apart_certain(polygon[a], end(a), polygon[b], end(b),
                                  have_one_between ? 0 : min_distance)) {
        if (!found(a, b)) return;
      }
    }
  }
}

}  // namespace

bool orient2d_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return side_of_line(a, b, c) > 0;
}

bool segments_apart_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d,
                            double min_distance) {
  const int side_of_c = side_of_line(a, b, c, min_distance),
            side_of_d = side_of_line(a, b, d, min_distance);
  if (side_of_c != 0 && side_of_c == side_of_d) return true;
  const int side_of_a = side_of_line(c, d, a, min_distance),
            side_of_b = side_of_line(c, d, b, min_distance);
  return side_of_a != 0 && side_of_a == side_of_b;
}

bool is_simple(std::span<const Vec2d> polygon, double min_distance) {
  return polygon.size() >= 3 && !first_touching_sides(polygon, min_distance);
}

std::optional<std::pair<std::size_t, std::size_t>> first_touching_sides(
    std::span<const Vec2d> polygon, double min_distance) {
  std::optional<std::pair<std::size_t, std::size_t>> touching_pair;
  for_each_touching_pair(polygon, min_distance, [&](std::size_t a, std::size_t b) {
    touching_pair = {a, b};
    return false;
  });
  return touching_pair;
}

std::vector<std::pair<std::size_t, std::size_t>> touching_sides(std::span<const Vec2d> polygon,
                                                                double min_distance,
                                                                std::size_t most) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  for_each_touching_pair(polygon, min_distance, [&](std::size_t a, std::size_t b) {
    found.emplace_back(a, b);
    return found.size() < most;
  });
  return found;
}

}  // namespace kiln
