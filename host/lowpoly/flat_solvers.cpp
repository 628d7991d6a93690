// The rounds of flat charts: each solves a linear system.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "lowpoly/flat_chart.h"
#include "lowpoly/flat_predicates.h"
#include "lowpoly/flat_system.h"

namespace kiln {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<Matrix, Eigen::Lower, PairedOrder>;
using Entries = std::vector<Eigen::Triplet<double>>;

/// The symmetric 2 x 2 matrix ((xx, xy), (xy, yy)).
struct Symmetric {
  double xx = 1, xy = 0, yy = 1;
};

/// A map's first derivatives on a triangle, by rows.
struct Jacobian {
  FlatPoint u, v;
};

Jacobian jacobian(const FlatChart& chart, std::size_t i, const std::vector<FlatPoint>& points) {
  Jacobian j;
  for (std::size_t k = 0; k < 3; ++k) {
    const FlatPoint& p = points[chart.triangles[i][k]];
    j.u = j.u + chart.rest[i].gradient[k] * p.x;
    j.v = j.v + chart.rest[i].gradient[k] * p.y;
  }
  return j;
}

/// Cosine and sine of the rotation nearest to the map.
FlatPoint nearest_rotation(const Jacobian& j) {
  const double c = j.u.x + j.v.y, s = j.v.x - j.u.y, size = std::hypot(c, s);
  return size > 0 ? FlatPoint{c / size, s / size} : FlatPoint{1, 0};
}

/// What weighs the distance to a rotation so that its gradient is that of the symmetric Dirichlet
/// energy (Rabinovich et al. 2017, equation 15): squared, in the frame of the image.
Symmetric dirichlet_weight(const Jacobian& j) {
  const double det = cross(j.u, j.v);
  const double sum = dot(j.u, j.u) + dot(j.v, j.v);
  const double root = std::sqrt(std::max(0.0, sum * sum - 4 * det * det));
  const double a2 = 0.5 * (sum + root), a = std::sqrt(a2), b = det / a, b2 = b * b;
  const auto g = [](double s) { return (s + 1) * (s * s + 1) / (s * s * s); };
  if (a2 - b2 < 1e-9 * a2) return {g(a), 0, g(a)};
  const double slope = (g(a) - g(b)) / (a2 - b2), base = g(a) - slope * a2;
  return {base + slope * dot(j.u, j.u), slope * dot(j.u, j.v), base + slope * dot(j.v, j.v)};
}

double energy(const FlatChart& chart, const std::vector<FlatPoint>& points) {
  double sum = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Jacobian j = jacobian(chart, i, points);
    const double det = cross(j.u, j.v);
    if (!(det > 0)) return std::numeric_limits<double>::infinity();
    sum += chart.rest[i].area * (dot(j.u, j.u) + dot(j.v, j.v)) * (1 + 1 / (det * det));
  }
  return sum;
}

/// How far along the direction a triangle flattens first (Smith, Schaefer 2015, section 3.3).
double flip_distance(const FlatChart& chart, const std::vector<FlatPoint>& direction) {
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& t : chart.triangles) {
    const FlatPoint e = chart.points[t[1]] - chart.points[t[0]];
    const FlatPoint f = chart.points[t[2]] - chart.points[t[0]];
    const FlatPoint de = direction[t[1]] - direction[t[0]], df = direction[t[2]] - direction[t[0]];
    const double a = cross(de, df), b = cross(e, df) + cross(de, f), c = cross(e, f);
    const double disc = b * b - 4 * a * c;
    if (disc < 0) continue;
    // Of the two roots the stable forms; the least that is positive counts.
    const double q = -0.5 * (b + std::copysign(std::sqrt(disc), b));
    for (const double root : {a != 0 ? q / a : -1.0, q != 0 ? c / q : -1.0}) {
      if (root > 0) best = std::min(best, root);
    }
  }
  return best;
}

/// The linear system of one step: the minimum of the weighted distance to the nearest rotations. Its pattern is
/// looked at once a chart.
class StepSystem {
 public:
  explicit StepSystem(const FlatChart& chart)
      : count_(static_cast<Eigen::Index>(chart.points.size())), matrix_(2 * count_, 2 * count_) {
    Entries entries;
    entries.reserve(chart.triangles.size() * 21 + chart.points.size() * 3);
    const auto add = [&](int row, int column) {
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
          if (row + i >= column + j) entries.emplace_back(row + i, column + j, 0);
        }
      }
    };
    for (int v = 0; v < count_; ++v) add(2 * v, 2 * v);
    for (const Triangle& t : chart.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        add(2 * static_cast<int>(high), 2 * static_cast<int>(low));
      }
    }
    matrix_.setFromTriplets(entries.begin(), entries.end());
    solver_.analyzePattern(matrix_);
    slots_.reserve(chart.triangles.size() * 6);
    for (const Triangle& t : chart.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        slots_.push_back(slot(t[k], t[k]));
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        slots_.push_back(slot(high, low));
      }
    }
  }

  /// \returns false where it has no solution
  bool solve(const FlatChart& chart, std::vector<FlatPoint>& target) {
    // Holds the system up where a chart could turn or move freely, and shortens wild steps.
    constexpr double kProximal = 1e-4;
    double* const values = matrix_.valuePtr();
    std::fill(values, values + matrix_.nonZeros(), 0.0);
    Eigen::VectorXd right(2 * count_);
    for (Eigen::Index v = 0; v < count_; ++v) {
      const FlatPoint& p = chart.points[static_cast<std::size_t>(v)];
      right[2 * v] = kProximal * p.x;
      right[2 * v + 1] = kProximal * p.y;
      for (const Eigen::Index c : {2 * v, 2 * v + 1}) {
        values[matrix_.outerIndexPtr()[c]] += kProximal;  // The diagonal leads its column.
      }
    }
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) add(chart, i, values, right);
    solver_.factorize(matrix_);
    if (solver_.info() != Eigen::Success) return false;
    const Eigen::VectorXd solution = solver_.solve(right);
    if (!solution.allFinite()) return false;
    target.resize(chart.points.size());
    for (Eigen::Index v = 0; v < count_; ++v) {
      target[static_cast<std::size_t>(v)] = {solution[2 * v], solution[2 * v + 1]};
    }
    return true;
  }

 private:
  /// Where the first row of a pair of vertices stands in both of its columns.
  struct Slot {
    Eigen::Index first = 0, second = 0;
  };

  Slot slot(std::uint32_t row, std::uint32_t column) const {
    const auto at = [&](std::uint32_t r, std::uint32_t c) {
      const int* const rows = matrix_.innerIndexPtr();
      const int *const begin = rows + matrix_.outerIndexPtr()[c],
                       *const end = rows + matrix_.outerIndexPtr()[c + 1];
      return std::lower_bound(begin, end, static_cast<int>(r)) - rows;
    };
    return {at(2 * row, 2 * column), at(row == column ? 2 * row + 1 : 2 * row, 2 * column + 1)};
  }

  void add(const FlatChart& chart, std::size_t i, double* values, Eigen::VectorXd& right) const {
    const Jacobian j = jacobian(chart, i, chart.points);
    const Symmetric m = dirichlet_weight(j);
    const FlatPoint r = nearest_rotation(j);
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Index row = 2 * Eigen::Index{chart.triangles[i][k]};
      const FlatPoint& g = rest.gradient[k];
      const FlatPoint turned{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      right[row] += rest.area * (m.xx * turned.x + m.xy * turned.y);
      right[row + 1] += rest.area * (m.xy * turned.x + m.yy * turned.y);
      const Slot own = slots_[6 * i + 2 * k], side = slots_[6 * i + 2 * k + 1];
      const double w = rest.area * dot(g, g);
      values[own.first] += w * m.xx;
      values[own.first + 1] += w * m.xy;
      values[own.second] += w * m.yy;
      const double v = rest.area * dot(g, rest.gradient[(k + 1) % 3]);
      values[side.first] += v * m.xx;
      values[side.first + 1] += v * m.xy;
      values[side.second] += v * m.xy;
      values[side.second + 1] += v * m.yy;
    }
  }

  Eigen::Index count_;
  Matrix matrix_;
  Solver solver_;
  std::vector<Slot> slots_;  ///< Of each triangle: each corner with itself, then with the next one.
};

}  // namespace

std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart) {
  return std::make_shared<RigidSystem>(chart);
}

bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system) {
  const auto count = static_cast<Eigen::Index>(chart.points.size());
  system.fill(chart, {});
  // Vertex 0 stays where it is: what pulls at the others adds up to nothing.
  const double held = system.diagonal(0);
  const FlatPoint anchor = chart.points[0] * held;
  system.diagonal(0) += held;
  if (!system.factorize()) return false;
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count, 2);
    right(0, 0) = anchor.x;
    right(0, 1) = anchor.y;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const FlatPoint r = nearest_rotation(jacobian(chart, i, chart.points));
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Index row = chart.triangles[i][k];
        const FlatPoint g = chart.rest[i].gradient[k] * chart.rest[i].area;
        right(row, 0) += r.x * g.x - r.y * g.y;
        right(row, 1) += r.y * g.x + r.x * g.y;
      }
    }
    const Eigen::MatrixX2d solution = system.solve(right);
    if (!solution.allFinite()) return false;
    for (Eigen::Index v = 0; v < count; ++v) {
      chart.points[static_cast<std::size_t>(v)] = {solution(v, 0), solution(v, 1)};
    }
  }
  return true;
}

double rigid_energy(const FlatChart& chart) {
  double area = 0, sum = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Jacobian j = jacobian(chart, i, chart.points);
    const FlatPoint r = nearest_rotation(j);
    const FlatPoint u = j.u - FlatPoint{r.x, -r.y}, v = j.v - FlatPoint{r.y, r.x};
    area += chart.rest[i].area;
    sum += chart.rest[i].area * (dot(u, u) + dot(v, v));
  }
  return sum / area;
}

void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until) {
  constexpr double kDone = 1e-5, kStalled = 0.01;
  double current = energy(chart, chart.points);
  // The sum that energy() makes of the limit.
  const double area = std::accumulate(chart.rest.begin(), chart.rest.end(), 0.0,
                                      [](double sum, const RestShape& r) { return sum + r.area; });
  const double wanted = until == nullptr ? std::numeric_limits<double>::infinity()
                                         : 4 * area * (1 + until->energy + chart.forced);
  std::optional<StepSystem> system;
  for (int round = 0; round < rounds; ++round) {
    if (until != nullptr && within(chart, *until)) return;
    if (!system) system.emplace(chart);
    std::vector<FlatPoint> direction;
    if (!system->solve(chart, direction)) return;
    for (std::size_t v = 0; v < direction.size(); ++v)
      direction[v] = direction[v] - chart.points[v];
    double step = std::min(1.0, 0.8 * flip_distance(chart, direction));
    const std::vector<FlatPoint> before = chart.points;
    const double last = current;
    bool moved = false;
    for (int attempt = 0; attempt < 12 && !moved; ++attempt, step *= 0.5) {
      for (std::size_t v = 0; v < before.size(); ++v) {
        chart.points[v] = before[v] + direction[v] * step;
      }
      current = energy(chart, chart.points);
      moved = current < last && is_injective(chart, chart.apart);
    }
    if (!moved) {
      chart.points = before;
      return;
    }
    // Above the limit, what hardly falls will not come within.
    if (last - current < (current > wanted ? kStalled : kDone) * last) return;
  }
}

}  // namespace kiln
