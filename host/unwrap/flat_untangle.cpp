// Untangling: makes a chart injective if its border overlaps only slightly.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "unwrap/flat_chart.h"
#include "unwrap/flat_predicates.h"
#include "unwrap/flat_system.h"

namespace kiln {
namespace {

/// Distance by which touching border vertices are pushed in the first round, as a share of the length of the sides
/// beside them; and the factor by which this distance grows in each round.
constexpr double kInitialPushDistance = 0.1, kPushGrowth = 1.3;
/// Weight that holds a pushed vertex at its target, relative to the weights of its triangles.
constexpr double kHoldWeight = 1;
/// Factor by which a flipped triangle's weight grows in each round.
constexpr double kFlipWeightGrowth = 2;
/// Untangling stops without success if the number of flipped triangles exceeds its initial value by this factor.
constexpr std::size_t kMaxFlipGrowth = 4;

/// Rotation nearest to the map of triangle i, as cosine and sine.
Vec2d rotation(const FlatChart& chart, std::size_t i) {
  Vec2d u{}, v{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d& p = chart.points[chart.triangles[i][k]];
    u = u + chart.rest[i].gradient[k] * p.x;
    v = v + chart.rest[i].gradient[k] * p.y;
  }
  const double c = u.x + v.y, s = v.x - u.y, size = std::sqrt(c * c + s * s);
  return size > 0 ? Vec2d{c / size, s / size} : Vec2d{1, 0};
}

class Untangler {
 public:
  Untangler(FlatChart& chart, RigidSystem& system, const FlatStart* start)
      : chart_(chart),
        system_(system),
        start_(start),
        triangle_weights_(chart.triangles.size(), 1),
        push_length_(chart.points.size(), 0),
        push_targets_(chart.points.size()) {}

  bool run(const UntangleEffort& effort) {
    max_touching_pairs_ = effort.touching_sides;
    reach_ = effort.reach;
    std::size_t initial_flipped_triangles = 0;
    for (int round = 0;; ++round) {
      const std::size_t flipped_triangles = weight_flipped_triangles();
      if (round == 0) initial_flipped_triangles = flipped_triangles;
      if (flipped_triangles >
          std::min(effort.flipped_triangles, 2 * initial_flipped_triangles + kMaxFlipGrowth))
        return false;
      const std::vector<TouchingSides> found = find_touching_sides();
      if (flipped_triangles == 0 && found.empty()) return is_injective(chart_);
      if (round == effort.rounds || found.size() > max_touching_pairs_) return false;
      push(found);
      if (!solve()) return false;
    }
  }

 private:
  using TouchingSides = std::pair<std::size_t, std::size_t>;

  std::size_t weight_flipped_triangles() {
    std::size_t flipped_triangles = 0;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const Triangle& t = chart_.triangles[i];
      if (orient2d_certain(chart_.points[t[0]], chart_.points[t[1]], chart_.points[t[2]])) continue;
      triangle_weights_[i] *= kFlipWeightGrowth;
      ++flipped_triangles;
    }
    return flipped_triangles;
  }

  std::vector<TouchingSides> find_touching_sides() const {
    std::vector<Vec2d> border;
    for (const std::uint32_t v : chart_.boundary) border.push_back(chart_.points[v]);
    return touching_sides(border, 2 * chart_.min_border_distance, max_touching_pairs_ + 1);
  }

  /// Pushes the end points of touching border edges into the chart.
  void push(const std::vector<TouchingSides>& found) {
    const std::size_t count = chart_.boundary.size();
    std::vector<std::size_t> touching_border_indices;
    for (const auto& [a, b] : found) {
      touching_border_indices.insert(touching_border_indices.end(),
                                     {a, (a + 1) % count, b, (b + 1) % count});
    }
    std::sort(touching_border_indices.begin(), touching_border_indices.end());
    touching_border_indices.erase(
        std::unique(touching_border_indices.begin(), touching_border_indices.end()),
        touching_border_indices.end());
    if (reach_ > 0) {
      push_nearby_vertices(touching_border_indices);
      return;
    }
    for (const std::size_t i : touching_border_indices) {
      const std::uint32_t v = chart_.boundary[i];
      const Vec2d along = chart_.points[chart_.boundary[(i + 1) % count]] -
                          chart_.points[chart_.boundary[(i + count - 1) % count]];
      if (push_length_[v] == 0) pushed_vertices_.push_back(v);
      push_length_[v] = push_length_[v] == 0 ? kInitialPushDistance : push_length_[v] * kPushGrowth;
      push_targets_[v] = chart_.points[v] + Vec2d{-along.y, along.x} * (0.5 * push_length_[v]);
    }
  }

  /// Pushes each touching vertex together with the `reach_` border vertices on either side of it. The push decreases
  /// with the number of sides from the touching vertex. Its direction is perpendicular to the line between the border
  /// vertices `reach_` sides before and after the pushed vertex.
  void push_nearby_vertices(const std::vector<std::size_t>& touching_border_indices) {
    const std::size_t count = chart_.boundary.size(), chord_steps = reach_ % count;
    std::vector<double> push_shares(count, 0);
    for (const std::size_t i : touching_border_indices) {
      for (std::size_t n = 0; n <= 2 * reach_; ++n) {
        const std::size_t steps_from_touch = n < reach_ ? reach_ - n : n - reach_;
        double& at = push_shares[(i + n + count * reach_ - reach_) % count];
        at = std::max(at,
                      1 - static_cast<double>(steps_from_touch) / static_cast<double>(reach_ + 1));
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (push_shares[i] == 0) continue;
      const std::uint32_t v = chart_.boundary[i];
      const auto border_chord = [&](std::size_t steps) {
        return chart_.points[chart_.boundary[(i + steps) % count]] -
               chart_.points[chart_.boundary[(i + count - steps) % count]];
      };
      const Vec2d along = border_chord(chord_steps), side = border_chord(1);
      const double size = std::sqrt(dot(along, along));
      if (push_length_[v] == 0) pushed_vertices_.push_back(v);
      if (push_shares[i] == 1)
        push_length_[v] =
            push_length_[v] == 0 ? kInitialPushDistance : push_length_[v] * kPushGrowth;
      push_length_[v] = std::max(push_length_[v], kInitialPushDistance * push_shares[i]);
      const double by = 0.5 * std::max(push_length_[v], kInitialPushDistance) * push_shares[i] *
                        std::sqrt(dot(side, side));
      push_targets_[v] = chart_.points[v];
      if (size > 0) push_targets_[v] = push_targets_[v] + Vec2d{-along.y, along.x} * (by / size);
    }
  }

  /// Runs one as-rigid-as-possible round, in which pushed vertices are held near their targets.
  bool solve() {
    std::vector<Vec2d> points(chart_.points.size());
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const RestShape& rest = chart_.rest[i];
      const Vec2d r = rotation(chart_, i);
      const double area = rest.area * triangle_weights_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d g = rest.gradient[k] * area;
        Vec2d& force = points[chart_.triangles[i][k]];
        force = force + Vec2d{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      }
    }
    system_.fill(chart_, triangle_weights_);
    const auto hold_at = [&](std::uint32_t v, const Vec2d& at, double by) {
      double& diagonal = system_.vertex_block(v)[0];
      const double weight = by * diagonal;
      diagonal += weight;
      points[v] = points[v] + at * weight;
    };
    for (std::uint32_t v = 0; start_ != nullptr && v < push_length_.size(); ++v) {
      if (push_length_[v] == 0) hold_at(v, start_->vertex_positions[v], start_->hold_weights[v]);
    }
    for (const std::uint32_t v : pushed_vertices_) hold_at(v, push_targets_[v], kHoldWeight);
    // Weight that anchors the chart, so that the system is definite although the whole chart can move freely.
    constexpr double kAnchorWeight = 1e-6;
    hold_at(0, chart_.points[0], kAnchorWeight);
    if (!system_.factorize() || !system_.solve(points)) return false;
    chart_.points = std::move(points);
    return true;
  }

  FlatChart& chart_;
  RigidSystem& system_;
  const FlatStart* start_;
  std::size_t max_touching_pairs_ = 0, reach_ = 0;
  std::vector<double> triangle_weights_;  ///< Weight of each triangle
  /// Length of each vertex's push, as a share of the length of the sides beside it; 0 if it is not pushed.
  std::vector<double> push_length_;
  std::vector<Vec2d> push_targets_;  ///< Positions at which pushed vertices are held
  std::vector<std::uint32_t>
      pushed_vertices_;  ///< Pushed vertices, in the order of their first push
};

}  // namespace

bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start) {
  return Untangler(chart, system, start).run(effort);
}

}  // namespace kiln
