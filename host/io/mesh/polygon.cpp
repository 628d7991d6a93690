#include "io/mesh/polygon.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

struct Point {
  double x = 0, y = 0;
};

double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool same(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y; }

/// The polygon in the plane where it turns left on the whole, scaled to about unit size so that no
/// product leaves the range of double. Empty where it has no plane.
std::vector<Point> flatten(std::span<const std::array<double, 3>> corners) {
  double extent = 0;
  for (const auto& corner : corners) {
    for (int k = 0; k < 3; ++k) {
      extent = std::max(extent, std::abs(corner[k] - corners[0][k]));
      if (!std::isfinite(corner[k])) return {};
    }
  }
  if (!(extent > 0) || !std::isfinite(extent)) return {};
  const auto at = [&](std::size_t i, int k) { return (corners[i][k] - corners[0][k]) / extent; };
  std::array<double, 3> normal{};
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    for (int k = 0; k < 3; ++k) {
      const int u = (k + 1) % 3, v = (k + 2) % 3;
      normal[k] += (at(j, u) - at(i, u)) * (at(j, v) + at(i, v));
    }
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  }
  if (normal[axis] == 0) return {};
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Point> flat(corners.size());
  for (std::size_t i = 0; i < flat.size(); ++i) flat[i] = {at(i, u), at(i, v)};
  return flat;
}

bool convex(const std::vector<Point>& flat) {
  const std::size_t n = flat.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) < 0) return false;
  }
  return true;
}

/// What needs no ears: the fan around the first corner, or, of more than kFan corners, halves, halves of these and
/// so on. Large fans are needles on top of each other, which no tree takes apart.
constexpr std::size_t kFan = 64;
void split_rest(std::span<const std::uint32_t> rest,
                std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (rest.size() > kFan) {
    const std::size_t middle = rest.size() / 2;
    triangles.push_back({rest.front(), rest[middle], rest.back()});
    split_rest(rest.subspan(0, middle + 1), triangles);
    split_rest(rest.subspan(middle), triangles);
    return;
  }
  for (std::size_t i = 1; i + 1 < rest.size(); ++i) {
    triangles.push_back({rest[0], rest[i], rest[i + 1]});
  }
}

}  // namespace

bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const auto n = static_cast<std::uint32_t>(corners.size());
  triangles.clear();
  std::vector<std::uint32_t> left(n);
  for (std::uint32_t i = 0; i < n; ++i) left[i] = i;
  bool clean = true;

  if (n > 3) {
    const std::vector<Point> flat = flatten(corners);
    if (flat.empty()) {
      clean = false;
    } else if (!convex(flat)) {
      std::uint64_t budget =
          std::min<std::uint64_t>(std::uint64_t{n} * n * n, std::uint64_t{1} << 26);
      const auto is_ear = [&](std::size_t i) {
        if (budget == 0) return false;
        --budget;
        const std::size_t m = left.size();
        const Point& a = flat[left[(i + m - 1) % m]];
        const Point& b = flat[left[i]];
        const Point& c = flat[left[(i + 1) % m]];
        if (!(turn(a, b, c) > 0)) return false;
        for (std::size_t k = 2; k + 1 < m && budget != 0; ++k, --budget) {
          const Point& p = flat[left[(i + k) % m]];
          if (same(p, a) || same(p, b) || same(p, c)) continue;
          if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
        }
        return budget != 0;
      };
      while (left.size() > 3) {
        std::size_t ear = 1;
        while (ear <= left.size() && !is_ear(ear % left.size())) ++ear;
        if (ear > left.size()) {
          clean = false;
          break;
        }
        const std::size_t m = left.size(), i = ear % m;
        triangles.push_back({left[(i + m - 1) % m], left[i], left[(i + 1) % m]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
        budget -= std::min<std::uint64_t>(budget, m / 16);  // moving the tail is work too
      }
    }
  }
  split_rest(left, triangles);
  return clean;
}

}  // namespace kiln
