// Untangling: makes a chart injective whose border overlaps slightly.
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

/// Distance by which touching border vertices are pushed, as a share of the adjacent sides; and the factor by which
/// the push grows in each round.
constexpr double kFirstPush = 0.1, kPushGrowth = 1.3;
/// Weight that holds a pushed vertex at its target, relative to the weights of its triangles.
constexpr double kHoldWeight = 1;
/// Factor by which a flipped triangle's weight grows in each round.
constexpr double kFlipWeightGrowth = 2;
/// Untangling is aborted if the number of flipped triangles exceeds its first value by this factor.
constexpr std::size_t kMaxFlipGrowth = 4;

/// Cosine and sine of the rotation nearest to a triangle's map.
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
        weight_(chart.triangles.size(), 1),
        push_(chart.points.size(), 0),
        target_(chart.points.size()) {}

  bool run(const UntangleEffort& effort) {
    most_touches_ = effort.touches;
    reach_ = effort.reach;
    std::size_t first_flips = 0;
    for (int round = 0;; ++round) {
      const std::size_t flips = weigh_flips();
      if (round == 0) first_flips = flips;
      if (flips > std::min(effort.flips, 2 * first_flips + kMaxFlipGrowth)) return false;
      const std::vector<Touch> found = touching();
      if (flips == 0 && found.empty()) return is_injective(chart_);
      if (round == effort.rounds || found.size() > most_touches_) return false;
      push(found);
      if (!solve()) return false;
    }
  }

 private:
  using Touch = std::pair<std::size_t, std::size_t>;

  std::size_t weigh_flips() {
    std::size_t flips = 0;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const Triangle& t = chart_.triangles[i];
      if (orient2d_certain(chart_.points[t[0]], chart_.points[t[1]], chart_.points[t[2]])) continue;
      weight_[i] *= kFlipWeightGrowth;
      ++flips;
    }
    return flips;
  }

  std::vector<Touch> touching() const {
    std::vector<Vec2d> border;
    for (const std::uint32_t v : chart_.boundary) border.push_back(chart_.points[v]);
    return touches(border, 2 * chart_.apart, most_touches_ + 1);
  }

  /// Pushes the corners of touching sides into their chart.
  void push(const std::vector<Touch>& found) {
    const std::size_t count = chart_.boundary.size();
    std::vector<std::size_t> places;
    for (const auto& [a, b] : found) {
      places.insert(places.end(), {a, (a + 1) % count, b, (b + 1) % count});
    }
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    if (reach_ > 0) {
      push_wide(places);
      return;
    }
    for (const std::size_t i : places) {
      const std::uint32_t v = chart_.boundary[i];
      const Vec2d along = chart_.points[chart_.boundary[(i + 1) % count]] -
                          chart_.points[chart_.boundary[(i + count - 1) % count]];
      if (push_[v] == 0) pushed_.push_back(v);
      push_[v] = push_[v] == 0 ? kFirstPush : push_[v] * kPushGrowth;
      target_[v] = chart_.points[v] + Vec2d{-along.y, along.x} * (0.5 * push_[v]);
    }
  }

  /// Pushes touching vertices and border vertices near them. The push decreases with the distance from the touching
  /// vertex; its direction is perpendicular to the border between the two outermost of these vertices.
  void push_wide(const std::vector<std::size_t>& places) {
    const std::size_t count = chart_.boundary.size(), far = reach_ % count;
    std::vector<double> share(count, 0);
    for (const std::size_t i : places) {
      for (std::size_t n = 0; n <= 2 * reach_; ++n) {
        const std::size_t distance = n < reach_ ? reach_ - n : n - reach_;
        double& at = share[(i + n + count * reach_ - reach_) % count];
        at = std::max(at, 1 - static_cast<double>(distance) / static_cast<double>(reach_ + 1));
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (share[i] == 0) continue;
      const std::uint32_t v = chart_.boundary[i];
      const auto across = [&](std::size_t steps) {
        return chart_.points[chart_.boundary[(i + steps) % count]] -
               chart_.points[chart_.boundary[(i + count - steps) % count]];
      };
      const Vec2d along = across(far), side = across(1);
      const double size = std::sqrt(dot(along, along));
      if (push_[v] == 0) pushed_.push_back(v);
      if (share[i] == 1) push_[v] = push_[v] == 0 ? kFirstPush : push_[v] * kPushGrowth;
      push_[v] = std::max(push_[v], kFirstPush * share[i]);
      const double by =
          0.5 * std::max(push_[v], kFirstPush) * share[i] * std::sqrt(dot(side, side));
      target_[v] = chart_.points[v];
      if (size > 0) target_[v] = target_[v] + Vec2d{-along.y, along.x} * (by / size);
    }
  }

  /// One as-rigid-as-possible round; pushed vertices are held near their targets.
  bool solve() {
    std::vector<Vec2d> points(chart_.points.size());
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const RestShape& rest = chart_.rest[i];
      const Vec2d r = rotation(chart_, i);
      const double area = rest.area * weight_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d g = rest.gradient[k] * area;
        Vec2d& pull = points[chart_.triangles[i][k]];
        pull = pull + Vec2d{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      }
    }
    system_.fill(chart_, weight_);
    const auto hold_at = [&](std::uint32_t v, const Vec2d& at, double by) {
      double& own = system_.diagonal(v)[0];
      const double weight = by * own;
      own += weight;
      points[v] = points[v] + at * weight;
    };
    for (std::uint32_t v = 0; start_ != nullptr && v < push_.size(); ++v) {
      if (push_[v] == 0) hold_at(v, start_->places[v], start_->holds[v]);
    }
    for (const std::uint32_t v : pushed_) hold_at(v, target_[v], kHoldWeight);
    // Weight that makes the system definite although the whole chart can move freely.
    constexpr double kAnchorWeight = 1e-6;
    hold_at(0, chart_.points[0], kAnchorWeight);
    if (!system_.factorize() || !system_.solve(points)) return false;
    chart_.points = std::move(points);
    return true;
  }

  FlatChart& chart_;
  RigidSystem& system_;
  const FlatStart* start_;
  std::size_t most_touches_ = 0, reach_ = 0;
  std::vector<double> weight_;  ///< Weight of each triangle
  /// Push of each vertex, as a share of the adjacent sides; 0 if it is not pushed.
  std::vector<double> push_;
  std::vector<Vec2d> target_;          ///< Positions at which pushed vertices are held
  std::vector<std::uint32_t> pushed_;  ///< Pushed vertices, in the order of their first push
};

}  // namespace

bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start) {
  return Untangler(chart, system, start).run(effort);
}

}  // namespace kiln
