// The linear systems of flat charts: a block of numbers for each edge and vertex, factorised again and again on
// one pattern.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lowpoly/flat_chart.h"

namespace kiln {

/// The places of a chart's vertices in the order of elimination. Where the matrix and its factors L D L^T are not
/// zero, for blocks of any size.
struct FlatPattern {
  explicit FlatPattern(const FlatChart& chart);

  std::vector<std::uint32_t> place;  ///< Of each vertex
  std::vector<std::uint32_t>
      slots;  ///< Of each triangle: corners with themselves, and with the next; vertices, then edges
  std::vector<std::uint32_t> first,
      low;  ///< Of each place its first edge; each edge's place before
  // L without its diagonal.
  std::vector<std::uint32_t> row_first,
      row;  ///< Of each row its columns, in the order they are solved in
  std::vector<std::uint32_t> column_first, column;  ///< Of each column its rows, from above

 private:
  void find_factors();
};

/// A symmetric positive definite matrix of N x N blocks on a chart's pattern, and what solves it. Its unknowns are
/// points: of N = 1, x and y alike. Blocks are by rows, and symmetric themselves.
template <int N>
class FlatSystem {
 public:
  using Block = std::array<double, std::size_t{N} * N>;

  explicit FlatSystem(std::shared_ptr<const FlatPattern> pattern);
  explicit FlatSystem(const FlatChart& chart)
      : FlatSystem(std::make_shared<const FlatPattern>(chart)) {}

  const std::shared_ptr<const FlatPattern>& pattern() const { return pattern_; }
  void clear() { std::fill(blocks_.begin(), blocks_.end(), Block{}); }
  Block& diagonal(std::uint32_t v) { return blocks_[pattern_->place[v]]; }
  /// Of triangle i: of corner k with itself, and with the next one.
  Block& own(std::size_t i, std::size_t k) { return blocks_[pattern_->slots[6 * i + 2 * k]]; }
  Block& side(std::size_t i, std::size_t k) { return blocks_[pattern_->slots[6 * i + 2 * k + 1]]; }

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

  std::shared_ptr<const FlatPattern> pattern_;
  std::vector<Block> blocks_;  ///< Of each place, then of each edge
  std::vector<Block> lower_;   ///< L by columns, and so are its blocks
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
