// Rounds that make a chart injective whose border overlaps a little.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "lowpoly/flat_chart.h"
#include "lowpoly/flat_predicates.h"
#include "lowpoly/flat_system.h"

namespace kiln {
namespace {

/// Vertices of the border are pushed by this share of the sides beside them: at first, and each time by more.
constexpr double kFirstPush = 0.1, kMorePush = 1.3;
/// How strongly a vertex is held where it was pushed, over what its triangles weigh.
constexpr double kHold = 1;
/// A flipped triangle weighs more by this, each time.
constexpr double kFlipped = 2;
/// Beyond hope: more places of the border touch, or more triangles are flipped; or these become many more.
constexpr std::size_t kMostTouches = 16, kMostFlips = 8, kMoreFlips = 4;

/// Cosine and sine of the rotation nearest to a triangle's map.
FlatPoint rotation(const FlatChart& chart, std::size_t i) {
  FlatPoint u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    const FlatPoint& p = chart.points[chart.triangles[i][k]];
    u = u + chart.rest[i].gradient[k] * p.x;
    v = v + chart.rest[i].gradient[k] * p.y;
  }
  const double c = u.x + v.y, s = v.x - u.y, size = std::sqrt(c * c + s * s);
  return size > 0 ? FlatPoint{c / size, s / size} : FlatPoint{1, 0};
}

class Untangler {
 public:
  Untangler(FlatChart& chart, RigidSystem& system)
      : chart_(chart),
        system_(system),
        weight_(chart.triangles.size(), 1),
        push_(chart.points.size(), 0),
        target_(chart.points.size()) {}

  bool run(int rounds) {
    std::size_t first_flips = 0;
    for (int round = 0;; ++round) {
      const std::size_t flips = weigh_flips();
      if (round == 0) first_flips = flips;
      if (flips > std::min(kMostFlips, 2 * first_flips + kMoreFlips)) return false;
      const std::vector<Touch> found = touching();
      if (flips == 0 && found.empty()) return is_injective(chart_);
      if (round == rounds || found.size() > kMostTouches) return false;
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
      if (surely_left(chart_.points[t[0]], chart_.points[t[1]], chart_.points[t[2]])) continue;
      weight_[i] *= kFlipped;
      ++flips;
    }
    return flips;
  }

  std::vector<Touch> touching() const {
    std::vector<FlatPoint> border;
    for (const std::uint32_t v : chart_.boundary) border.push_back(chart_.points[v]);
    return touches(border, 2 * chart_.apart, kMostTouches + 1);
  }

  /// Pushes the ends of sides that touch into their chart.
  void push(const std::vector<Touch>& found) {
    const std::size_t count = chart_.boundary.size();
    std::vector<std::size_t> places;
    for (const auto& [a, b] : found) {
      places.insert(places.end(), {a, (a + 1) % count, b, (b + 1) % count});
    }
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    for (const std::size_t i : places) {
      const std::uint32_t v = chart_.boundary[i];
      const FlatPoint along = chart_.points[chart_.boundary[(i + 1) % count]] -
                              chart_.points[chart_.boundary[(i + count - 1) % count]];
      if (push_[v] == 0) pushed_.push_back(v);
      push_[v] = push_[v] == 0 ? kFirstPush : push_[v] * kMorePush;
      target_[v] = chart_.points[v] + FlatPoint{-along.y, along.x} * (0.5 * push_[v]);
    }
  }

  /// A round as rigid as possible; pushed vertices stay near their targets.
  bool solve() {
    std::vector<FlatPoint> points(chart_.points.size());
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const RestShape& rest = chart_.rest[i];
      const FlatPoint r = rotation(chart_, i);
      const double area = rest.area * weight_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const FlatPoint g = rest.gradient[k] * area;
        FlatPoint& pull = points[chart_.triangles[i][k]];
        pull = pull + FlatPoint{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      }
    }
    system_.fill(chart_, weight_);
    const auto hold = [&](std::uint32_t v, const FlatPoint& at, double by) {
      double& own = system_.diagonal(v)[0];
      const double held = by * own;
      own += held;
      points[v] = points[v] + at * held;
    };
    for (const std::uint32_t v : pushed_) hold(v, target_[v], kHold);
    constexpr double kAnchor = 1e-6;  // The whole may move freely.
    hold(0, chart_.points[0], kAnchor);
    if (!system_.factorize() || !system_.solve(points)) return false;
    chart_.points = std::move(points);
    return true;
  }

  FlatChart& chart_;
  RigidSystem& system_;
  std::vector<double> weight_;         ///< Of each triangle.
  std::vector<double> push_;           ///< Of each vertex, by what share; 0: not yet.
  std::vector<FlatPoint> target_;      ///< Where those pushed are held.
  std::vector<std::uint32_t> pushed_;  ///< Vertices, in the order of their first push.
};

}  // namespace

bool untangle(FlatChart& chart, int rounds, RigidSystem& system) {
  return Untangler(chart, system).run(rounds);
}

}  // namespace kiln
