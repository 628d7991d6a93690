// Triangulates polygons as other programs do.
#include <algorithm>
#include <cmath>

#include "kiln/polygon.h"
#include "mesh/ears.h"
#include "mesh/polygon.h"

namespace kiln {
namespace {

using Corners = PolygonCorners;
using Triples = CornerTriangles;

std::array<double, 3> cross_product_at(const std::array<double, 3>& at,
                                       const std::array<double, 3>& to,
                                       const std::array<double, 3>& other) {
  std::array<double, 3> u{}, v{};
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = to[k] - at[k];
    v[k] = other[k] - at[k];
  }
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// True if a quad folds over when it is cut between corners `i` and i + 2.
bool folds_over(Corners corners, std::size_t i) {
  const auto& at = corners[i];
  const auto& across = corners[(i + 2) % 4];
  const auto one = cross_product_at(at, corners[(i + 1) % 4], across);
  const auto other = cross_product_at(at, corners[(i + 3) % 4], across);
  return one[0] * other[0] + one[1] * other[1] + one[2] * other[2] > 0;
}

void fan(std::size_t corners, Triples& triangles) {
  for (std::uint32_t i = 1; i + 1 < corners; ++i) triangles.push_back({0, i, i + 1});
}

/// Cuts a quad between corners 0 and 2, or between 1 and 3.
void cut_quad(bool along_1_3, Triples& triangles) {
  if (along_1_3) {
    triangles.assign({{0, 1, 3}, {1, 2, 3}});
  } else {
    triangles.assign({{0, 1, 2}, {0, 2, 3}});
  }
}

/// Blender's polyfill. It cuts ears in turn, skips one corner after each cut, and reverses the direction if the next
/// corner is not convex.
class Polyfill {
 public:
  explicit Polyfill(const FlatPolygon& flat) : count_(static_cast<std::uint32_t>(flat.size())) {
    for (const auto& p : flat) {
      points_.push_back({static_cast<float>(p[0]), static_cast<float>(p[1])});
    }
    for (std::uint32_t i = 0; i < count_; ++i) {
      next_.push_back((i + 1) % count_);
      before_.push_back((i + count_ - 1) % count_);
    }
    turn_signs_.resize(count_);
    for (std::uint32_t i = 0; i < count_; ++i) {
      turn_signs_[i] = turn(before_[i], i, next_[i]);
      if (turn_signs_[i] != 1) ++not_convex_;
    }
  }

  /// \returns false if a corner that is not an ear had to be cut
  bool run(Triples& triangles) {
    bool cut_only_ears = true, reverses = false;
    std::uint32_t from = 0;
    while (count_ > 3) {
      const std::uint32_t ear = find(from, reverses, cut_only_ears);
      const std::uint32_t previous = before_[ear], next = next_[ear];
      if (turn_signs_[ear] != 1) --not_convex_;
      triangles.push_back({previous, ear, next});
      next_[previous] = next;
      before_[next] = previous;
      if (first_ == ear) first_ = next;
      --count_;
      for (const std::uint32_t beside : {previous, next}) {
        if (turn_signs_[beside] == 1) continue;
        turn_signs_[beside] = turn(before_[beside], beside, next_[beside]);
        if (turn_signs_[beside] == 1) --not_convex_;
      }
      from = reverses ? before_[previous] : next_[next];
      if (turn_signs_[from] != 1) {
        from = reverses ? before_[from] : next_[from];
        reverses = !reverses;
      }
    }
    triangles.push_back({first_, next_[first_], next_[next_[first_]]});
    return cut_only_ears;
  }

 private:
  /// Direction in which the polygon turns at corner b: 1 if left (convex), -1 if right, 0 if straight.
  int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const auto &p = points_[a], &q = points_[b], &r = points_[c];
    const float doubled_area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
    return doubled_area > 0 ? 1 : doubled_area < 0 ? -1 : 0;
  }

  bool is_ear(std::uint32_t tip, int wanted) const {
    if (not_convex_ == 0) return true;
    if (turn_signs_[tip] != wanted) return false;
    const std::uint32_t a = before_[tip], c = next_[tip];
    for (std::uint32_t p = next_[c]; p != a; p = next_[p]) {
      if (turn_signs_[p] == 1) continue;
      if (turn(a, tip, p) >= 0 && turn(tip, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  }

  std::uint32_t find(std::uint32_t from, bool back, bool& cut_only_ears) const {
    for (const int wanted : {1, 0}) {
      std::uint32_t at = from;
      for (std::uint32_t i = 0; i < count_; ++i, at = back ? before_[at] : next_[at]) {
        if (is_ear(at, wanted)) return at;
      }
    }
    cut_only_ears = false;
    std::uint32_t at = from;
    for (std::uint32_t i = 0; i < count_; ++i, at = next_[at]) {
      if (turn_signs_[at] != -1) return at;
    }
    return at;
  }

  std::uint32_t count_, first_ = 0, not_convex_ = 0;
  std::vector<std::array<float, 2>> points_;
  std::vector<std::uint32_t> next_, before_;
  std::vector<int> turn_signs_;
};

// For more corners than this, Blender's quadratic search would take too long.
constexpr std::size_t kMaxPolyfillCorners = 4096;

}  // namespace

bool triangulate(std::span<const std::array<double, 3>> corners, Triangulation rule,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (rule == Triangulation::automatic || corners.size() == 3) {
    return triangulate(corners, triangles);
  }
  triangles.clear();
  if (corners.size() == 4 && rule != Triangulation::fan) {
    bool cuts_other_diagonal = folds_over(corners, 0);
    if (rule == Triangulation::shortest) {
      cuts_other_diagonal =
          squared_distance(corners[1], corners[3]) < squared_distance(corners[0], corners[2]);
      if (folds_over(corners, cuts_other_diagonal ? 1 : 0))
        cuts_other_diagonal = !cuts_other_diagonal;
    }
    cut_quad(cuts_other_diagonal, triangles);
    return true;
  }
  const bool too_many = rule == Triangulation::blender && corners.size() > kMaxPolyfillCorners;
  const FlatPolygon flat =
      rule == Triangulation::fan || too_many ? FlatPolygon() : seen_along_normal(corners);
  if (flat.empty()) {
    fan(corners.size(), triangles);
    return rule == Triangulation::fan;
  }
  if (rule == Triangulation::blender) return Polyfill(flat).run(triangles);
  return shortest_ears(corners, flat, triangles);
}

std::vector<Triangle> triangulate_polygon(std::span<const std::array<double, 3>> corners,
                                          Triangulation rule) {
  std::vector<Triangle> triangles;
  if (corners.size() >= 3) triangulate(corners, rule, triangles);
  return triangles;
}

}  // namespace kiln
