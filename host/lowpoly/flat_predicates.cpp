#include "lowpoly/flat_predicates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

namespace kiln {
namespace {

/// 1: left, -1: right, 0: too close to tell, or nearer than `apart` to the line.
int side(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, double apart = 0) {
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double det = left - right;
  const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right)) +
                       (apart > 0 ? apart * std::hypot(b.x - a.x, b.y - a.y) : 0);
  return det > bound ? 1 : det < -bound ? -1 : 0;
}

/// Calls `found(a, b)` for sides that touch, until it returns false.
template <typename Found>
void each_touch(std::span<const FlatPoint> polygon, double apart, const Found& found) {
  const std::size_t count = polygon.size();
  const auto end = [&](std::size_t i) -> const FlatPoint& { return polygon[(i + 1) % count]; };
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  const auto left = [&](std::uint32_t i) { return std::min(polygon[i].x, end(i).x); };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return left(a) < left(b); });
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t a = order[i];
    const double right = std::max(polygon[a].x, end(a).x) + apart;
    const double low = std::min(polygon[a].y, end(a).y) - apart,
                 high = std::max(polygon[a].y, end(a).y) + apart;
    for (std::size_t j = i + 1; j < count && left(order[j]) <= right; ++j) {
      const std::uint32_t b = order[j];
      if (std::max(polygon[b].y, end(b).y) < low || std::min(polygon[b].y, end(b).y) > high)
        continue;
      const bool follows = (a + 1) % count == b;
      if (follows || (b + 1) % count == a) {
        // Neighbours share a corner; they overlap only where they fold back onto each other.
        const std::uint32_t first = follows ? a : b, second = follows ? b : a;
        if (side(polygon[first], end(first), end(second)) == 0 &&
            dot(end(first) - polygon[first], end(second) - polygon[second]) <= 0) {
          if (!found(a, b)) return;
        }
        continue;
      }
      // A short side may stand between two that are next but one.
      const bool near = (a + 2) % count == b || (b + 2) % count == a;
      if (!surely_apart(polygon[a], end(a), polygon[b], end(b), near ? 0 : apart)) {
        if (!found(a, b)) return;
      }
    }
  }
}

}  // namespace

bool surely_left(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  return side(a, b, c) > 0;
}

bool surely_apart(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& d,
                  double apart) {
  const int first = side(a, b, c, apart), second = side(a, b, d, apart);
  if (first != 0 && first == second) return true;
  const int third = side(c, d, a, apart), fourth = side(c, d, b, apart);
  return third != 0 && third == fourth;
}

bool is_simple(std::span<const FlatPoint> polygon, double apart) {
  return polygon.size() >= 3 && !first_touch(polygon, apart);
}

std::optional<std::pair<std::size_t, std::size_t>> first_touch(std::span<const FlatPoint> polygon,
                                                               double apart) {
  std::optional<std::pair<std::size_t, std::size_t>> touch;
  each_touch(polygon, apart, [&](std::size_t a, std::size_t b) {
    touch = {a, b};
    return false;
  });
  return touch;
}

std::vector<std::pair<std::size_t, std::size_t>> touches(std::span<const FlatPoint> polygon,
                                                         double apart, std::size_t most) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  each_touch(polygon, apart, [&](std::size_t a, std::size_t b) {
    found.emplace_back(a, b);
    return found.size() < most;
  });
  return found;
}

}  // namespace kiln
