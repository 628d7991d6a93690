#include "unwrap/flat_predicates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace kiln {
namespace {

double length(const Vec2d& p) { return std::sqrt(dot(p, p)); }

/// 1: left, -1: right, 0: too close to tell, or nearer than `apart` to the line.
int side(const Vec2d& a, const Vec2d& b, const Vec2d& c, double apart = 0) {
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double det = left - right;
  const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right)) +
                       (apart > 0 ? apart * length(b - a) : 0);
  return det > bound ? 1 : det < -bound ? -1 : 0;
}

/// A side of a polygon, and its box.
struct BoxedSide {
  double left = 0, right = 0, low = 0, high = 0;
  std::uint32_t first = 0;
  bool operator<(const BoxedSide& other) const {
    return left < other.left || (left == other.left && first < other.first);
  }
};

/// Calls `found(a, b)` for sides that touch, until it returns false.
template <typename Found>
void each_touch(std::span<const Vec2d> polygon, double apart, const Found& found) {
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
    const double right = sides[i].right + apart, low = sides[i].low - apart,
                 high = sides[i].high + apart;
    for (std::size_t j = i + 1; j < count && sides[j].left <= right; ++j) {
      if (sides[j].high < low || sides[j].low > high) continue;
      const std::size_t b = sides[j].first;
      const bool follows = (a + 1) % count == b;
      if (follows || (b + 1) % count == a) {
        // Neighbours share a corner; they overlap only where they fold back onto each other.
        const std::size_t first = follows ? a : b, second = follows ? b : a;
        if (side(polygon[first], end(first), end(second)) == 0 &&
            dot(end(first) - polygon[first], end(second) - polygon[second]) <= 0) {
          if (!found(a, b)) return;
        }
        continue;
      }
      // A short side may stand between two that are next but one.
      const bool near = (a + 2) % count == b || (b + 2) % count == a;
      if (!segments_apart_certain(polygon[a], end(a), polygon[b], end(b), near ? 0 : apart)) {
        if (!found(a, b)) return;
      }
    }
  }
}

}  // namespace

bool orient2d_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c) { return side(a, b, c) > 0; }

bool segments_apart_certain(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d,
                            double apart) {
  const int first = side(a, b, c, apart), second = side(a, b, d, apart);
  if (first != 0 && first == second) return true;
  const int third = side(c, d, a, apart), fourth = side(c, d, b, apart);
  return third != 0 && third == fourth;
}

bool is_simple(std::span<const Vec2d> polygon, double apart) {
  return polygon.size() >= 3 && !first_touch(polygon, apart);
}

std::optional<std::pair<std::size_t, std::size_t>> first_touch(std::span<const Vec2d> polygon,
                                                               double apart) {
  std::optional<std::pair<std::size_t, std::size_t>> touch;
  each_touch(polygon, apart, [&](std::size_t a, std::size_t b) {
    touch = {a, b};
    return false;
  });
  return touch;
}

std::vector<std::pair<std::size_t, std::size_t>> touches(std::span<const Vec2d> polygon,
                                                         double apart, std::size_t most) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  each_touch(polygon, apart, [&](std::size_t a, std::size_t b) {
    found.emplace_back(a, b);
    return found.size() < most;
  });
  return found;
}

std::size_t covered_sides(std::span<const Vec2d> polygon) {
  constexpr double kBeside = 1e-4;  // Share of a side's length.
  const std::size_t count = polygon.size();
  if (count < 3) return 0;
  const auto [least, most] = std::minmax_element(
      polygon.begin(), polygon.end(), [](const Vec2d& a, const Vec2d& b) { return a.y < b.y; });
  const double low = least->y, per_row = static_cast<double>(count) / (most->y - low);
  if (!(per_row < std::numeric_limits<double>::max())) return 0;
  // Sides by rows of equal height, so that few are asked of each point.
  const auto row = [&](double y) {
    return static_cast<std::size_t>(std::clamp((y - low) * per_row, 0.0, count - 1.0));
  };
  const auto end = [&](std::size_t i) -> const Vec2d& {
    return polygon[i + 1 < count ? i + 1 : 0];
  };
  std::vector<std::uint32_t> first(count + 1, 0), sides;
  const auto each_row = [&](std::size_t i, const auto& body) {
    const auto [bottom, top] = std::minmax(polygon[i].y, end(i).y);
    for (std::size_t r = row(bottom), last = row(top); r <= last; ++r) body(r);
  };
  for (std::size_t i = 0; i < count; ++i) each_row(i, [&](std::size_t r) { ++first[r]; });
  for (std::size_t r = 1; r <= count; ++r) first[r] += first[r - 1];
  sides.resize(first[count]);
  for (std::uint32_t i = 0; i < count; ++i) {
    each_row(i, [&](std::size_t r) { sides[--first[r]] = i; });
  }
  std::size_t covered = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2d along = end(i) - polygon[i];
    const Vec2d at = polygon[i] + along * 0.5 + Vec2d{along.y, -along.x} * kBeside;
    int winding = 0;
    const std::size_t r = row(at.y);
    for (std::uint32_t s = first[r]; s < first[r + 1]; ++s) {
      const Vec2d a = polygon[sides[s]] - at, b = end(sides[s]) - at;
      if ((a.y <= 0) == (b.y <= 0)) continue;
      const bool up = b.y > a.y;
      if ((cross(a, b) > 0) == up) winding += up ? 1 : -1;
    }
    covered += winding > 0 ? 1 : 0;
  }
  return covered;
}

}  // namespace kiln
