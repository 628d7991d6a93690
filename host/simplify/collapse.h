// Edge collapse with quadric errors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/vectors.h"
#include "kiln/types.h"
#include "mesh/quadric.h"
#include "mesh/vector.h"
#include "simplify/collapse_constraint.h"
#include "simplify/collapse_mesh.h"
#include "simplify/collapse_queue.h"
#include "simplify/collapse_shape.h"
#include "simplify/deviation_bound.h"

namespace kiln {

/// Reduces a triangle mesh by edge collapses. The cheapest collapse goes first; the merged vertex lies at the minimum
/// of its quadric (Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics"). Perpendicular
/// planes
/// through open borders hold the borders in place (section 6 of that paper). Without a constraint, the cost is the
/// increase of the distance to the planes, not of the squared distance. Quadrics are rebuilt whenever the number of
/// triangles has halved.
///
/// Each collapse keeps the topology (link condition; borders do not pinch, components do not vanish). Triangles do
/// not flip, fold onto a neighbour or lose their area. They become slivers or turn far only if every other collapse
/// costs several times as much.
/// Edges may have any number of triangles. Deterministic: ties go to the lower vertices. Coordinates should be of
/// about unit size; arithmetic is in double precision.
/// Cost: about 5 microseconds a collapse, O(n log n) in all. A vertex of over 256 triangles (a hub) does not move;
/// its neighbours collapse into it.
class EdgeCollapser {
 public:
  /// Rounds a point to one that the caller's mesh can store.
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// Triangles must have three different vertices, and no two triangles may have the same vertices in the same
  /// orientation.
  /// \param mesh  must outlive this object. Its triangles and vertices are renumbered as it shrinks
  ///              (CollapseMesh::compact()), unless there is a constraint or a bound
  /// \param rule  constraint in addition to triangle shapes; may be null; must outlive this object
  /// \param fixed  by vertex, 1 if its edges may not collapse; if empty, all edges may
  explicit EdgeCollapser(CollapseMesh& mesh, CollapseConstraint* rule = nullptr, Snap snap = {},
                         std::vector<std::uint8_t> fixed = {});

  /// Rejects collapses that `deviation` refuses from now on. The bound must have been built from the mesh in its
  /// present state, and must outlive this object.
  /// \param sharpening  decrease of the cosine by which sharp edges may become sharper; no other edge may become
  ///        sharp
  /// \param bound       largest root-mean-square distance of the lines between labels from their present position
  void limit_deviation(DeviationBound* deviation, double sharpening, double bound) {
    deviation_bound_ = deviation;
    shape_limits_.limit_edges(sharpening);
    touched_vertices_.assign(mesh_.points.size(), 1);
    limit_line_error(bound);
  }

  /// Moves one vertex after another to the position that minimizes the sample distances around it, within the bound.
  /// Then rebuilds the quadrics.
  void relax(DistanceNorm which);

  /// Collapses until at most `faces` triangles are left (backs of two-sided triangles count), or no collapse is
  /// allowed. A later call with fewer `faces` continues.
  void run(std::size_t faces);

  /// Quadric of a vertex: the sum of the planes of all triangles that were merged into it.
  const Quadric& quadric(std::uint32_t vertex) const { return quadrics_[vertex]; }

  /// Collapses all edges that cost at most `cost`, cheapest first. Edges of a changed vertex are deferred to the next
  /// call.
  void collapse_up_to_cost(double cost);

  /// Repairs a bad triangle: moves one of its corners or collapses one of its sides, whichever deviates least and
  /// leaves no bad triangle around it. Returns false if no such step exists.
  bool mend(std::uint32_t triangle, const std::function<bool(const TriangleCorners&)>& bad);

 private:
  using Entry = CollapseEntry;
  /// A candidate collapse.
  struct Step {
    explicit Step(const Quadric& planes) : sum(planes) {}
    bool allowed = false;
    Anchor anchor = Anchor::none;
    Vec3d target{};
    Quadric sum;
    double cost = 0;
  };

  std::vector<std::uint64_t> build_quadrics();
  void rebuild_queue();
  void limit_line_error(double bound);
  bool keeps_lines(std::uint32_t a, std::uint32_t b, const Vec3d& target) const;
  bool rebuild_when_due();
  void compact();
  void prefetch_next_entries() const;
  void prefetch_planes(std::uint32_t vertex) const {
    prefetch(&quadrics_[vertex]);
    prefetch(&quadrics_[vertex].area);
    mesh_.prefetch_vertex(vertex);
  }
  bool is_current(const Entry& entry) const {
    return entry.stamp_a == vertex_stamps_[entry.a] && entry.stamp_b == vertex_stamps_[entry.b];
  }
  void fill_queue(std::vector<std::uint64_t> all, bool only_touched = false);
  Step step_for(std::uint32_t a, std::uint32_t b) const;
  Entry entry_for(std::uint32_t a, std::uint32_t b) const;
  void make_entries(std::span<const std::uint64_t> edges, Entry* entries) const;
  void push(std::uint32_t a, std::uint32_t b);
  void queue_edges(std::uint32_t v, const std::vector<CollapseMesh::Neighbour>& others);
  bool keeps_topology(std::uint32_t a, std::uint32_t b);
  bool keeps_topology_at_hub(std::uint32_t hub, std::uint32_t b);
  bool would_duplicate_triangle(std::uint32_t a, std::uint32_t b);
  bool keeps_shapes(const Entry& entry, const Step& step);
  void collapse(std::uint32_t a, std::uint32_t b, const Step& step);
  void relax_vertex(std::uint32_t vertex, DistanceNorm which);
  bool bound_allows(std::uint32_t a, std::uint32_t b, Anchor anchor, const Vec3d& target);
  bool is_within_bound(const Entry& entry, Step& step);
  bool collapse_if_allowed(const Entry& entry);
  bool has_twins(std::uint32_t a, std::uint32_t b, const Step& step);
  std::optional<Step> twin_step(const Entry& twin);
  bool collapse_with_twins(const Entry& entry, Step& step);
  bool repair_by_moving(std::uint32_t triangle, const auto& bad);
  bool repair_by_collapse(std::uint32_t triangle, const auto& bad);

  CollapseMesh& mesh_;
  CollapseConstraint* rule_;
  Snap round_point_;
  CollapseShape shape_limits_;
  DeviationBound* deviation_bound_ = nullptr;
  /// If there is a bound, 1 for vertices whose neighbourhood has changed since the queue was filled
  std::vector<std::uint8_t> touched_vertices_;
  std::vector<Quadric> quadrics_;
  /// Quadric::off() of each vertex at its current position; empty if there is a constraint.
  std::vector<double> vertex_errors_;
  /// If there is a bound, each vertex's quadric of the lines between labels: the sum over planes through these lines,
  /// perpendicular to the surface. Empty without labels.
  std::vector<Quadric> line_quadrics_;
  double max_line_error_ = 0;
  std::size_t next_rebuild_ = 0;  ///< Triangle count at which quadrics are rebuilt next.
  std::vector<std::uint32_t> vertex_stamps_;
  std::vector<std::uint8_t> fixed_;  ///< By vertex, 1 if it may not move; if empty, all may
  /// By vertex, 1 if it lies on an open border or a border vertex was merged into it.
  std::vector<std::uint8_t> is_on_border_;
  double bad_shape_factor_;  ///< Factor on the cost of a collapse that leaves bad shapes.
  CollapseQueue queue_;
  /// Changed vertices whose edges are not queued yet.
  std::optional<std::vector<std::uint32_t>> deferred_vertices_;
  std::vector<CollapseMesh::Neighbour> near_a_, near_b_;
  std::vector<std::uint64_t> edges_;  ///< Scratch memory of queue_edges()
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> common_neighbours_;  ///< Common neighbours of an edge's two vertices
};

}  // namespace kiln
