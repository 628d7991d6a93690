// The linear systems of flat charts: a block of numbers for each edge and vertex, factorised again and again on
// one pattern.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "unwrap/flat_chart.h"

namespace kiln {

/// The places of a chart's vertices in the order of elimination. Where a matrix of its edges is not zero.
struct FlatPattern {
  explicit FlatPattern(const FlatChart& chart);

  std::vector<std::uint32_t> place;  ///< Place of each vertex
  /// Places of the ends of each edge, the higher first.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  /// Blocks of each triangle: corners with themselves, and with the next; of places, then of edges.
  std::vector<std::uint32_t> slots;
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
  ~FlatSystem();

  const std::shared_ptr<const FlatPattern>& pattern() const { return pattern_; }

  void clear() { std::fill(blocks_.begin(), blocks_.end(), Block{}); }
  Block& diagonal(std::uint32_t v) { return blocks_[pattern_->place[v]]; }
  /// Blocks of triangle i: corner k with itself, and with the next one.
  Block& own(std::size_t i, std::size_t k) { return blocks_[pattern_->slots[6 * i + 2 * k]]; }
  Block& side(std::size_t i, std::size_t k) { return blocks_[pattern_->slots[6 * i + 2 * k + 1]]; }

  /// \returns false where the matrix is not positive definite
  bool factorize();
  /// \param points  of each vertex; in: the right side, out: the solution
  /// \returns whether all are finite
  bool solve(std::vector<Vec2d>& points);

 private:
  struct Solver;  ///< Eigen's

  std::shared_ptr<const FlatPattern> pattern_;
  std::vector<Block> blocks_;  ///< One per place, then one per edge
  std::unique_ptr<Solver> solver_;
};

extern template class FlatSystem<1>;
extern template class FlatSystem<2>;

/// The system of as-rigid-as-possible rounds: one number a vertex, for x and y alike.
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
        const Vec2d& g = rest.gradient[k];
        own(i, k)[0] += area * dot(g, g);
        side(i, k)[0] += area * dot(g, rest.gradient[(k + 1) % 3]);
      }
    }
  }
};

}  // namespace kiln
