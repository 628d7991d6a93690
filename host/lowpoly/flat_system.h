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

/// A symmetric positive definite matrix of N x N blocks on a chart's pattern, and what solves it. Its unknowns are
/// points: of N = 1, x and y alike. Blocks are by rows, and symmetric themselves.
template <int N>
class FlatSystem {
 public:
  using Block = std::array<double, std::size_t{N} * N>;

  explicit FlatSystem(const FlatChart& chart);

  void clear() { std::fill(blocks_.begin(), blocks_.end(), Block{}); }
  Block& diagonal(std::uint32_t v) { return blocks_[place_[v]]; }
  /// Of triangle i: of corner k with itself, and with the next one.
  Block& own(std::size_t i, std::size_t k) { return blocks_[slots_[6 * i + 2 * k]]; }
  Block& side(std::size_t i, std::size_t k) { return blocks_[slots_[6 * i + 2 * k + 1]]; }

  /// \returns false where the matrix is not positive definite
  bool factorize();
  /// \param points  of each vertex; in: the right side, out: the solution
  /// \returns whether all are finite
  bool solve(std::vector<FlatPoint>& points);

 private:
  /// D of one place, and what L has between its unknowns.
  struct Pivot {
    std::array<double, N> d;
    double between = 0;
  };
  void find_pattern();

  std::vector<std::uint32_t> place_;  ///< Of each vertex in the order of elimination
  std::vector<Block> blocks_;         ///< Of each place, then of each edge
  std::vector<std::uint32_t>
      slots_;  ///< Of each triangle: corners with themselves, and with the next
  std::vector<std::uint32_t> first_,
      low_;  ///< Of each place its first edge; each edge's place before
  // The factors L D L^T: L without its diagonal, by columns. What is in a row is known beforehand.
  std::vector<std::uint32_t> row_first_,
      row_;  ///< Of each row its columns, in the order they are solved in
  std::vector<std::uint32_t> column_first_, column_;  ///< Of each column its rows, from above
  std::vector<Block> lower_;                          ///< L there, blocks by columns
  std::vector<Pivot> pivots_;
  // Scratch of factorize().
  std::vector<Block> open_;                ///< Of each column, what is left of the row
  std::vector<std::uint32_t> column_end_;  ///< Of each column, where its next row goes
  std::vector<double> right_;              ///< Scratch of solve()
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
