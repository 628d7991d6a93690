#include "unwrap/flat_system.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <type_traits>
#include <utility>

namespace kiln {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// The chart's edges without duplicates, as pairs of vertices with the higher index first.
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
std::vector<std::uint32_t> minimum_degree_order(std::size_t count, const std::vector<Edge>& edges) {
  const auto size = static_cast<Eigen::Index>(count);
  SparseMatrix upper_triangle(size, size);
  upper_triangle.reserve(static_cast<Eigen::Index>(count + edges.size()));
  auto edge = edges.begin();
  for (Eigen::Index v = 0; v < size; ++v) {
    upper_triangle.startVec(v);
    for (; edge != edges.end() && edge->first == v; ++edge)
      upper_triangle.insertBack(edge->second, v) = 1;
    upper_triangle.insertBack(v, v) = 1;
  }
  upper_triangle.finalize();
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(upper_triangle.selfadjointView<Eigen::Upper>(), order);
  std::vector<std::uint32_t> vertex_rank(count);
  for (std::size_t p = 0; p < count; ++p) {
    vertex_rank[static_cast<std::size_t>(order.indices()[static_cast<Eigen::Index>(p)])] =
        static_cast<std::uint32_t>(p);
  }
  return vertex_rank;
}

}  // namespace

template <int N>
struct FlatSystem<N>::Solver {
  /// Matrix of unknowns: two columns, x and y; or one column in which x and y alternate.
  using Unknowns =
      std::conditional_t<N == 1, Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>,
                         Eigen::VectorXd>;

  /// Upper triangle of the matrix, in elimination order; Eigen reads it without a copy
  SparseMatrix matrix;
  /// For each stored value of the matrix, its index among the values of all blocks
  std::vector<std::uint32_t> value_index;
  Eigen::SimplicialLDLT<SparseMatrix, Eigen::Upper, Eigen::NaturalOrdering<int>> factorization;
  Unknowns right_side;
};

template <int N>
FlatSystem<N>::~FlatSystem() = default;

FlatPattern::FlatPattern(const FlatChart& chart) : edges(edges_of(chart)) {
  const auto count = static_cast<std::uint32_t>(chart.points.size());
  vertex_rank = minimum_degree_order(count, edges);
  for (Edge& edge : edges) {
    const auto [low, high] = std::minmax(vertex_rank[edge.first], vertex_rank[edge.second]);
    edge = {high, low};
  }
  std::sort(edges.begin(), edges.end());
  triangle_blocks.reserve(chart.triangles.size() * 6);
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(vertex_rank[t[k]], vertex_rank[t[(k + 1) % 3]]);
      const auto edge = std::lower_bound(edges.begin(), edges.end(), Edge{high, low});
      triangle_blocks.push_back(vertex_rank[t[k]]);
      triangle_blocks.push_back(count + static_cast<std::uint32_t>(edge - edges.begin()));
    }
  }
}

template <int N>
FlatSystem<N>::FlatSystem(std::shared_ptr<const FlatPattern> pattern)
    : pattern_(std::move(pattern)), solver_(std::make_unique<Solver>()) {
  const std::vector<Edge>& edges = pattern_->edges;
  const auto count = static_cast<std::uint32_t>(pattern_->vertex_rank.size());
  blocks_.resize(count + edges.size());
  SparseMatrix& matrix = solver_->matrix;
  // Fills the matrix column by column: first the edges to vertices earlier in the elimination order, the diagonal block
  // last.
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
          solver_->value_index.push_back(static_cast<std::uint32_t>(block) * N * N +
                                         static_cast<std::uint32_t>(row * N + column));
        }
      };
      for (std::size_t e = first; e < end; ++e) add(edges[e].second, count + e, N);
      add(p, p, column + 1);
    }
    first = end;
  }
  matrix.finalize();
  solver_->factorization.analyzePattern(matrix);
}

template <int N>
bool FlatSystem<N>::factorize() {
  Solver& solver = *solver_;
  for (std::size_t i = 0; i < solver.value_index.size(); ++i) {
    const std::uint32_t value_index = solver.value_index[i];
    solver.matrix.valuePtr()[i] = blocks_[value_index / (N * N)][value_index % (N * N)];
  }
  auto& factorization = solver.factorization;
  factorization.factorize(solver.matrix);
  return factorization.info() == Eigen::Success && factorization.vectorD().minCoeff() > 0;
}

template <int N>
bool FlatSystem<N>::solve(std::vector<Vec2d>& points) {
  auto& right_side = solver_->right_side;
  right_side.resize(solver_->matrix.cols(), N == 1 ? 2 : 1);
  double* const values =
      right_side.data();  // The x coordinates of all points, then their y coordinates
  for (std::size_t v = 0; v < points.size(); ++v) {
    double* const p = values + std::size_t{2} * pattern_->vertex_rank[v];
    p[0] = points[v].x;
    p[1] = points[v].y;
  }
  right_side = solver_->factorization.solve(right_side).eval();
  for (std::size_t v = 0; v < points.size(); ++v) {
    const double* const p = right_side.data() + std::size_t{2} * pattern_->vertex_rank[v];
    points[v] = {p[0], p[1]};
  }
  return right_side.allFinite();
}

template class FlatSystem<1>;
template class FlatSystem<2>;

}  // namespace kiln
