// Part of EdgeCollapser: steps that repair bad triangles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "simplify/collapse.h"

namespace kiln {

/// Moves a corner of the triangle to the mean of the corner's neighbours, or part of the way there.
bool EdgeCollapser::repair_by_moving(std::uint32_t triangle, const auto& repair_check) {
  double lowest_cost = std::numeric_limits<double>::infinity();
  std::uint32_t moved_vertex = kNoVertex;
  Vec3d best{};
  for (const std::uint32_t v : mesh_.triangles[triangle]) {
    if (mesh_.is_hub(v) || is_on_border_[v] != 0) continue;
    mesh_.gather(v, neighbours_of_a_);
    Vec3d mean_neighbour{};
    for (const CollapseMesh::Neighbour& n : neighbours_of_a_)
      mean_neighbour += mesh_.points[n.vertex];
    mean_neighbour = mean_neighbour * (1.0 / static_cast<double>(neighbours_of_a_.size()));
    for (const double share : {1.0, 0.5, 0.25, 1.5}) {
      Vec3d target = mesh_.points[v] + (mean_neighbour - mesh_.points[v]) * share;
      if (round_point_) target = round_point_(target);
      const double cost = quadrics_[v].at(target);
      if (!(cost < lowest_cost)) continue;
      if (rule_ != nullptr && !rule_->may_move(mesh_, v, target)) continue;
      if (!repair_check.is_sound_around(v, kNoVertex, target)) continue;
      if (!bound_allows(v, kNoVertex, Anchor::none, target)) continue;
      lowest_cost = cost;
      moved_vertex = v;
      best = target;
    }
  }
  if (moved_vertex == kNoVertex) return false;
  if (deviation_bound_ != nullptr) {
    bound_allows(moved_vertex, kNoVertex, Anchor::none, best);
    deviation_bound_->collapse();
  }
  mesh_.points[moved_vertex] = best;
  vertex_errors_[moved_vertex] = quadrics_[moved_vertex].weighted_distance(best);
  ++vertex_stamps_[moved_vertex];
  mesh_.gather(moved_vertex, neighbours_of_a_);
  for (const CollapseMesh::Neighbour& n : neighbours_of_a_) push(moved_vertex, n.vertex);
  return true;
}

/// True if UV copies of the edge would have to collapse, too. Repairs do not use such a collapse: the copies may be
/// sound, or are repaired by themselves.
bool EdgeCollapser::has_twins(std::uint32_t a, std::uint32_t b, const Step& step) {
  std::vector<std::array<std::uint32_t, 2>> twins;
  const bool can_all_collapse = rule_->find_twins(mesh_, a, b, step.anchor, step.target, twins);
  rule_->end_twins();
  return !can_all_collapse || !twins.empty();
}

/// Collapses a side of the triangle to one of its end points, to its middle, or to the minimum of the quadric.
bool EdgeCollapser::repair_by_collapse(std::uint32_t triangle, const auto& repair_check) {
  Step best{Quadric()};
  best.cost = std::numeric_limits<double>::infinity();
  std::uint32_t best_removed = 0, best_kept = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [a, b] =
        std::minmax({mesh_.triangles[triangle][k], mesh_.triangles[triangle][(k + 1) % 3]});
    Step step = step_for(a, b);
    if (!step.allowed || step.anchor != Anchor::none || !keeps_topology(a, b)) continue;
    std::vector<Vec3d> candidate_positions{step.target};
    if (rule_ == nullptr || rule_->allows_any_position()) {
      candidate_positions.push_back(mesh_.points[a]);
      candidate_positions.push_back(mesh_.points[b]);
      candidate_positions.push_back((mesh_.points[a] + mesh_.points[b]) * 0.5);
    }
    for (const Vec3d& position : candidate_positions) {
      step.target = round_point_ ? round_point_(position) : position;
      step.cost = step.sum.at(step.target);
      if (!(step.cost < best.cost)) continue;
      if (rule_ != nullptr &&
          (!rule_->keeps(mesh_, a, b, step.anchor, step.target) || has_twins(a, b, step))) {
        continue;
      }
      if (!repair_check.is_sound_around(a, b, step.target) ||
          !repair_check.is_sound_around(b, a, step.target))
        continue;
      if (!bound_allows(a, b, step.anchor, step.target)) continue;
      best = step;
      best_removed = a;
      best_kept = b;
    }
  }
  if (!std::isfinite(best.cost)) return false;
  bound_allows(best_removed, best_kept, best.anchor, best.target);
  collapse(best_removed, best_kept, best);
  return true;
}

bool EdgeCollapser::repair_triangle(
    std::uint32_t triangle, const std::function<bool(const TriangleCorners&)>& is_bad_triangle) {
  if (mesh_.alive[triangle] == 0) return true;
  struct RepairCheck {
    const CollapseMesh& mesh;
    const std::function<bool(const TriangleCorners&)>& is_bad_triangle;
    /// The triangle to repair. It is checked first, since it is the most likely one to remain bad
    std::uint32_t repaired_triangle;
    bool is_sound_around(std::uint32_t moved, std::uint32_t other, const Vec3d& target) const {
      const auto remains_bad = [&](std::uint32_t t) {
        if (mesh.alive[t] == 0 || mesh.contains(t, other)) return false;
        TriangleCorners corners;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t v = mesh.triangles[t][k];
          corners[k] = v == moved ? target : mesh.points[v];
        }
        return is_bad_triangle(corners);
      };
      if (mesh.contains(repaired_triangle, moved) && remains_bad(repaired_triangle)) return false;
      const std::span<const std::uint32_t> all = mesh.around(moved);
      return std::none_of(all.begin(), all.end(), [&](std::uint32_t t) {
        return t != repaired_triangle && remains_bad(t);
      });
    }
  };
  const RepairCheck repair_check{mesh_, is_bad_triangle, triangle};
  return repair_by_moving(triangle, repair_check) || repair_by_collapse(triangle, repair_check);
}

}  // namespace kiln
