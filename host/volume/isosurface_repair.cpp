#include "volume/isosurface_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "mesh/vector.h"
#include "mesh/vertex_lists.h"
#include "simplify/collapse.h"
#include "simplify/simplify_check.h"
#include "volume/isosurface_patch.h"

namespace kiln {
namespace {

// The criteria of SimplifyCheck are applied to the fine vertices that a triangle's corners
// represent.
using flaw_rules::is_flat;
using flaw_rules::is_thin;
using flaw_rules::kMaxAwayCosine;
using flaw_rules::kMaxBackToBackCosine;
using flaw_rules::kMaxSuspiciousCosine;
using flaw_rules::normal_of;
using flaw_rules::unit_or_zero;

/// Maximum number of rounds of finding and repairing flaws.
constexpr int kMaxRepairRounds = 4;
/// Another round follows only if the last round repaired at least one in kFlawsPerRepair flaws.
constexpr std::size_t kFlawsPerRepair = 2;
/// Minimum height of a repaired triangle, as a share of its longest side.
constexpr double kMinHeightShare = 1e-4;
/// Minimum cosine between a fine vertex's normal and the normal of one side of a triangle for the
/// vertex to count as part of that side.
constexpr double kMinSideCosine = 0.3;

/// A low poly, and the fine surface that it simplifies.
struct RepairContext {
  const FineSurface& surface;
  const SimplifiedIsosurface& low_poly;

  TriangleCorners corners(const Triangle& t) const {
    return {to_double(low_poly.positions[t[0]]), to_double(low_poly.positions[t[1]]),
            to_double(low_poly.positions[t[2]])};
  }
  Vec3 triangle_center(const Triangle& t) const {
    const TriangleCorners p = corners(t);
    return to_float((p[0] + p[1] + p[2]) * (1.0 / 3));
  }
  /// Calls `body` with position and normal of the fine vertices that a vertex represents.
  void for_each_fine_vertex(std::uint32_t vertex, const auto& body) const {
    for (std::uint32_t i = low_poly.leaf_begins[vertex]; i < low_poly.leaf_begins[vertex + 1];
         ++i) {
      const kiln_volume_vertex& leaf = surface.vertices[low_poly.leaves[i]];
      body(Vec3d(leaf.position[0], leaf.position[1], leaf.position[2]),
           Vec3d(leaf.normal[0], leaf.normal[1], leaf.normal[2]));
    }
  }
  /// True if simplification closed a gap between a triangle and another one with the same corners
  /// in reverse order. This is so if the fine vertices whose normals agree with the triangle's lie,
  /// on average, below those whose normals oppose it.
  bool has_closed_gap(const Triangle& t) const {
    const Vec3d normal = unit_or_zero(normal_of(corners(t)));
    double height_sum_above = 0, height_sum_below = 0;
    std::size_t fine_count_above = 0, fine_count_below = 0;
    for (const std::uint32_t vertex : t) {
      const Vec3d at = to_double(low_poly.positions[vertex]);
      for_each_fine_vertex(vertex, [&](const Vec3d& p, const Vec3d& n) {
        const double along = dot(n, normal), height = dot(p - at, normal);
        if (along > kMinSideCosine) height_sum_above += height, ++fine_count_above;
        if (along < -kMinSideCosine) height_sum_below += height, ++fine_count_below;
      });
    }
    if (fine_count_above == 0 || fine_count_below == 0) return false;
    return height_sum_above / static_cast<double>(fine_count_above) <
           height_sum_below / static_cast<double>(fine_count_below);
  }
  /// True if the fine surface between a triangle's corners has a sharp edge or is thin.
  bool has_sharp_edge(const Triangle& t) const {
    const Vec3d normal = unit_or_zero(normal_of(corners(t)));
    double max_cosine = -1, min_cosine = 1;
    for (const std::uint32_t vertex : t) {
      for_each_fine_vertex(vertex, [&](const Vec3d&, const Vec3d& n) {
        max_cosine = std::max(max_cosine, dot(n, normal));
        min_cosine = std::min(min_cosine, dot(n, normal));
      });
    }
    return max_cosine > -kMaxSuspiciousCosine && min_cosine < kMaxSuspiciousCosine;
  }
  /// True if fine vertices face away from a triangle: for at least three of four points of the
  /// triangle, the nearest fine vertex does.
  bool may_face_away(const Triangle& t) const {
    const TriangleCorners p = corners(t);
    const Vec3d normal = unit_or_zero(normal_of(p));
    std::array<Vec3d, 4> places{};
    std::array<double, 4> nearest_distances{}, cosines{};
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        places[i] += p[k] * (i == 3 ? 1.0 / 3 : i == k ? 0.6 : 0.2);
      nearest_distances[i] = std::numeric_limits<double>::infinity();
    }
    for (const std::uint32_t vertex : t) {
      for_each_fine_vertex(vertex, [&](const Vec3d& at, const Vec3d& n) {
        for (std::size_t i = 0; i < 4; ++i) {
          const Vec3d d = at - places[i];
          if (!(dot(d, d) < nearest_distances[i])) continue;
          nearest_distances[i] = dot(d, d);
          cosines[i] = dot(n, normal);
        }
      });
    }
    return std::count_if(cosines.begin(), cosines.end(),
                         [](double c) { return c < kMaxAwayCosine; }) >= 3;
  }
};

/// Removes pairs of triangles that lie back to back where simplification closed a gap; counts the
/// other triangles that have the same corners as another one.
void remove_closed_gaps(const FineSurface& surface, SimplifiedIsosurface& low_poly,
                        IsosurfaceFlaws& flaws) {
  const IsosurfaceFaces faces(low_poly);
  const RepairContext context{surface, low_poly};
  struct SortedTriangle {
    Triangle sorted;
    std::uint32_t triangle;
    bool
        is_even_permutation;  ///< True if the corners are an even permutation of the sorted corners
  };
  std::vector<SortedTriangle> sorted_triangles(faces.triangles.size());
  parallel_for(sorted_triangles.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Triangle t = lowest_first(faces.triangles[i]);
      const bool is_even_permutation = t[1] < t[2];
      if (!is_even_permutation) std::swap(t[1], t[2]);
      sorted_triangles[i] = {t, static_cast<std::uint32_t>(i), is_even_permutation};
    }
  });
  const VertexLists triangles_by_vertex(
      low_poly.positions.size(), sorted_triangles.size(),
      [&](std::size_t i) { return sorted_triangles[i].sorted[0]; },
      [&](std::size_t i) {
        return std::uint64_t{sorted_triangles[i].sorted[1]} << 32 | sorted_triangles[i].sorted[2];
      });
  std::vector<std::uint8_t> gone;
  for (std::size_t v = 0; v < triangles_by_vertex.vertices(); ++v) {
    const auto of = triangles_by_vertex.of(v);
    for (std::size_t begin = 0, end = 0; begin < of.size(); begin = end) {
      while (end < of.size() && of[end].key == of[begin].key) ++end;
      const std::size_t count = end - begin;
      if (count < 2) continue;
      std::array<std::vector<std::uint32_t>, 2> sides;
      for (std::size_t i = begin; i < end; ++i) {
        sides[sorted_triangles[of[i].index].is_even_permutation ? 0 : 1].push_back(of[i].index);
      }
      const std::size_t pairs = std::min(sides[0].size(), sides[1].size());
      const Triangle& first = faces.triangles[of[begin].index];
      if (pairs > 0 && context.has_closed_gap(first)) {
        if (gone.empty()) gone.resize(sorted_triangles.size(), 0);
        for (const auto& side : sides) {
          for (std::size_t i = 0; i < pairs; ++i) gone[side[i]] = 1;
        }
        flaws.removed_back_to_back += 2 * pairs;
        if (count - 2 * pairs < 2) continue;
        flaws.duplicates.count += count - 2 * pairs - 1;
      } else {
        flaws.duplicates.count += count - 1;
      }
      flaws.duplicates.place = context.triangle_center(first);
    }
  }
  if (gone.empty()) return;
  IsosurfaceChange change(low_poly, faces);
  for (std::uint32_t t = 0; t < gone.size(); ++t) change.is_remaining[t] = gone[t] == 0;
  change.apply_to_low_poly(surface, low_poly);
}

/// Triangles that may be folded or degenerate.
std::vector<std::uint32_t> find_suspects(const RepairContext& context,
                                         const IsosurfaceFaces& faces) {
  const std::vector<Triangle>& triangles = faces.triangles;
  std::vector<Vec3d> normals(triangles.size());
  std::vector<std::uint8_t> may_be_flawed(triangles.size(), 0);
  parallel_for(triangles.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      normals[t] = unit_or_zero(normal_of(context.corners(triangles[t])));
      int opposed_corners = 0;
      for (const std::uint32_t v : triangles[t])
        opposed_corners += dot(normals[t], to_double(context.low_poly.normals[v])) < 0;
      may_be_flawed[t] = opposed_corners >= 2 || is_flat(context.corners(triangles[t]));
    }
  });
  std::vector<std::uint8_t> back_to_back(triangles.size(), 0);
  const SideLists sides(triangles, context.low_poly.positions.size());
  sides.each_edge([&](std::uint32_t, std::span<const SideLists::Item> of) {
    for (std::size_t i = 1; i < of.size(); ++i) {
      if (SideLists::forward(of[i - 1]) == SideLists::forward(of[i])) continue;
      const std::uint32_t a = of[i - 1].index / 3, b = of[i].index / 3;
      const double cosine = dot(normals[a], normals[b]);
      if (cosine < kMaxSuspiciousCosine) may_be_flawed[a] = may_be_flawed[b] = 1;
      if (cosine < kMaxBackToBackCosine && of.size() == 2) back_to_back[a] = back_to_back[b] = 1;
    }
  });
  std::vector<std::uint32_t> candidates, result;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (may_be_flawed[t] != 0) candidates.push_back(t);
  }
  std::vector<std::uint8_t> is_confirmed(candidates.size(), 0);
  parallel_for(candidates.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = triangles[candidates[i]];
      is_confirmed[i] = back_to_back[candidates[i]] != 0 || is_flat(context.corners(t)) ||
                        context.may_face_away(t);
    }
  });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (is_confirmed[i] != 0) result.push_back(candidates[i]);
  }
  return result;
}

/// Constraint for edge collapses in a patch: vertices on the patch's boundary keep their positions, inner vertices may
/// move.
class FixedVerticesConstraint : public CollapseConstraint {
 public:
  explicit FixedVerticesConstraint(const std::vector<std::uint8_t>& is_fixed)
      : is_fixed_(is_fixed) {}

  std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                             Anchor anchor, Quadric& sum) const override {
    const bool is_a_fixed = anchor == Anchor::first || is_fixed_[a] != 0;
    const bool is_b_fixed = anchor == Anchor::second || is_fixed_[b] != 0;
    if (is_a_fixed && is_b_fixed) return std::nullopt;
    const Vec3d &pa = mesh.points[a], &pb = mesh.points[b];
    return is_a_fixed ? pa : is_b_fixed ? pb : sum.best_near(pa, pb);
  }
  bool allows_any_position() const override { return true; }
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor,
             const Vec3d& target) const override {
    const auto stays = [&](std::uint32_t v) {
      return is_fixed_[v] == 0 || length(mesh.points[v] - target) == 0;
    };
    return stays(a) && stays(b);
  }
  void collapse(const CollapseMesh&, std::uint32_t a, std::uint32_t b, Anchor, const Vec3d&,
                std::uint32_t kept) override {
    is_fixed_[kept] = is_fixed_[a] | is_fixed_[b];
    merges.emplace_back(kept, kept == a ? b : a);
  }
  bool may_move(const CollapseMesh&, std::uint32_t vertex, const Vec3d&) const override {
    return is_fixed_[vertex] == 0;
  }

  /// Pairs of the vertex that was kept and the vertex that was merged into it
  std::vector<std::pair<std::uint32_t, std::uint32_t>> merges;

 private:
  std::vector<std::uint8_t> is_fixed_;
};

/// Repairs as many flaws of a patch as possible, and counts those that remain.
void mend_patch(IsosurfacePatch& patch, IsosurfaceFlaws& flaws) {
  SimplifyCheck check(patch.fine_points, patch.fine_triangles);
  const auto is_flawed = [&](const TriangleCorners& corners) {
    return is_thin(corners, kMinHeightShare) || check.is_flaw(corners);
  };
  const auto snap = [&](const Vec3d& p) { return patch.snap(p); };
  Flaws found = check.find_selected(patch.points, patch.triangles, patch.seeds);
  const std::size_t flaws_before = found.count();
  for (int round = 0; round < kMaxRepairRounds && !found.none(); ++round) {
    CollapseMesh mesh(patch.points, patch.triangles);
    FixedVerticesConstraint constraint(patch.is_fixed);
    EdgeCollapser collapser(mesh, &constraint, snap);
    bool has_repaired = false;
    for (const auto* list : {&found.flat, &found.folded}) {
      for (const std::uint32_t t : *list)
        has_repaired = collapser.repair_triangle(t, is_flawed) || has_repaired;
    }
    if (!has_repaired) break;
    patch.seeds.clear();
    for (const auto* list : {&found.flat, &found.folded}) {
      patch.seeds.insert(patch.seeds.end(), list->begin(), list->end());
    }
    patch.apply_collapses(mesh, constraint.merges);
    const std::size_t last = found.count();
    found = check.find_selected(patch.points, patch.triangles, patch.seeds);
    if (found.count() * kFlawsPerRepair > last * (kFlawsPerRepair - 1)) break;
  }
  flaws.mended += flaws_before - std::min(flaws_before, found.count());
  const auto left = [&](const std::vector<std::uint32_t>& list,
                        IsosurfaceFlaws::RemainingFlaws& to) {
    to.count = list.size();
    if (list.empty()) return;
    Vec3d sum{};
    for (const std::uint32_t v : patch.triangles[list[0]]) sum += patch.points[v];
    to.place = patch.to_world(sum * (1.0 / 3));
  };
  left(found.flat, flaws.degenerate);
  left(found.folded, flaws.folded);
}

}  // namespace

IsosurfaceFlaws repair_isosurface(const FineSurface& surface, const Volume& volume,
                                  SimplifiedIsosurface& low_poly) {
  IsosurfaceFlaws flaws;
  if (low_poly.changed_topology != 0) remove_closed_gaps(surface, low_poly, flaws);
  const IsosurfaceFaces faces(low_poly);
  const std::vector<std::uint32_t> suspects = find_suspects({surface, low_poly}, faces);
  if (suspects.empty()) return flaws;
  IsosurfacePatch patch(surface, low_poly, faces, suspects);
  mend_patch(patch, flaws);
  patch.apply_to_low_poly(surface, volume, low_poly);
  return flaws;
}

}  // namespace kiln
