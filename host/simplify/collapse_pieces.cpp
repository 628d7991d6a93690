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

/// Triangles of a piece, at least. What a piece needs then stays in a processor's cache for the most part.
constexpr std::size_t kPiece = 16'000;
/// Cost limits of collapses at first and at last: from below rounding to everything.
constexpr double kFirstCost = 1e-16, kLastCost = 1;
/// By how many times it grows. Costs are distance times area: a step takes a third of the triangles, or less.
constexpr double kGrowth = 2;

/// Times the cost limit grows before triangles are counted again: a piece is worked on for a while, but
/// not past the goal. \param over  triangles, times the goal
int steps_to(double over) { return over > 5 ? 4 : over > 2.5 ? 2 : over > 1 ? 1 : 0; }

/// Counts triangles with a fixed corner.
std::size_t count_at(const Work& work, const std::vector<std::uint8_t>& fixed) {
  return static_cast<std::size_t>(std::count_if(
      work.triangles.begin(), work.triangles.end(),
      [&](const Triangle& t) { return fixed[t[0]] != 0 || fixed[t[1]] != 0 || fixed[t[2]] != 0; }));
}

/// By vertex, whether it stays where it is. All triangles of one that moves are in one piece.
std::vector<std::uint8_t> fixed_vertices(const Work& work,
                                         const std::vector<std::vector<std::uint32_t>>& pieces,
                                         std::span<const Place> untouched) {
  std::vector<std::uint8_t> fixed = between_pieces(pieces, work.triangles, work.points.size());
  constexpr std::uint32_t kNone = kNoVertex, kSeveral = kNoVertex - 1;
  std::vector<std::uint32_t> label_of(work.labels.empty() ? 0 : work.points.size(), kNone);
  for (std::size_t t = 0; t < work.labels.size(); ++t) {
    const std::uint32_t label = work.labels[t];
    for (const std::uint32_t v : work.triangles[t]) {
      label_of[v] = label_of[v] == kNone || label_of[v] == label ? label : kSeveral;
    }
  }
  parallel_for(fixed.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      fixed[v] = fixed[v] != 0 || (!label_of.empty() && label_of[v] == kSeveral) ||
                 std::any_of(untouched.begin(), untouched.end(), [&](const Place& place) {
                   const Vec3d way = work.points[v] - place.center;
                   return dot(way, way) < place.radius * place.radius;
                 });
    }
  });
  return fixed;
}

/// Numbers by vertex for whoever needs some for a while: as many vectors as threads at most. They are long, and most
/// of what they hold stays unused.
class Numbers {
 public:
  using Lent = std::vector<std::uint32_t>;
  explicit Numbers(std::size_t count) : count_(count) {}

  /// \returns numbers that are all kNoVertex
  Lent lend() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return Lent(count_, kNoVertex);
    Lent numbers = std::move(idle_.back());
    idle_.pop_back();
    return numbers;
  }
  /// \param used  where they are not kNoVertex
  void take_back(Lent numbers, std::span<const std::uint32_t> used) {
    for (const std::uint32_t i : used) numbers[i] = kNoVertex;
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(numbers));
  }

 private:
  std::size_t count_;
  std::mutex mutex_;
  std::vector<Lent> idle_;
};

/// A piece by itself.
class Piece {
 public:
  Piece(const Work& work, std::vector<std::uint32_t> triangles,
        const std::vector<std::uint8_t>& fixed, Numbers& numbers, const EdgeCollapser::Snap& snap)
      : of_triangle_(std::move(triangles)) {
    Numbers::Lent number = numbers.lend();
    std::vector<Vec3d> points;
    std::vector<Triangle> own;
    std::vector<std::uint8_t> stays;
    own.reserve(of_triangle_.size());
    for (const std::uint32_t t : of_triangle_) {
      Triangle& corners = own.emplace_back(work.triangles[t]);
      for (std::uint32_t& v : corners) {
        if (number[v] == kNoVertex) {
          number[v] = static_cast<std::uint32_t>(points.size());
          of_vertex_.push_back(v);
          points.push_back(work.points[v]);
          stays.push_back(fixed[v]);
        }
        v = number[v];
      }
    }
    numbers.take_back(std::move(number), of_vertex_);
    mesh_ = std::make_unique<CollapseMesh>(points, own);
    collapser_ = std::make_unique<EdgeCollapser>(*mesh_, nullptr, snap, std::move(stays));
  }

  std::size_t faces() const { return mesh_->faces; }
  EdgeCollapser& collapser() { return *collapser_; }

  /// Notes the vertices that are left, by their numbers before.
  void note_used(std::vector<std::uint32_t>& used) const {
    for (std::uint32_t v = 0; v < mesh_->points.size(); ++v) {
      if (mesh_->valence[v] != 0) used[vertex(v)] = 1;
    }
  }
  /// Puts back what is left.
  /// \param number  new ones of vertices, by those before
  /// \param left    the triangles by their numbers before, added
  void give_back(Work& work, const std::vector<std::uint32_t>& number,
                 std::vector<std::uint32_t>& left) const {
    for (std::uint32_t v = 0; v < mesh_->points.size(); ++v) {
      if (mesh_->valence[v] != 0) work.points[number[vertex(v)]] = mesh_->points[v];
    }
    for (std::uint32_t t = 0; t < mesh_->triangles.size(); ++t) {
      if (mesh_->alive[t] == 0) continue;
      const Triangle& v = mesh_->triangles[t];
      work.triangles.push_back({number[vertex(v[0])], number[vertex(v[1])], number[vertex(v[2])]});
      left.push_back(of_triangle_[mesh_->given_triangle(t)]);
    }
  }

 private:
  /// The number that a vertex had before.
  std::uint32_t vertex(std::uint32_t own) const { return of_vertex_[mesh_->given_vertex(own)]; }

  std::vector<std::uint32_t> of_triangle_, of_vertex_;
  std::unique_ptr<CollapseMesh> mesh_;
  std::unique_ptr<EdgeCollapser> collapser_;
};

}  // namespace

Work collapsed_in_pieces(const Work& dense, std::span<const Vec3> positions, std::size_t faces,
                         std::span<const Place> untouched, const EdgeCollapser::Snap& snap) {
  std::vector<std::vector<std::uint32_t>> lists = pieces_of(positions, dense.triangles, kPiece);
  const std::vector<std::uint8_t> fixed = fixed_vertices(dense, lists, untouched);
  std::vector<std::unique_ptr<Piece>> pieces(lists.size());
  const auto each = [&](const auto& body) {
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  };
  Numbers numbers(dense.points.size());
  each([&](std::size_t i) {
    pieces[i] = std::make_unique<Piece>(dense, std::move(lists[i]), fixed, numbers, snap);
  });
  // Triangles that hardly can go are not among those that should be left.
  const double goal = static_cast<double>(faces) + static_cast<double>(count_at(dense, fixed));
  std::size_t left = dense.triangles.size();
  for (double cost = kFirstCost; cost < kLastCost;) {
    const int steps = steps_to(static_cast<double>(left) / goal);
    if (steps == 0) break;
    each([&](std::size_t i) {
      double own = cost;
      for (int step = 0; step < steps; ++step) pieces[i]->collapser().run_cheap(own *= kGrowth);
    });
    cost *= std::pow(kGrowth, steps);
    left = 0;
    for (const std::unique_ptr<Piece>& piece : pieces) left += piece->faces();
  }
  std::vector<std::uint32_t> number(dense.points.size(), 0), of;
  for (const std::unique_ptr<Piece>& piece : pieces) piece->note_used(number);
  std::uint32_t count = 0;
  for (std::uint32_t& v : number) count += std::exchange(v, count);
  Work result;
  result.keep_labels = dense.keep_labels;
  result.points.resize(count);
  result.triangles.reserve(left);
  for (const std::unique_ptr<Piece>& piece : pieces) piece->give_back(result, number, of);
  if (!dense.labels.empty()) {
    result.labels.reserve(of.size());
    for (const std::uint32_t t : of) result.labels.push_back(dense.labels[t]);
  }
  return result;
}

}  // namespace kiln
