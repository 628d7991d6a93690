// Sparse linear systems of flat charts, with one block for each edge and each vertex. The symbolic factorization is
// reused.
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

/// Elimination order of a chart's vertices, and the non-zero pattern of matrices over its edges.
struct FlatPattern {
  explicit FlatPattern(const FlatChart& chart);

  std::vector<std::uint32_t> vertex_rank;  ///< Rank of each vertex in the elimination order
  /// Ranks of the two vertices of each edge, the higher rank first.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  /// For each triangle, six indices in the list of blocks. Each corner has two of them: the diagonal block of its
  /// vertex, and the off-diagonal block of the edge to the next corner. In the list, the blocks of all vertices come
  /// first, then the blocks of all edges.
  std::vector<std::uint32_t> triangle_blocks;
};

/// A symmetric positive definite matrix of N x N blocks with a chart's pattern, and its solver. The unknowns are
/// points. For N = 1, x and y are solved with the same matrix. Blocks are symmetric.
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
  Block& vertex_block(std::uint32_t v) { return blocks_[pattern_->vertex_rank[v]]; }
  /// Diagonal block of the vertex at corner k of triangle i. edge_block() is the block of the edge from that corner to
  /// the next.
  Block& corner_block(std::size_t i, std::size_t k) {
    return blocks_[pattern_->triangle_blocks[6 * i + 2 * k]];
  }
  Block& edge_block(std::size_t i, std::size_t k) {
    return blocks_[pattern_->triangle_blocks[6 * i + 2 * k + 1]];
  }

  /// \returns false if the matrix is not positive definite
  bool factorize();
  /// \param points  [in, out] by vertex: the right-hand side on entry, the solution on return
  /// \returns whether the solution is finite
  bool solve(std::vector<Vec2d>& points);

 private:
  struct Solver;  ///< Wraps Eigen's solver

  std::shared_ptr<const FlatPattern> pattern_;
  std::vector<Block> blocks_;  ///< Block of each vertex, then of each edge
  std::unique_ptr<Solver> solver_;
};

extern template class FlatSystem<1>;
extern template class FlatSystem<2>;

/// The linear system of as-rigid-as-possible rounds: one unknown per vertex, with the same matrix for x and y.
class RigidSystem : public FlatSystem<1> {
 public:
  using FlatSystem<1>::FlatSystem;

  /// Sets the matrix for the chart. The areas of triangles are multiplied by `weights`; if that is empty, all weights
  /// are 1.
  void fill(const FlatChart& chart, std::span<const double> weights) {
    clear();
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const RestShape& rest = chart.rest[i];
      const double area = weights.empty() ? rest.area : rest.area * weights[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d& g = rest.gradient[k];
        corner_block(i, k)[0] += area * dot(g, g);
        edge_block(i, k)[0] += area * dot(g, rest.gradient[(k + 1) % 3]);
      }
    }
  }
};

}  // namespace kiln
