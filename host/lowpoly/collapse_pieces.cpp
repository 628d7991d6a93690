#include "lowpoly/collapse_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "lowpoly/mesh_pieces.h"

namespace kiln {
namespace {

/// Triangles of a piece, at least. What a piece needs then stays in a processor's cache for the most part.
constexpr std::size_t kPiece = 16'000;
/// What collapses may cost at first and at last: from below what rounding costs to all.
constexpr double kFirstCost = 1e-16, kLastCost = 1;
/// By how many times it grows. Costs are distance times area: a step takes a third of the triangles, or less.
constexpr double kGrowth = 2;

/// How often what collapses may cost grows before triangles are counted again: a piece is worked on for a while, but
/// not past the goal. \param over  triangles, times the goal
int steps_to(double over) { return over > 5 ? 4 : over > 2.5 ? 2 : over > 1 ? 1 : 0; }

/// How many triangles have a corner that stays.
std::size_t count_at(const Work& work, const std::vector<std::uint8_t>& fixed) {
  return static_cast<std::size_t>(std::count_if(
      work.triangles.begin(), work.triangles.end(),
      [&](const Triangle& t) { return fixed[t[0]] != 0 || fixed[t[1]] != 0 || fixed[t[2]] != 0; }));
}

/// By vertex, whether it stays where it is. All triangles of one that moves are in one piece.
std::vector<std::uint8_t> fixed_vertices(const Work& work,
                                         const std::vector<std::vector<std::uint32_t>>& pieces,
                                         std::span<const Place> untouched) {
  constexpr std::uint32_t kNone = kNoVertex, kSeveral = kNoVertex - 1;
  std::vector<std::uint32_t> piece_of(work.points.size(), kNone);
  std::vector<std::uint32_t> label_of(work.labels.empty() ? 0 : work.points.size(), kNone);
  const auto meet = [](std::uint32_t& known, std::uint32_t now) {
    known = known == kNone || known == now ? now : kSeveral;
  };
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    for (const std::uint32_t t : pieces[i]) {
      for (const std::uint32_t v : work.triangles[t]) {
        meet(piece_of[v], i);
        if (!label_of.empty()) meet(label_of[v], work.labels[t]);
      }
    }
  }
  std::vector<std::uint8_t> fixed(work.points.size());
  parallel_for(fixed.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      fixed[v] = piece_of[v] == kSeveral || (!label_of.empty() && label_of[v] == kSeveral) ||
                 std::any_of(untouched.begin(), untouched.end(), [&](const Place& place) {
                   const Vec3d way = work.points[v] - place.center;
                   return dot(way, way) < place.radius * place.radius;
                 });
    }
  });
  return fixed;
}

/// A piece by itself.
class Piece {
 public:
  Piece(const Work& work, std::vector<std::uint32_t> triangles,
        const std::vector<std::uint8_t>& fixed, const EdgeCollapser::Snap& snap)
      : of_triangle_(std::move(triangles)) {
    std::vector<std::uint32_t> number(work.points.size(), kNoVertex);
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
    mesh_ = std::make_unique<CollapseMesh>(points, own);
    collapser_ = std::make_unique<EdgeCollapser>(*mesh_, nullptr, snap, std::move(stays));
  }

  std::size_t faces() const { return mesh_->faces; }
  EdgeCollapser& collapser() { return *collapser_; }

  /// Puts back what is left. \param left  the triangles by their numbers before, added
  void give_back(Work& work, std::vector<Triangle>& triangles, std::vector<std::uint32_t>& left) {
    for (std::size_t v = 0; v < of_vertex_.size(); ++v) {
      if (mesh_->valence[v] != 0) work.points[of_vertex_[v]] = mesh_->points[v];
    }
    for (std::size_t t = 0; t < of_triangle_.size(); ++t) {
      if (mesh_->alive[t] == 0) continue;
      const Triangle& v = mesh_->triangles[t];
      triangles.push_back({of_vertex_[v[0]], of_vertex_[v[1]], of_vertex_[v[2]]});
      left.push_back(of_triangle_[t]);
    }
  }

 private:
  std::vector<std::uint32_t> of_triangle_, of_vertex_;
  std::unique_ptr<CollapseMesh> mesh_;
  std::unique_ptr<EdgeCollapser> collapser_;
};

/// Drops vertices that no triangle has.
void renumber(Work& work) {
  std::vector<std::uint32_t> number(work.points.size(), kNoVertex);
  for (const Triangle& t : work.triangles) {
    for (const std::uint32_t v : t) number[v] = 0;
  }
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kNoVertex) continue;
    work.points[count] = work.points[v];
    number[v] = count++;
  }
  work.points.resize(count);
  for (Triangle& t : work.triangles) {
    for (std::uint32_t& v : t) v = number[v];
  }
}

}  // namespace

void collapse_in_pieces(Work& work, std::size_t faces, std::span<const Place> untouched,
                        const EdgeCollapser::Snap& snap) {
  std::vector<std::vector<std::uint32_t>> lists =
      pieces_of(to_floats(work.points), work.triangles, kPiece);
  const std::vector<std::uint8_t> fixed = fixed_vertices(work, lists, untouched);
  std::vector<std::unique_ptr<Piece>> pieces(lists.size());
  const auto each = [&](const auto& body) {
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  };
  each([&](std::size_t i) {
    pieces[i] = std::make_unique<Piece>(work, std::move(lists[i]), fixed, snap);
  });
  // Triangles that hardly can go are not among those that should be left.
  const double goal = static_cast<double>(faces) + static_cast<double>(count_at(work, fixed));
  std::size_t left = work.triangles.size();
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
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> of;
  for (const std::unique_ptr<Piece>& piece : pieces) piece->give_back(work, triangles, of);
  if (!work.labels.empty()) {
    std::vector<std::uint32_t> labels;
    for (const std::uint32_t t : of) labels.push_back(work.labels[t]);
    work.labels = std::move(labels);
  }
  work.triangles = std::move(triangles);
  work.sources.clear();
  renumber(work);
}

}  // namespace kiln
