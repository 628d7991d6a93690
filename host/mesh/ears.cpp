#include "mesh/ears.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>

#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNoCorner = 0xFFFFFFFFU;
constexpr std::uint64_t kMaxTests = std::uint64_t{1} << 26;
constexpr std::size_t kMaxFanCorners = 64;
// Number of corners below which a grid costs more than it saves.
constexpr std::size_t kMinGridCorners = 64;
// Bound on the rounding error of doubled areas: coordinates and their products are about 1 and are rounded to 2^-53.
constexpr double kSignRounding = 1e-12;

using Point = std::array<double, 2>;

/// Corners of the polygon in the cells of a grid.
class CornerGrid {
 public:
  explicit CornerGrid(const FlatPolygon& flat) {
    if (flat.size() < kMinGridCorners) return;
    low_ = high_ = flat[0];
    for (const Point& p : flat) {
      for (std::size_t k = 0; k < 2; ++k) {
        low_[k] = std::min(low_[k], p[k]);
        high_[k] = std::max(high_[k], p[k]);
      }
    }
    side_ = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(flat.size())));
    first_.resize(std::size_t{side_} * side_ + 1);
    for (const Point& p : flat) ++first_[cell(p) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    corners_.resize(flat.size());
    for (std::uint32_t i = 0; i < flat.size(); ++i) corners_[next[cell(flat[i])]++] = i;
  }

  bool empty() const { return corners_.empty(); }

  /// Calls `stop` with the corners in all cells that a triangle may touch, until it returns true.
  /// \param tests  [in, out] budget of tests, reduced by the number of visited cells and corners; 0: exhausted
  template <typename Stop>
  void visit(const std::array<Point, 3>& triangle, std::uint64_t& tests, const Stop& stop) const {
    const auto [bottom, top] = std::minmax({triangle[0][1], triangle[1][1], triangle[2][1]});
    for (std::uint32_t y = row(bottom, 1), last = row(top, 1); y <= last; ++y) {
      const auto [left, right] = columns(triangle, y);
      for (std::uint32_t x = left; x <= right && tests != 0; ++x) {
        --tests;
        const std::size_t c = std::size_t{y} * side_ + x;
        for (std::uint32_t i = first_[c]; i < first_[c + 1] && tests != 0; ++i, --tests) {
          if (stop(corners_[i])) return;
        }
      }
    }
  }

 private:
  std::uint32_t row(double at, std::size_t axis) const {
    const double extent = high_[axis] - low_[axis];
    if (!(extent > 0)) return 0;
    const double share = std::clamp((at - low_[axis]) / extent, 0.0, 1.0);
    return std::min(static_cast<std::uint32_t>(share * side_), side_ - 1);
  }
  std::size_t cell(const Point& p) const {
    return std::size_t{row(p[1], 1)} * side_ + row(p[0], 0);
  }

  /// Columns that a triangle covers in a row, possibly one too many.
  std::pair<std::uint32_t, std::uint32_t> columns(const std::array<Point, 3>& triangle,
                                                  std::uint32_t y) const {
    const double height = (high_[1] - low_[1]) / side_;
    // The row's bounds, enlarged by the rounding error of its corners.
    const double from = low_[1] + (y - 0.001) * height, to = low_[1] + (y + 1.001) * height;
    double left = std::numeric_limits<double>::infinity(), right = -left;
    const auto reach = [&](double x) {
      left = std::min(left, x);
      right = std::max(right, x);
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const Point &a = triangle[k], &b = triangle[(k + 1) % 3];
      if (from <= a[1] && a[1] <= to) reach(a[0]);
      for (const double line : {from, to}) {
        if ((a[1] < line) == (b[1] < line)) continue;
        reach(a[0] + (b[0] - a[0]) * ((line - a[1]) / (b[1] - a[1])));
      }
    }
    if (!(left <= right)) return {row(triangle[0][0], 0), row(triangle[0][0], 0)};
    const double slack = 0.001 * (high_[0] - low_[0]) / side_;
    return {row(left - slack, 0), row(right + slack, 0)};
  }

  Point low_{}, high_{};
  std::uint32_t side_ = 0;
  std::vector<std::uint32_t> first_, corners_;
};

class Ears {
 public:
  Ears(PolygonCorners corners, const FlatPolygon& flat)
      : corners_(corners),
        flat_(flat),
        grid_(flat),
        left_(static_cast<std::uint32_t>(flat.size())),
        version_(flat.size()),
        last_blocked_(flat.size(), kNoCorner) {
    for (std::uint32_t i = 0; i < left_; ++i) {
      next_.push_back((i + 1) % left_);
      before_.push_back((i + left_ - 1) % left_);
    }
  }

  bool run(CornerTriangles& triangles) {
    bool only_ears = true;
    for (std::uint32_t i = 0; i < flat_.size(); ++i) queue_if_ear(i);
    while (left_ > 3) {
      if (cuts_.empty()) {
        only_ears = cut_non_ear(triangles) && only_ears;
      } else {
        const Cut cut = cuts_.top();
        cuts_.pop();
        if (cut.version == version_[cut.tip] && is_ear(cut.tip)) cut_off(cut.tip, triangles);
      }
      if (tests_ == 0) {
        only_ears = false;
        break;
      }
    }
    std::vector<std::uint32_t> remaining_corners;
    for (std::uint32_t i = 0; i < flat_.size(); ++i) {
      if (version_[i] != kNoCorner) remaining_corners.push_back(i);
    }
    split_as_convex(remaining_corners, triangles);
    return only_ears;
  }

 private:
  struct Cut {
    double length;  // Squared length of the cut
    std::uint32_t tip, version;
    // Orders by descending length, because a priority queue has its largest element on top
    bool operator<(const Cut& other) const {
      return std::tie(other.length, other.tip) < std::tie(length, tip);
    }
  };
  struct BlockedCorner {
    std::uint32_t tip, version, next;
  };

  double length(std::uint32_t tip) const {
    return squared_distance(corners_[before_[tip]], corners_[next_[tip]]);
  }
  double turn(std::uint32_t tip) const {
    return twice_area(flat_[before_[tip]], flat_[tip], flat_[next_[tip]]);
  }
  bool has_no_sides(std::uint32_t tip) const {
    const auto &a = corners_[before_[tip]], &b = corners_[tip], &c = corners_[next_[tip]];
    return a == b || b == c || c == a;
  }

  void queue_if_ear(std::uint32_t tip) {
    if (has_no_sides(tip)) {
      cuts_.push({0, tip, version_[tip]});
    } else if (turn(tip) > 0) {
      cuts_.push({length(tip), tip, version_[tip]});
    }
  }

  /// True if the tip can be cut off. Otherwise, records the corner that blocks it, whose removal triggers another
  /// test.
  bool is_ear(std::uint32_t tip) {
    if (has_no_sides(tip)) return true;
    const std::uint32_t before = before_[tip], next = next_[tip];
    const Point &a = flat_[before], &b = flat_[tip], &c = flat_[next];
    std::uint32_t blocking_corner = kNoCorner;
    const auto lies_in = [&](std::uint32_t i) {
      const Point& p = flat_[i];
      if (version_[i] == kNoCorner || p == a || p == b || p == c) return false;
      if (twice_area(a, b, p) < 0 || twice_area(b, c, p) < 0 || twice_area(c, a, p) < 0) {
        return false;
      }
      blocking_corner = i;
      return true;
    };
    if (grid_.empty()) {
      for (std::uint32_t i = next_[next]; i != before && tests_ != 0; i = next_[i], --tests_) {
        if (lies_in(i)) break;
      }
    } else {
      grid_.visit({a, b, c}, tests_, lies_in);
    }
    if (blocking_corner == kNoCorner) return tests_ != 0;
    blocked_.push_back({tip, version_[tip], last_blocked_[blocking_corner]});
    last_blocked_[blocking_corner] = static_cast<std::uint32_t>(blocked_.size() - 1);
    return false;
  }

  void cut_off(std::uint32_t tip, CornerTriangles& triangles) {
    const std::uint32_t before = before_[tip], next = next_[tip];
    triangles.push_back({before, tip, next});
    next_[before] = next;
    before_[next] = before;
    version_[tip] = kNoCorner;
    --left_;
    for (const std::uint32_t beside : {before, next}) {
      ++version_[beside];
      queue_if_ear(beside);
    }
    for (std::uint32_t w = last_blocked_[tip]; w != kNoCorner; w = blocked_[w].next) {
      if (blocked_[w].version == version_[blocked_[w].tip]) queue_if_ear(blocked_[w].tip);
    }
  }

  /// Cuts off a corner that is not an ear.
  /// \returns true if the corner lies on a straight line and only rounding keeps it from being an ear
  bool cut_non_ear(CornerTriangles& triangles) {
    std::uint32_t first = 0, best = kNoCorner;
    while (version_[first] == kNoCorner) ++first;
    std::tuple<bool, double, std::uint32_t> least;
    for (std::uint32_t k = 0, tip = first; k < left_; ++k, tip = next_[tip]) {
      const std::tuple rank(!(turn(tip) > 0), length(tip), tip);
      if (best == kNoCorner || rank < least) std::tie(best, least) = std::pair(tip, rank);
    }
    tests_ -= std::min<std::uint64_t>(tests_, first + left_);
    const bool straight = std::abs(turn(best)) < kSignRounding;
    cut_off(best, triangles);
    return straight;
  }

  PolygonCorners corners_;
  const FlatPolygon& flat_;
  CornerGrid grid_;
  std::uint32_t left_;
  std::uint64_t tests_ = kMaxTests;
  std::vector<std::uint32_t> next_, before_;
  /// How often each corner's neighbours have changed; kNoCorner: the corner is cut off
  std::vector<std::uint32_t> version_;
  std::priority_queue<Cut> cuts_;
  std::vector<BlockedCorner> blocked_;
  std::vector<std::uint32_t>
      last_blocked_;  ///< For each corner, the last element of `blocked_` that it blocks
};

/// Sine of a triangle's smallest angle; 0 or less if it has no area or turns right.
double smallest_angle(const FlatPolygon& flat, const std::array<std::uint32_t, 3>& t) {
  std::array<double, 3> sides{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &a = flat[t[k]], &b = flat[t[(k + 1) % 3]];
    sides[k] = std::hypot(b[0] - a[0], b[1] - a[1]);
  }
  std::sort(sides.begin(), sides.end());
  const double product = sides[1] * sides[2];
  return product > 0 ? twice_area(flat[t[0]], flat[t[1]], flat[t[2]]) / product : 0;
}

}  // namespace

double twice_area(const std::array<double, 2>& a, const std::array<double, 2>& b,
                  const std::array<double, 2>& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double squared_distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

FlatPolygon seen_along_normal(PolygonCorners corners) {
  double extent = 0;
  for (const auto& corner : corners) {
    const double distance = std::sqrt(squared_distance(corner, corners[0]));
    if (!std::isfinite(distance)) return {};
    extent = std::max(extent, distance);
  }
  if (!(extent > 0)) return {};
  const auto at = [&](std::size_t i, std::size_t k) {
    return (corners[i][k] - corners[0][k]) / extent;
  };
  Vec3d n{};
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    n += Vec3d((at(j, 1) - at(i, 1)) * (at(j, 2) + at(i, 2)),
               (at(j, 2) - at(i, 2)) * (at(j, 0) + at(i, 0)),
               (at(j, 0) - at(i, 0)) * (at(j, 1) + at(i, 1)));
  }
  if (!(glm::length(n) > 0)) return {};
  n = n * (1 / glm::length(n));
  const Vec3d axis = std::abs(n.x) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  Vec3d u = axis - n * dot(axis, n);
  u = u * (1 / glm::length(u));
  const Vec3d v = cross(n, u);
  FlatPolygon flat;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d p(at(i, 0), at(i, 1), at(i, 2));
    flat.push_back({dot(p, u), dot(p, v)});
  }
  return flat;
}

bool shortest_ears(PolygonCorners corners, const FlatPolygon& flat, CornerTriangles& triangles) {
  return Ears(corners, flat).run(triangles);
}

void split_as_convex(std::span<const std::uint32_t> corners, CornerTriangles& triangles) {
  if (corners.size() > kMaxFanCorners) {
    const std::size_t middle = corners.size() / 2;
    triangles.push_back({corners.front(), corners[middle], corners.back()});
    split_as_convex(corners.subspan(0, middle + 1), triangles);
    split_as_convex(corners.subspan(middle), triangles);
    return;
  }
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    triangles.push_back({corners[0], corners[i], corners[i + 1]});
  }
}

void raise_angles(const FlatPolygon& flat, CornerTriangles& triangles) {
  // Sides, sorted by their corners in ascending order, to find the neighbour across each side.
  std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> sides;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      sides.emplace_back(low, high, 3 * t + k);
    }
  }
  std::sort(sides.begin(), sides.end());
  // For each side, the matching side of the adjacent triangle
  std::vector<std::uint32_t> across(3 * triangles.size(), kNoCorner);
  for (std::size_t i = 1; i < sides.size(); ++i) {
    const auto& [a, b, one] = sides[i - 1];
    const auto& [c, d, other] = sides[i];
    if (a != c || b != d) continue;
    across[one] = other;
    across[other] = one;
  }
  const auto join = [&](std::uint32_t side, std::uint32_t other) {
    across[side] = other;
    if (other != kNoCorner) across[other] = side;
  };
  std::vector<double> angles;
  for (const auto& t : triangles) angles.push_back(smallest_angle(flat, t));
  std::queue<std::uint32_t> open;
  for (std::uint32_t s = 0; s < across.size(); ++s) open.push(s);
  // Each flip increases the sorted list of angles, so flipping terminates, usually after a few flips per corner.
  std::uint64_t flips = 64 * std::uint64_t{triangles.size()};
  for (; !open.empty() && flips != 0; open.pop()) {
    const std::uint32_t side = open.front(), other = across[side];
    if (other == kNoCorner) continue;
    const std::uint32_t t = side / 3, u = other / 3;
    const auto after = [](std::uint32_t s, std::uint32_t by) {
      return s / 3 * 3 + (s % 3 + by) % 3;
    };
    const std::uint32_t a = triangles[t][side % 3], b = triangles[t][(side + 1) % 3];
    const std::uint32_t c = triangles[t][after(side, 2) % 3], d = triangles[u][after(other, 2) % 3];
    const std::array<std::uint32_t, 3> one = {c, a, d}, two = {d, b, c};
    const double first = smallest_angle(flat, one), second = smallest_angle(flat, two);
    if (!(std::min(first, second) > std::min(angles[t], angles[u]) + kSignRounding)) continue;
    --flips;
    const std::uint32_t ca = across[after(side, 2)], bc = across[after(side, 1)];
    const std::uint32_t ad = across[after(other, 1)], db = across[after(other, 2)];
    triangles[t] = one;
    triangles[u] = two;
    angles[t] = first;
    angles[u] = second;
    join(3 * t, ca);
    join(3 * t + 1, ad);
    join(3 * t + 2, 3 * u + 2);
    join(3 * u, db);
    join(3 * u + 1, bc);
    for (const std::uint32_t s : {3 * t, 3 * t + 1, 3 * u, 3 * u + 1}) open.push(s);
  }
}

}  // namespace kiln
