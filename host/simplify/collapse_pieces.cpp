#include "simplify/collapse_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "simplify/mesh_pieces.h"

namespace kiln {
namespace {

/// Minimum number of triangles in a piece. The data of a piece of this size mostly fits in a core's cache.
constexpr std::size_t kMinPieceTriangles = 16'000;
/// First and last value of the cost limit. The first is below rounding errors, the last above every cost.
constexpr double kFirstCostLimit = 1e-16, kLastCostLimit = 1;
/// Factor by which the cost limit grows in each step. Since costs are distances times areas, a step of this size
/// removes at most a third of the triangles.
constexpr double kCostLimitGrowth = 2;

/// Number of steps by which the cost limit may grow before triangles are counted again. The number is as large as
/// possible, so that pieces are processed without interruption, but so small that the triangle count cannot fall below
/// the goal.
/// \param over  ratio of the current triangle count to the goal
int cost_steps(double over) { return over > 5 ? 4 : over > 2.5 ? 2 : over > 1 ? 1 : 0; }

/// Number of triangles that have at least one fixed corner.
std::size_t count_at_fixed(const Work& work, const std::vector<std::uint8_t>& fixed) {
  return static_cast<std::size_t>(std::count_if(
      work.triangles.begin(), work.triangles.end(),
      [&](const Triangle& t) { return fixed[t[0]] != 0 || fixed[t[1]] != 0 || fixed[t[2]] != 0; }));
}

/// For each vertex, 1 if it may not move. All triangles around a vertex that may move belong to one piece.
std::vector<std::uint8_t> fixed_vertices(const Work& work,
                                         const std::vector<std::vector<std::uint32_t>>& pieces,
                                         std::span<const Ball> untouched) {
  std::vector<std::uint8_t> fixed =
      vertices_between_pieces(pieces, work.triangles, work.points.size());
  constexpr std::uint32_t kNoLabel = kNoVertex, kSeveralLabels = kNoVertex - 1;
  std::vector<std::uint32_t> label_of(work.labels.empty() ? 0 : work.points.size(), kNoLabel);
  for (std::size_t t = 0; t < work.labels.size(); ++t) {
    const std::uint32_t label = work.labels[t];
    for (const std::uint32_t v : work.triangles[t]) {
      label_of[v] = label_of[v] == kNoLabel || label_of[v] == label ? label : kSeveralLabels;
    }
  }
  parallel_for(fixed.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      fixed[v] = fixed[v] != 0 || (!label_of.empty() && label_of[v] == kSeveralLabels) ||
                 std::any_of(untouched.begin(), untouched.end(), [&](const Ball& ball) {
                   const Vec3d from_centre = work.points[v] - ball.center;
                   return dot(from_centre, from_centre) < ball.radius * ball.radius;
                 });
    }
  });
  return fixed;
}

/// A pool of index arrays with one entry per vertex of the whole mesh. It holds at most one array per thread. Pieces
/// share the arrays because each piece uses only a few entries.
class IndexPool {
 public:
  using VertexIndices = std::vector<std::uint32_t>;
  explicit IndexPool(std::size_t count) : count_(count) {}

  /// \returns an array in which every entry is kNoVertex
  VertexIndices borrow_array() {
    const std::lock_guard lock(mutex_);
    if (idle_arrays_.empty()) return VertexIndices(count_, kNoVertex);
    VertexIndices indices = std::move(idle_arrays_.back());
    idle_arrays_.pop_back();
    return indices;
  }
  /// \param used  indices of the entries that are not kNoVertex; these are reset
  void return_array(VertexIndices indices, std::span<const std::uint32_t> used) {
    for (const std::uint32_t i : used) indices[i] = kNoVertex;
    const std::lock_guard lock(mutex_);
    idle_arrays_.push_back(std::move(indices));
  }

 private:
  std::size_t count_;
  std::mutex mutex_;
  std::vector<VertexIndices> idle_arrays_;
};

/// A piece of a mesh, copied into a mesh of its own and collapsed there.
class Piece {
 public:
  Piece(const Work& work, std::vector<std::uint32_t> triangles,
        const std::vector<std::uint8_t>& fixed, IndexPool& index_pool,
        const EdgeCollapser::Snap& snap)
      : source_triangles_(std::move(triangles)) {
    IndexPool::VertexIndices piece_vertex = index_pool.borrow_array();
    std::vector<Vec3d> points;
    std::vector<Triangle> piece_triangles;
    std::vector<std::uint8_t> is_fixed;
    piece_triangles.reserve(source_triangles_.size());
    for (const std::uint32_t t : source_triangles_) {
      Triangle& corners = piece_triangles.emplace_back(work.triangles[t]);
      for (std::uint32_t& v : corners) {
        if (piece_vertex[v] == kNoVertex) {
          piece_vertex[v] = static_cast<std::uint32_t>(points.size());
          source_vertices_.push_back(v);
          points.push_back(work.points[v]);
          is_fixed.push_back(fixed[v]);
        }
        v = piece_vertex[v];
      }
    }
    index_pool.return_array(std::move(piece_vertex), source_vertices_);
    mesh_ = std::make_unique<CollapseMesh>(points, piece_triangles);
    collapser_ = std::make_unique<EdgeCollapser>(*mesh_, nullptr, snap, std::move(is_fixed));
  }

  std::size_t faces() const { return mesh_->faces; }
  EdgeCollapser& collapser() { return *collapser_; }

  /// Sets entries of `used` to 1 for the vertices that remain in the piece. `used` is indexed by the vertices of the
  /// whole mesh.
  void mark_used(std::vector<std::uint32_t>& used) const {
    for (std::uint32_t v = 0; v < mesh_->points.size(); ++v) {
      if (mesh_->valence[v] != 0) used[vertex(v)] = 1;
    }
  }
  /// Writes the remaining vertices and triangles to the new whole mesh.
  /// \param number  new index of each vertex of the whole mesh
  /// \param left    [out] old index in the whole mesh of each triangle that is appended
  void write_back(Work& work, const std::vector<std::uint32_t>& number,
                  std::vector<std::uint32_t>& left) const {
    for (std::uint32_t v = 0; v < mesh_->points.size(); ++v) {
      if (mesh_->valence[v] != 0) work.points[number[vertex(v)]] = mesh_->points[v];
    }
    for (std::uint32_t t = 0; t < mesh_->triangles.size(); ++t) {
      if (mesh_->alive[t] == 0) continue;
      const Triangle& v = mesh_->triangles[t];
      work.triangles.push_back({number[vertex(v[0])], number[vertex(v[1])], number[vertex(v[2])]});
      left.push_back(source_triangles_[mesh_->given_triangle(t)]);
    }
  }

 private:
  /// Index in the whole mesh of a vertex of the piece.
  std::uint32_t vertex(std::uint32_t piece_triangles) const {
    return source_vertices_[mesh_->given_vertex(piece_triangles)];
  }

  std::vector<std::uint32_t> source_triangles_, source_vertices_;
  std::unique_ptr<CollapseMesh> mesh_;
  std::unique_ptr<EdgeCollapser> collapser_;
};

}  // namespace

Work collapse_in_pieces(const Work& dense, std::span<const Vec3> positions, std::size_t faces,
                        std::span<const Ball> untouched, const EdgeCollapser::Snap& snap) {
  std::vector<std::vector<std::uint32_t>> lists =
      pieces_of(positions, dense.triangles, kMinPieceTriangles);
  const std::vector<std::uint8_t> fixed = fixed_vertices(dense, lists, untouched);
  std::vector<std::unique_ptr<Piece>> pieces(lists.size());
  const auto for_each_piece = [&](const auto& body) {
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  };
  IndexPool numbers(dense.points.size());
  for_each_piece([&](std::size_t i) {
    pieces[i] = std::make_unique<Piece>(dense, std::move(lists[i]), fixed, numbers, snap);
  });
  // Triangles at fixed vertices are added to the goal, since most of them cannot be removed.
  const double goal =
      static_cast<double>(faces) + static_cast<double>(count_at_fixed(dense, fixed));
  std::size_t left = dense.triangles.size();
  for (double cost = kFirstCostLimit; cost < kLastCostLimit;) {
    const int steps = cost_steps(static_cast<double>(left) / goal);
    if (steps == 0) break;
    for_each_piece([&](std::size_t i) {
      double piece_triangles = cost;
      for (int step = 0; step < steps; ++step)
        pieces[i]->collapser().collapse_up_to_cost(piece_triangles *= kCostLimitGrowth);
    });
    cost *= std::pow(kCostLimitGrowth, steps);
    left = 0;
    for (const std::unique_ptr<Piece>& piece : pieces) left += piece->faces();
  }
  std::vector<std::uint32_t> number(dense.points.size(), 0), of;
  for (const std::unique_ptr<Piece>& piece : pieces) piece->mark_used(number);
  std::uint32_t count = 0;
  for (std::uint32_t& v : number) count += std::exchange(v, count);
  Work result;
  result.keep_labels = dense.keep_labels;
  result.points.resize(count);
  result.triangles.reserve(left);
  for (const std::unique_ptr<Piece>& piece : pieces) piece->write_back(result, number, of);
  if (!dense.labels.empty()) {
    result.labels.reserve(of.size());
    for (const std::uint32_t t : of) result.labels.push_back(dense.labels[t]);
  }
  return result;
}

}  // namespace kiln
