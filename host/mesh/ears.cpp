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
// For polygons with fewer corners, a grid costs more than it saves.
constexpr std::size_t kMinGridCorners = 64;
// Bound on the rounding error of doubled areas. Coordinates and their products are about 1, and are rounded to 2^-53.
constexpr double kSignRounding = 1e-12;

using Point = std::array<double, 2>;

/// A grid whose cells list the polygon's corners.
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
    cells_per_side_ = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(flat.size())));
    first_.resize(std::size_t{cells_per_side_} * cells_per_side_ + 1);
    for (const Point& p : flat) ++first_[cell(p) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    corners_.resize(flat.size());
    for (std::uint32_t i = 0; i < flat.size(); ++i) corners_[next[cell(flat[i])]++] = i;
  }

  bool empty() const { return corners_.empty(); }

  /// Calls `stop` for each corner in the cells that a triangle may touch, until `stop` returns true.
  /// \param tests  [in, out] number of tests that are still allowed; reduced by the number of visited cells and
  ///   corners. At 0, the search stops
  template <typename Stop>
  void visit_corners(const std::array<Point, 3>& triangle, std::uint64_t& tests,
                     const Stop& stop) const {
    const auto [bottom, top] = std::minmax({triangle[0][1], triangle[1][1], triangle[2][1]});
    for (std::uint32_t y = row(bottom, 1), last = row(top, 1); y <= last; ++y) {
      const auto [left, right] = columns_in_row(triangle, y);
      for (std::uint32_t x = left; x <= right && tests != 0; ++x) {
        --tests;
        const std::size_t c = std::size_t{y} * cells_per_side_ + x;
        for (std::uint32_t i = first_[c]; i < first_[c + 1] && tests != 0; ++i, --tests) {
          if (stop(corners_[i])) return;
        }
      }
    }
  }

 private:
  std::uint32_t row(double at, std::size_t axis) const {
    const double grid_size = high_[axis] - low_[axis];
    if (!(grid_size > 0)) return 0;
    const double share = std::clamp((at - low_[axis]) / grid_size, 0.0, 1.0);
    return std::min(static_cast<std::uint32_t>(share * cells_per_side_), cells_per_side_ - 1);
  }
  std::size_t cell(const Point& p) const {
    return std::size_t{row(p[1], 1)} * cells_per_side_ + row(p[0], 0);
  }

  /// The columns that a triangle covers in a row, possibly one too many at each end.
  std::pair<std::uint32_t, std::uint32_t> columns_in_row(const std::array<Point, 3>& triangle,
                                                         std::uint32_t y) const {
    const double height = (high_[1] - low_[1]) / cells_per_side_;
    // The bounds of the row, enlarged by the rounding error of its corners.
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
    const double slack = 0.001 * (high_[0] - low_[0]) / cells_per_side_;
    return {row(left - slack, 0), row(right + slack, 0)};
  }

  Point low_{}, high_{};
  std::uint32_t cells_per_side_ = 0;
  std::vector<std::uint32_t> first_, corners_;
};

class Ears {
 public:
  Ears(PolygonCorners corners, const FlatPolygon& flat)
      : corners_(corners),
        flat_(flat),
        grid_(flat),
        remaining_count_(static_cast<std::uint32_t>(flat.size())),
        corner_version_(flat.size()),
        last_blocked_(flat.size(), kNoCorner) {
    for (std::uint32_t i = 0; i < remaining_count_; ++i) {
      next_.push_back((i + 1) % remaining_count_);
      before_.push_back((i + remaining_count_ - 1) % remaining_count_);
    }
  }

  bool run(CornerTriangles& triangles) {
    bool cut_only_ears = true;
    for (std::uint32_t i = 0; i < flat_.size(); ++i) queue_if_ear(i);
    while (remaining_count_ > 3) {
      if (cut_queue_.empty()) {
        cut_only_ears = cut_non_ear(triangles) && cut_only_ears;
      } else {
        const EarCut cut = cut_queue_.top();
        cut_queue_.pop();
        if (cut.version == corner_version_[cut.tip] && is_ear(cut.tip)) cut_off(cut.tip, triangles);
      }
      if (tests_left_ == 0) {
        cut_only_ears = false;
        break;
      }
    }
    std::vector<std::uint32_t> remaining_corners;
    for (std::uint32_t i = 0; i < flat_.size(); ++i) {
      if (corner_version_[i] != kNoCorner) remaining_corners.push_back(i);
    }
    split_as_convex(remaining_corners, triangles);
    return cut_only_ears;
  }

 private:
  struct EarCut {
    double length;  // Squared length of the cut
    std::uint32_t tip, version;
    // Compares by descending length, because a priority queue keeps the largest element on top
    bool operator<(const EarCut& other) const {
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
      cut_queue_.push({0, tip, corner_version_[tip]});
    } else if (turn(tip) > 0) {
      cut_queue_.push({length(tip), tip, corner_version_[tip]});
    }
  }

  /// True if the corner `tip` can be cut off. Otherwise records the corner that blocks it: when that corner is removed,
  /// `tip` is tested again.
  bool is_ear(std::uint32_t tip) {
    if (has_no_sides(tip)) return true;
    const std::uint32_t previous = before_[tip], next = next_[tip];
    const Point &a = flat_[previous], &b = flat_[tip], &c = flat_[next];
    std::uint32_t blocking_corner = kNoCorner;
    const auto blocks_ear = [&](std::uint32_t i) {
      const Point& p = flat_[i];
      if (corner_version_[i] == kNoCorner || p == a || p == b || p == c) return false;
      if (twice_area(a, b, p) < 0 || twice_area(b, c, p) < 0 || twice_area(c, a, p) < 0) {
        return false;
      }
      blocking_corner = i;
      return true;
    };
    if (grid_.empty()) {
      for (std::uint32_t i = next_[next]; i != previous && tests_left_ != 0;
           i = next_[i], --tests_left_) {
        if (blocks_ear(i)) break;
      }
    } else {
      grid_.visit_corners({a, b, c}, tests_left_, blocks_ear);
    }
    if (blocking_corner == kNoCorner) return tests_left_ != 0;
    blocked_corners_.push_back({tip, corner_version_[tip], last_blocked_[blocking_corner]});
    last_blocked_[blocking_corner] = static_cast<std::uint32_t>(blocked_corners_.size() - 1);
    return false;
  }

  void cut_off(std::uint32_t tip, CornerTriangles& triangles) {
    const std::uint32_t previous = before_[tip], next = next_[tip];
    triangles.push_back({previous, tip, next});
    next_[previous] = next;
    before_[next] = previous;
    corner_version_[tip] = kNoCorner;
    --remaining_count_;
    for (const std::uint32_t beside : {previous, next}) {
      ++corner_version_[beside];
      queue_if_ear(beside);
    }
    for (std::uint32_t w = last_blocked_[tip]; w != kNoCorner; w = blocked_corners_[w].next) {
      if (blocked_corners_[w].version == corner_version_[blocked_corners_[w].tip])
        queue_if_ear(blocked_corners_[w].tip);
    }
  }

  /// Cuts off a corner that is not an ear.
  /// \returns true if the corner lies on a straight line, and only rounding keeps it from being an ear
  bool cut_non_ear(CornerTriangles& triangles) {
    std::uint32_t first_remaining = 0, best = kNoCorner;
    while (corner_version_[first_remaining] == kNoCorner) ++first_remaining;
    std::tuple<bool, double, std::uint32_t> smallest_rank;
    for (std::uint32_t k = 0, tip = first_remaining; k < remaining_count_; ++k, tip = next_[tip]) {
      const std::tuple rank(!(turn(tip) > 0), length(tip), tip);
      if (best == kNoCorner || rank < smallest_rank)
        std::tie(best, smallest_rank) = std::pair(tip, rank);
    }
    tests_left_ -= std::min<std::uint64_t>(tests_left_, first_remaining + remaining_count_);
    const bool is_straight = std::abs(turn(best)) < kSignRounding;
    cut_off(best, triangles);
    return is_straight;
  }

  PolygonCorners corners_;
  const FlatPolygon& flat_;
  CornerGrid grid_;
  std::uint32_t remaining_count_;
  std::uint64_t tests_left_ = kMaxTests;
  std::vector<std::uint32_t> next_, before_;
  /// How often the neighbours of each corner have changed; kNoCorner if the corner is cut off
  std::vector<std::uint32_t> corner_version_;
  std::priority_queue<EarCut> cut_queue_;
  std::vector<BlockedCorner> blocked_corners_;
  /// For each corner, the last element of `blocked_corners_` that lists a corner it blocks
  std::vector<std::uint32_t> last_blocked_;
};

/// Sine of a triangle's smallest angle; 0 or less if the triangle has no area or turns right.
double smallest_angle(const FlatPolygon& flat, const std::array<std::uint32_t, 3>& t) {
  std::array<double, 3> side_lengths{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &a = flat[t[k]], &b = flat[t[(k + 1) % 3]];
    side_lengths[k] = std::hypot(b[0] - a[0], b[1] - a[1]);
  }
  std::sort(side_lengths.begin(), side_lengths.end());
  const double side_product = side_lengths[1] * side_lengths[2];
  return side_product > 0 ? twice_area(flat[t[0]], flat[t[1]], flat[t[2]]) / side_product : 0;
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
  double polygon_size = 0;
  for (const auto& corner : corners) {
    const double distance = std::sqrt(squared_distance(corner, corners[0]));
    if (!std::isfinite(distance)) return {};
    polygon_size = std::max(polygon_size, distance);
  }
  if (!(polygon_size > 0)) return {};
  const auto at = [&](std::size_t i, std::size_t k) {
    return (corners[i][k] - corners[0][k]) / polygon_size;
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

void raise_smallest_angles(const FlatPolygon& flat, CornerTriangles& triangles) {
  // Sides sorted by their two corners, to find the neighbour across each side.
  std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> triangle_sides;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      triangle_sides.emplace_back(low, high, 3 * t + k);
    }
  }
  std::sort(triangle_sides.begin(), triangle_sides.end());
  // For each side of a triangle, the side of the adjacent triangle at the same edge
  std::vector<std::uint32_t> side_across(3 * triangles.size(), kNoCorner);
  for (std::size_t i = 1; i < triangle_sides.size(); ++i) {
    const auto& [a, b, first_new] = triangle_sides[i - 1];
    const auto& [c, d, other] = triangle_sides[i];
    if (a != c || b != d) continue;
    side_across[first_new] = other;
    side_across[other] = first_new;
  }
  const auto join = [&](std::uint32_t side, std::uint32_t other) {
    side_across[side] = other;
    if (other != kNoCorner) side_across[other] = side;
  };
  std::vector<double> angles;
  for (const auto& t : triangles) angles.push_back(smallest_angle(flat, t));
  std::queue<std::uint32_t> open;
  for (std::uint32_t s = 0; s < side_across.size(); ++s) open.push(s);
  // Each flip increases the sorted list of angles, so flipping ends, usually after a few flips per corner.
  std::uint64_t flips = 64 * std::uint64_t{triangles.size()};
  for (; !open.empty() && flips != 0; open.pop()) {
    const std::uint32_t side = open.front(), other = side_across[side];
    if (other == kNoCorner) continue;
    const std::uint32_t t = side / 3, u = other / 3;
    const auto after = [](std::uint32_t s, std::uint32_t by) {
      return s / 3 * 3 + (s % 3 + by) % 3;
    };
    const std::uint32_t a = triangles[t][side % 3], b = triangles[t][(side + 1) % 3];
    const std::uint32_t c = triangles[t][after(side, 2) % 3], d = triangles[u][after(other, 2) % 3];
    const std::array<std::uint32_t, 3> first_new = {c, a, d}, second_new = {d, b, c};
    const double first_angle = smallest_angle(flat, first_new),
                 second_angle = smallest_angle(flat, second_new);
    if (!(std::min(first_angle, second_angle) > std::min(angles[t], angles[u]) + kSignRounding))
      continue;
    --flips;
    const std::uint32_t ca = side_across[after(side, 2)], bc = side_across[after(side, 1)];
    const std::uint32_t ad = side_across[after(other, 1)], db = side_across[after(other, 2)];
    triangles[t] = first_new;
    triangles[u] = second_new;
    angles[t] = first_angle;
    angles[u] = second_angle;
    join(3 * t, ca);
    join(3 * t + 1, ad);
    join(3 * t + 2, 3 * u + 2);
    join(3 * u, db);
    join(3 * u + 1, bc);
    for (const std::uint32_t s : {3 * t, 3 * t + 1, 3 * u, 3 * u + 1}) open.push(s);
  }
}

}  // namespace kiln
