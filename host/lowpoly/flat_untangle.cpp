// Rounds that make a chart injective whose border overlaps a little.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "lowpoly/flat_chart.h"
#include "lowpoly/flat_predicates.h"

namespace kiln {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

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
  const double c = u.x + v.y, s = v.x - u.y, size = std::hypot(c, s);
  return size > 0 ? FlatPoint{c / size, s / size} : FlatPoint{1, 0};
}

class Untangler {
 public:
  explicit Untangler(FlatChart& chart)
      : chart_(chart),
        count_(static_cast<int>(chart.points.size())),
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
    Entries entries;
    entries.reserve(chart_.triangles.size() * 6 + pushed_.size() + 1);
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count_, 2);
    std::vector<double> diagonal(chart_.points.size(), 0);
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const RestShape& rest = chart_.rest[i];
      const FlatPoint r = rotation(chart_, i);
      const double area = rest.area * weight_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto row = static_cast<int>(chart_.triangles[i][k]);
        const FlatPoint g = rest.gradient[k] * area;
        right(row, 0) += r.x * g.x - r.y * g.y;
        right(row, 1) += r.y * g.x + r.x * g.y;
        diagonal[chart_.triangles[i][k]] += dot(g, rest.gradient[k]);
        for (std::size_t l = 0; l < 3; ++l) {
          const auto column = static_cast<int>(chart_.triangles[i][l]);
          if (column <= row) entries.emplace_back(row, column, dot(g, rest.gradient[l]));
        }
      }
    }
    const auto hold = [&](std::uint32_t v, const FlatPoint& at, double by) {
      const auto row = static_cast<int>(v);
      entries.emplace_back(row, row, by * diagonal[v]);
      right(row, 0) += by * diagonal[v] * at.x;
      right(row, 1) += by * diagonal[v] * at.y;
    };
    constexpr double kAnchor = 1e-6;  // The whole may move freely.
    hold(0, chart_.points[0], kAnchor);
    for (const std::uint32_t v : pushed_) hold(v, target_[v], kHold);
    Matrix matrix(count_, count_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    if (!analysed_) solver_.analyzePattern(matrix);
    analysed_ = true;
    solver_.factorize(matrix);
    if (solver_.info() != Eigen::Success) return false;
    const Eigen::MatrixX2d solution = solver_.solve(right);
    if (!solution.allFinite()) return false;
    for (int v = 0; v < count_; ++v) {
      chart_.points[static_cast<std::size_t>(v)] = {solution(v, 0), solution(v, 1)};
    }
    return true;
  }

  using Entries = std::vector<Eigen::Triplet<double>>;

  FlatChart& chart_;
  int count_;
  Eigen::SimplicialLDLT<Matrix> solver_;
  bool analysed_ = false;
  std::vector<double> weight_;         ///< Of each triangle.
  std::vector<double> push_;           ///< Of each vertex, by what share; 0: not yet.
  std::vector<FlatPoint> target_;      ///< Where those pushed are held.
  std::vector<std::uint32_t> pushed_;  ///< Vertices, in the order of their first push.
};

}  // namespace

bool untangle(FlatChart& chart, int rounds) { return Untangler(chart).run(rounds); }

}  // namespace kiln
