// Initial layouts of charts: maps by one linear system.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "unwrap/flat_chart.h"

namespace kiln {
namespace {

/// Eigen's order of least degree. It takes the matrix as symmetric, which solvers hand over, and so need not add
/// the transposed one.
struct SymmetricOrder {
  template <typename StartMatrix, typename Order>
  void operator()(const StartMatrix& matrix, Order& order) const {
    Eigen::AMDOrdering<int>()(matrix.template selfadjointView<Eigen::Lower>(), order);
  }
};

using StartMatrix = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<StartMatrix, Eigen::Lower, SymmetricOrder>;
using Entries = std::vector<Eigen::Triplet<double>>;

/// The two border vertices that are farthest apart, or nearly so.
std::pair<std::uint32_t, std::uint32_t> far_pair(const FlatChart& chart) {
  const auto farthest = [&](std::uint32_t from) {
    std::uint32_t best = from;
    double most = -1;
    for (const std::uint32_t v : chart.boundary) {
      const Vec2d d = chart.points[v] - chart.points[from];
      if (dot(d, d) > most) most = dot(d, d), best = v;
    }
    return best;
  };
  const std::uint32_t a = farthest(chart.boundary[0]);
  return {a, farthest(a)};
}

/// The length of the side opposite to corner k.
double side_length(const RestShape& rest, std::size_t k) {
  return 2 * rest.area * std::sqrt(dot(rest.gradient[k], rest.gradient[k]));
}

/// Places of the border's vertices on a circle of the chart's area, as far apart as the border is long.
std::vector<Vec2d> circle_places(const FlatChart& chart) {
  // Each border vertex starts one side of the border.
  std::vector<double> side(chart.points.size(), 0);
  std::vector<std::uint32_t> next(chart.points.size());
  const std::size_t count = chart.boundary.size();
  for (std::size_t i = 0; i < count; ++i) {
    next[chart.boundary[i]] = chart.boundary[(i + 1) % count] + 1;
  }
  double area = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Triangle& t = chart.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (next[t[k]] == t[(k + 1) % 3] + 1) side[t[k]] = side_length(chart.rest[i], (k + 2) % 3);
    }
    area += chart.rest[i].area;
  }
  double length = 0, at = 0;
  for (const std::uint32_t v : chart.boundary) length += side[v];
  const double radius = std::sqrt(area / std::numbers::pi);
  std::vector<Vec2d> places;
  for (const std::uint32_t v : chart.boundary) {
    const double angle = 2 * std::numbers::pi * at / length;
    places.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    at += side[v];
  }
  return places;
}

/// Cotangent weight of an edge, made positive.
struct EdgeWeight {
  std::uint32_t a = 0, b = 0;
  double weight = 0;
};

std::vector<EdgeWeight> edge_weights(const FlatChart& chart) {
  constexpr double kLeastWeight = 0.05;
  std::vector<EdgeWeight> parts, edges;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      const auto [a, b] = std::minmax(chart.triangles[i][k], chart.triangles[i][l]);
      parts.push_back({a, b, -rest.area * dot(rest.gradient[k], rest.gradient[l])});
    }
  }
  std::stable_sort(parts.begin(), parts.end(), [](const EdgeWeight& p, const EdgeWeight& q) {
    return std::tie(p.a, p.b) < std::tie(q.a, q.b);
  });
  for (const EdgeWeight& part : parts) {
    if (edges.empty() || edges.back().a != part.a || edges.back().b != part.b) {
      edges.push_back({part.a, part.b, 0});
    }
    edges.back().weight += part.weight;
  }
  for (EdgeWeight& edge : edges) edge.weight = std::max(edge.weight, kLeastWeight);
  return edges;
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
  StartMatrix matrix(right.size(), right.size());
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

bool on_circle(FlatChart& chart) {
  std::vector<Vec2d> points(chart.points.size());
  std::vector<int> unknown(chart.points.size(), 0);
  const std::vector<Vec2d> places = circle_places(chart);
  for (std::size_t i = 0; i < places.size(); ++i) {
    points[chart.boundary[i]] = places[i];
    unknown[chart.boundary[i]] = -1;
  }
  int count = 0;
  for (int& u : unknown) {
    if (u == 0) u = count++;
  }
  if (count > 0) {
    Entries entries;
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count, 2);
    for (const EdgeWeight& edge : edge_weights(chart)) {
      for (const auto& [from, to] : {std::pair{edge.a, edge.b}, std::pair{edge.b, edge.a}}) {
        const int row = unknown[from];
        if (row < 0) continue;
        entries.emplace_back(row, row, edge.weight);
        if (unknown[to] < 0) {
          right(row, 0) += edge.weight * points[to].x;
          right(row, 1) += edge.weight * points[to].y;
        } else if (unknown[to] < row) {
          entries.emplace_back(row, unknown[to], -edge.weight);
        }
      }
    }
    StartMatrix matrix(count, count);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Solver solver(matrix);
    if (solver.info() != Eigen::Success) return false;
    const Eigen::MatrixX2d solution = solver.solve(right);
    if (!solution.allFinite()) return false;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (unknown[v] >= 0) points[v] = {solution(unknown[v], 0), solution(unknown[v], 1)};
    }
  }
  chart.points = std::move(points);
  return true;
}

}  // namespace kiln
