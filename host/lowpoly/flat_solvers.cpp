// The linear systems of flat charts.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "lowpoly/flat_chart.h"
#include "lowpoly/flat_predicates.h"

namespace kiln {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<Matrix>;
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

/// One step's direction: the minimum of the weighted distance to the nearest rotations.
bool weighted_step(const FlatChart& chart, std::vector<FlatPoint>& target) {
  const auto count = static_cast<Eigen::Index>(chart.points.size());
  // Holds the system up where a chart could turn or move freely, and shortens wild steps.
  constexpr double kProximal = 1e-4;
  Entries entries;
  entries.reserve(chart.triangles.size() * 24 + chart.points.size() * 2);
  Eigen::VectorXd right(2 * count);
  for (Eigen::Index v = 0; v < count; ++v) {
    const FlatPoint& p = chart.points[static_cast<std::size_t>(v)];
    for (const auto& [row, value] : {std::pair{2 * v, p.x}, std::pair{2 * v + 1, p.y}}) {
      entries.emplace_back(static_cast<int>(row), static_cast<int>(row), kProximal);
      right[row] = kProximal * value;
    }
  }
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Jacobian j = jacobian(chart, i, chart.points);
    const Symmetric m = dirichlet_weight(j);
    const FlatPoint r = nearest_rotation(j);
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const int row = 2 * static_cast<int>(chart.triangles[i][k]);
      const FlatPoint& g = rest.gradient[k];
      const FlatPoint turned{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      right[row] += rest.area * (m.xx * turned.x + m.xy * turned.y);
      right[row + 1] += rest.area * (m.xy * turned.x + m.yy * turned.y);
      for (std::size_t l = 0; l < 3; ++l) {
        const int column = 2 * static_cast<int>(chart.triangles[i][l]);
        if (column > row) continue;  // The lower triangle is all that is read.
        const double w = rest.area * dot(g, rest.gradient[l]);
        entries.emplace_back(row, column, w * m.xx);
        entries.emplace_back(row + 1, column, w * m.xy);
        if (column != row) entries.emplace_back(row, column + 1, w * m.xy);
        entries.emplace_back(row + 1, column + 1, w * m.yy);
      }
    }
  }
  Matrix matrix(2 * count, 2 * count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = solver.solve(right);
  if (!solution.allFinite()) return false;
  target.resize(chart.points.size());
  for (Eigen::Index v = 0; v < count; ++v) {
    target[static_cast<std::size_t>(v)] = {solution[2 * v], solution[2 * v + 1]};
  }
  return true;
}

/// The two border vertices that are farthest apart, or nearly so.
std::pair<std::uint32_t, std::uint32_t> far_pair(const FlatChart& chart) {
  const auto farthest = [&](std::uint32_t from) {
    std::uint32_t best = from;
    double most = -1;
    for (const std::uint32_t v : chart.boundary) {
      const FlatPoint d = chart.points[v] - chart.points[from];
      if (dot(d, d) > most) most = dot(d, d), best = v;
    }
    return best;
  };
  const std::uint32_t a = farthest(chart.boundary[0]);
  return {a, farthest(a)};
}

}  // namespace

bool conformal(FlatChart& chart) {
  const auto [first, second] = far_pair(chart);
  if (first == second) return false;
  // Unknowns: all coordinates but those of the two vertices held.
  std::vector<int> unknown(chart.points.size());
  int count = 0;
  for (std::uint32_t v = 0; v < unknown.size(); ++v) {
    unknown[v] = v == first || v == second ? -1 : count++;
  }
  if (count == 0) return false;
  Entries entries;
  entries.reserve(chart.triangles.size() * 24);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(Eigen::Index{2} * count);
  // The area spanned by a chart depends on neighbours along the border alone; here it is summed over
  // triangles, where inner edges cancel.
  const auto add = [&](int row, int axis, std::uint32_t column, int other, double value) {
    if (value == 0) return;
    if (unknown[column] < 0) {
      right[2 * row + axis] -=
          value * (other == 0 ? chart.points[column].x : chart.points[column].y);
    } else if (2 * unknown[column] + other <= 2 * row + axis) {
      entries.emplace_back(2 * row + axis, 2 * unknown[column] + other, value);
    }
  };
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Triangle& t = chart.triangles[i];
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (unknown[t[k]] < 0) continue;
      for (std::size_t l = 0; l < 3; ++l) {
        const double stiff = rest.area * dot(rest.gradient[k], rest.gradient[l]);
        const double turn = k == l ? 0.0 : (l == (k + 1) % 3 ? 0.5 : -0.5);
        add(unknown[t[k]], 0, t[l], 0, stiff);
        add(unknown[t[k]], 1, t[l], 1, stiff);
        add(unknown[t[k]], 0, t[l], 1, -turn);
        add(unknown[t[k]], 1, t[l], 0, turn);
      }
    }
  }
  Matrix matrix(right.size(), right.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = solver.solve(right);
  if (!solution.allFinite()) return false;
  for (std::uint32_t v = 0; v < unknown.size(); ++v) {
    const Eigen::Index at = Eigen::Index{2} * unknown[v];
    if (at >= 0) chart.points[v] = {solution[at], solution[at + 1]};
  }
  normalise(chart);
  return true;
}

bool rigid_rounds(FlatChart& chart, int rounds) {
  const int count = static_cast<int>(chart.points.size()) - 1;  // Vertex 0 stays where it is.
  Entries entries;
  entries.reserve(chart.triangles.size() * 6);
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const int row = static_cast<int>(chart.triangles[i][k]) - 1;
      for (std::size_t l = 0; l < 3; ++l) {
        const int column = static_cast<int>(chart.triangles[i][l]) - 1;
        if (column < 0 || column > row) continue;
        entries.emplace_back(row, column, rest.area * dot(rest.gradient[k], rest.gradient[l]));
      }
    }
  }
  Matrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return false;
  const FlatPoint anchor = chart.points[0];
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count, 2);
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const FlatPoint r = nearest_rotation(jacobian(chart, i, chart.points));
      for (std::size_t k = 0; k < 3; ++k) {
        const int row = static_cast<int>(chart.triangles[i][k]) - 1;
        if (row < 0) continue;
        const FlatPoint g = chart.rest[i].gradient[k] * chart.rest[i].area;
        right(row, 0) += r.x * g.x - r.y * g.y;
        right(row, 1) += r.y * g.x + r.x * g.y;
      }
    }
    const Eigen::MatrixX2d solution = solver.solve(right);
    if (!solution.allFinite()) return false;
    for (int v = 0; v < count; ++v) {
      chart.points[static_cast<std::size_t>(v) + 1] = {anchor.x + solution(v, 0),
                                                       anchor.y + solution(v, 1)};
    }
  }
  return true;
}

void injective_rounds(FlatChart& chart, int rounds) {
  double current = energy(chart, chart.points);
  for (int round = 0; round < rounds; ++round) {
    std::vector<FlatPoint> direction;
    if (!weighted_step(chart, direction)) return;
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
      moved = current < last && is_injective(chart);
    }
    if (!moved) {
      chart.points = before;
      return;
    }
    if (last - current < 1e-5 * last) return;
  }
}

}  // namespace kiln
