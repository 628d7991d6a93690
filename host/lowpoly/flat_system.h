// The linear systems of flat charts: orders of elimination, and the one of rounds that are as rigid as possible.
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "lowpoly/flat_chart.h"

namespace kiln {

/// Eigen's order of least degree. It takes the matrix as symmetric, which solvers hand over, and so need not add
/// the transposed one.
struct SymmetricOrder {
  template <typename Matrix, typename Order>
  void operator()(const Matrix& matrix, Order& order) const {
    Eigen::AMDOrdering<int>()(matrix.template selfadjointView<Eigen::Lower>(), order);
  }
};

/// The same where rows come by twos, as x and y of a vertex: looked at once a vertex.
struct PairedOrder {
  template <typename Matrix, typename Order>
  void operator()(const Matrix& matrix, Order& order) const {
    const Eigen::Index count = matrix.cols() / 2;
    Eigen::SparseMatrix<double> half(count, count);
    half.reserve(matrix.nonZeros() / 4);
    for (Eigen::Index v = 0; v < count; ++v) {
      half.startVec(v);
      for (typename Matrix::InnerIterator it(matrix, 2 * v); it; ++it) {
        if (it.row() % 2 == 0) half.insertBack(it.row() / 2, v) = 1;
      }
    }
    half.finalize();
    Order of_half;
    SymmetricOrder()(half, of_half);
    order.resize(2 * count);
    for (Eigen::Index v = 0; v < count; ++v) {
      for (int i = 0; i < 2; ++i) order.indices()[2 * v + i] = 2 * of_half.indices()[v] + i;
    }
  }
};

/// A row a vertex. The pattern is that of the chart's edges, and looked at once.
class RigidSystem {
 public:
  explicit RigidSystem(const FlatChart& chart)
      : matrix_(static_cast<Eigen::Index>(chart.points.size()),
                static_cast<Eigen::Index>(chart.points.size())) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(chart.triangles.size() * 6);
    for (const Triangle& t : chart.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        entries.emplace_back(static_cast<int>(t[k]), static_cast<int>(t[k]), 0);
        entries.emplace_back(static_cast<int>(high), static_cast<int>(low), 0);
      }
    }
    matrix_.setFromTriplets(entries.begin(), entries.end());
    solver_.analyzePattern(matrix_);
    slots_.reserve(chart.triangles.size() * 6);
    for (const Triangle& t : chart.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        slots_.push_back(slot(t[k], t[k]));
        slots_.push_back(slot(high, low));
      }
    }
  }

  /// Sets the chart's areas, each times a weight; no weights are ones.
  void fill(const FlatChart& chart, std::span<const double> weights) {
    double* const values = matrix_.valuePtr();
    std::fill(values, values + matrix_.nonZeros(), 0.0);
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const RestShape& rest = chart.rest[i];
      const double area = weights.empty() ? rest.area : rest.area * weights[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const FlatPoint& g = rest.gradient[k];
        values[slots_[6 * i + 2 * k]] += area * dot(g, g);
        values[slots_[6 * i + 2 * k + 1]] += area * dot(g, rest.gradient[(k + 1) % 3]);
      }
    }
  }

  /// What stands on the diagonal, which leads its column.
  double& diagonal(std::uint32_t v) { return matrix_.valuePtr()[matrix_.outerIndexPtr()[v]]; }

  bool factorize() {
    solver_.factorize(matrix_);
    return solver_.info() == Eigen::Success;
  }
  Eigen::MatrixX2d solve(const Eigen::MatrixX2d& right) const { return solver_.solve(right); }

 private:
  Eigen::Index slot(std::uint32_t row, std::uint32_t column) const {
    const int* const rows = matrix_.innerIndexPtr();
    const int *const begin = rows + matrix_.outerIndexPtr()[column],
                     *const end = rows + matrix_.outerIndexPtr()[column + 1];
    return std::lower_bound(begin, end, static_cast<int>(row)) - rows;
  }

  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, SymmetricOrder> solver_;
  std::vector<Eigen::Index>
      slots_;  ///< Of each triangle: each corner with itself, then with the next one.
};

}  // namespace kiln
