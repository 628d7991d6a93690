#include "unwrap/flat_system.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <type_traits>
#include <utility>

namespace kiln {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// The edges of a chart, without duplicates; each has its higher vertex first.
std::vector<Edge> edges_of(const FlatChart& chart) {
  std::vector<Edge> edges;
  edges.reserve(chart.triangles.size() * 3);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      edges.emplace_back(high, low);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

/// The rank of each vertex in Eigen's minimum-degree ordering.
std::vector<std::uint32_t> least_degree(std::size_t count, const std::vector<Edge>& edges) {
  const auto size = static_cast<Eigen::Index>(count);
  Matrix upper(size, size);
  upper.reserve(static_cast<Eigen::Index>(count + edges.size()));
  auto edge = edges.begin();
  for (Eigen::Index v = 0; v < size; ++v) {
    upper.startVec(v);
    for (; edge != edges.end() && edge->first == v; ++edge) upper.insertBack(edge->second, v) = 1;
    upper.insertBack(v, v) = 1;
  }
  upper.finalize();
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(upper.selfadjointView<Eigen::Upper>(), order);
  std::vector<std::uint32_t> place(count);
  for (std::size_t p = 0; p < count; ++p) {
    place[static_cast<std::size_t>(order.indices()[static_cast<Eigen::Index>(p)])] =
        static_cast<std::uint32_t>(p);
  }
  return place;
}

}  // namespace

template <int N>
struct FlatSystem<N>::Solver {
  /// Unknowns: two columns x and y, or one column of interleaved x and y.
  using Unknowns =
      std::conditional_t<N == 1, Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>,
                         Eigen::VectorXd>;

  Matrix matrix;  ///< Upper triangle in the order of elimination, so that Eigen does not copy it
  /// For each stored value, its index among the values of all blocks
  std::vector<std::uint32_t> number_of;
  Eigen::SimplicialLDLT<Matrix, Eigen::Upper, Eigen::NaturalOrdering<int>> factor;
  Unknowns right;
};

template <int N>
FlatSystem<N>::~FlatSystem() = default;

FlatPattern::FlatPattern(const FlatChart& chart) : edges(edges_of(chart)) {
  const auto count = static_cast<std::uint32_t>(chart.points.size());
  place = least_degree(count, edges);
  for (Edge& edge : edges) {
    const auto [low, high] = std::minmax(place[edge.first], place[edge.second]);
    edge = {high, low};
  }
  std::sort(edges.begin(), edges.end());
  slots.reserve(chart.triangles.size() * 6);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(place[t[k]], place[t[(k + 1) % 3]]);
      const auto edge = std::lower_bound(edges.begin(), edges.end(), Edge{high, low});
      slots.push_back(place[t[k]]);
      slots.push_back(count + static_cast<std::uint32_t>(edge - edges.begin()));
    }
  }
}

template <int N>
FlatSystem<N>::FlatSystem(std::shared_ptr<const FlatPattern> pattern)
    : pattern_(std::move(pattern)), solver_(std::make_unique<Solver>()) {
  const std::vector<Edge>& edges = pattern_->edges;
  const auto count = static_cast<std::uint32_t>(pattern_->place.size());
  blocks_.resize(count + edges.size());
  Matrix& matrix = solver_->matrix;
  // Filled column by column: edges to earlier vertices first, the diagonal last.
  matrix.resize(Eigen::Index{N} * count, Eigen::Index{N} * count);
  matrix.reserve(static_cast<Eigen::Index>(blocks_.size() * N * N));
  std::size_t first = 0;
  for (std::uint32_t p = 0; p < count; ++p) {
    std::size_t end = first;
    while (end < edges.size() && edges[end].first == p) ++end;
    for (int column = 0; column < N; ++column) {
      const Eigen::Index at = Eigen::Index{N} * p + column;
      matrix.startVec(at);
      const auto add = [&](std::uint32_t of_row, std::size_t block, int rows) {
        for (int row = 0; row < rows; ++row) {
          matrix.insertBack(Eigen::Index{N} * of_row + row, at) = 0;
          solver_->number_of.push_back(static_cast<std::uint32_t>(block) * N * N +
                                       static_cast<std::uint32_t>(row * N + column));
        }
      };
      for (std::size_t e = first; e < end; ++e) add(edges[e].second, count + e, N);
      add(p, p, column + 1);
    }
    first = end;
  }
  matrix.finalize();
  solver_->factor.analyzePattern(matrix);
}

template <int N>
bool FlatSystem<N>::factorize() {
  Solver& solver = *solver_;
  for (std::size_t i = 0; i < solver.number_of.size(); ++i) {
    const std::uint32_t number = solver.number_of[i];
    solver.matrix.valuePtr()[i] = blocks_[number / (N * N)][number % (N * N)];
  }
  auto& factor = solver.factor;
  factor.factorize(solver.matrix);
  return factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0;
}

template <int N>
bool FlatSystem<N>::solve(std::vector<Vec2d>& points) {
  auto& right = solver_->right;
  right.resize(solver_->matrix.cols(), N == 1 ? 2 : 1);
  double* const values = right.data();  // The x of all points, then the y of all points
  for (std::size_t v = 0; v < points.size(); ++v) {
    double* const p = values + std::size_t{2} * pattern_->place[v];
    p[0] = points[v].x;
    p[1] = points[v].y;
  }
  right = solver_->factor.solve(right).eval();
  for (std::size_t v = 0; v < points.size(); ++v) {
    const double* const p = right.data() + std::size_t{2} * pattern_->place[v];
    points[v] = {p[0], p[1]};
  }
  return right.allFinite();
}

template class FlatSystem<1>;
template class FlatSystem<2>;

}  // namespace kiln
