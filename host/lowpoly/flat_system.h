// The linear systems of flat charts: a block of numbers for each edge and vertex, factorised again and again on
// one pattern.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "lowpoly/flat_chart.h"

namespace kiln {

/// Which vertices of a chart share an edge, in an order of elimination, and where the factor has entries.
struct FlatPattern {
  /// The order is that of least degree.
  explicit FlatPattern(const FlatChart& chart);

  std::size_t count() const { return place.size(); }

  std::vector<std::uint32_t> place;  ///< Of each vertex in the order of elimination.
  /// The matrix by rows: those neighbours that come before, the diagonal last.
  std::vector<std::uint32_t> starts, columns;
  std::vector<std::uint32_t>
      slots;  ///< Of each triangle: each corner with itself, then with the next one.
  /// The factor by rows and by columns, both without the diagonal.
  std::vector<std::uint32_t> row_starts, row_columns, column_starts, column_rows;
};

/// A symmetric positive definite matrix of N x N blocks on a chart's pattern, and what solves it. Its unknowns are
/// points. Blocks are by rows, and symmetric themselves.
template <std::size_t N>
class FlatSystem {
 public:
  using Block = std::array<double, N * N>;

  explicit FlatSystem(const FlatChart& chart)
      : pattern_(chart),
        values_(pattern_.columns.size()),
        factor_(pattern_.column_rows.size()),
        inverse_(pattern_.count()),
        row_(pattern_.count()),
        filled_(pattern_.count()) {}

  void clear() { std::fill(values_.begin(), values_.end(), Block{}); }
  Block& diagonal(std::uint32_t v) { return values_[pattern_.starts[pattern_.place[v] + 1] - 1]; }
  /// Of triangle i: of corner k with itself, and with the next one.
  Block& own(std::size_t i, std::size_t k) { return values_[pattern_.slots[6 * i + 2 * k]]; }
  Block& side(std::size_t i, std::size_t k) { return values_[pattern_.slots[6 * i + 2 * k + 1]]; }

  /// \returns false where the matrix is not positive definite
  bool factorize();
  /// \param points  of each vertex; in: the right side, out: the solution
  /// \returns whether all are finite
  bool solve(std::vector<FlatPoint>& points);

 private:
  FlatPattern pattern_;
  std::vector<Block> values_;
  std::vector<Block> factor_;   ///< By columns.
  std::vector<Block> inverse_;  ///< Of the diagonal.
  std::vector<Block> row_;      ///< Scratch: the row that is made.
  std::vector<std::uint32_t> filled_;
  std::vector<FlatPoint> points_;
};

extern template class FlatSystem<1>;
extern template class FlatSystem<2>;

/// Of rounds that are as rigid as possible: a number a vertex, for x and y alike.
class RigidSystem : public FlatSystem<1> {
 public:
  using FlatSystem<1>::FlatSystem;

  /// Sets the chart's areas, each times a weight; no weights are ones.
  void fill(const FlatChart& chart, std::span<const double> weights) {
    clear();
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const RestShape& rest = chart.rest[i];
      const double area = weights.empty() ? rest.area : rest.area * weights[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const FlatPoint& g = rest.gradient[k];
        own(i, k)[0] += area * dot(g, g);
        side(i, k)[0] += area * dot(g, rest.gradient[(k + 1) % 3]);
      }
    }
  }
};

}  // namespace kiln
