// Edge collapse by quadric errors.
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

/// Reduces a triangle mesh by edge collapses, the cheapest first. The merged vertex is placed at the minimum of its
/// quadric (Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics"). Planes through open
/// borders, perpendicular to the surface, hold the borders in place (section 6 of that paper). Without a constraint,
/// the cost is the increase of the distance to the planes, not of the squared distance. Quadrics are rebuilt whenever
/// the number of triangles has halved.
///
/// Each collapse keeps the topology: the link condition holds, borders do not pinch, components do not vanish.
/// Triangles do not flip, fold onto a neighbour or lose their area. They only become slivers or turn by a large angle
/// if every other collapse costs several times as much. Edges may have any number of triangles. Deterministic: among
/// equal costs, the edge with the lower vertex indices comes first. Coordinates should be of about unit size;
/// arithmetic is in double precision. Cost: about 5 microseconds per collapse, O(n log n) in all. A vertex of more than
/// 256 triangles (a hub) does not move; its neighbours collapse into it.
class EdgeCollapser {
 public:
  /// Rounds a point to a position that the caller's mesh can store.
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// Triangles must have three different vertices, and no two triangles may have the same vertices in the same
  /// orientation.
  /// \param mesh  must outlive this object. Its triangles and vertices are renumbered as it shrinks
  ///   (CollapseMesh::compact()), unless there is a constraint or a bound
  /// \param rule  constraint in addition to the limits of triangle shapes; may be null; must outlive this object
  /// \param fixed  for each vertex, 1 if its edges may not collapse; if empty, all edges may
  explicit EdgeCollapser(CollapseMesh& mesh, CollapseConstraint* rule = nullptr, Snap snap = {},
                         std::vector<std::uint8_t> fixed = {});

  /// From now on, rejects collapses that `deviation` refuses. The bound must have been built from the mesh in its
  /// present state, and must outlive this object.
  /// \param sharpening  how far the cosine at an edge that is sharp already may decrease; no other edge may become
  ///   sharp
  /// \param bound       largest root-mean-square distance by which lines between labels may leave their present
  ///   position
  void limit_deviation(DeviationBound* deviation, double sharpening, double bound) {
    deviation_bound_ = deviation;
    shape_limits_.limit_sharpening(sharpening);
    touched_vertices_.assign(mesh_.points.size(), 1);
    limit_line_error(bound);
  }

  /// Moves one vertex after another to the position, within the bound, that minimizes the sample distances around it.
  /// Then rebuilds the quadrics.
  void relax(DistanceNorm which);

  /// Collapses edges until at most `faces` triangles are left (the backs of two-sided triangles count, too), or no
  /// collapse is allowed. A later call with fewer `faces` continues from there.
  void run(std::size_t faces);

  /// Quadric of a vertex: the sum over the planes of all triangles that were merged into the vertex.
  const Quadric& quadric(std::uint32_t vertex) const { return quadrics_[vertex]; }

  /// Collapses all edges that cost at most `cost`, the cheapest first. The edges of vertices that change meanwhile wait
  /// for the next call.
  void collapse_up_to_cost(double cost);

  /// Repairs a bad triangle: moves one of its corners, or collapses one of its sides. Of the steps that leave no bad
  /// triangle around, it takes the one with the smallest deviation. Returns false if there is no such step.
  bool repair_triangle(std::uint32_t triangle,
                       const std::function<bool(const TriangleCorners&)>& bad);

 private:
  using Entry = CollapseEntry;
  /// A possible collapse of an edge: position, cost, and which vertex must stay.
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
  /// If there is a bound: 1 for each vertex whose surroundings have changed since the queue was filled
  std::vector<std::uint8_t> touched_vertices_;
  std::vector<Quadric> quadrics_;
  /// Quadric::weighted_distance() of each vertex at its current position; empty if there is a constraint
  std::vector<double> vertex_errors_;
  /// If there is a bound and the mesh has labels: for each vertex, the quadric of the lines between labels that met
  /// there when the bound was set. It sums the planes that contain these lines and stand perpendicular to the surface.
  /// Otherwise empty.
  std::vector<Quadric> line_quadrics_;
  double max_line_error_ = 0;
  std::size_t next_rebuild_ = 0;  ///< Number of triangles at which quadrics are rebuilt next
  std::vector<std::uint32_t> vertex_stamps_;
  std::vector<std::uint8_t> fixed_;  ///< For each vertex, 1 if it may not move; if empty, all may
  /// For each vertex, 1 if it lies on an open border, or if a border vertex was merged into it
  std::vector<std::uint8_t> is_on_border_;
  /// Factor on the cost of a collapse that leaves badly shaped triangles
  double bad_shape_factor_;
  CollapseQueue queue_;
  /// Changed vertices whose edges are not queued yet; nullopt outside of collapse_up_to_cost()
  std::optional<std::vector<std::uint32_t>> deferred_vertices_;
  std::vector<CollapseMesh::Neighbour> neighbours_of_a_, neighbours_of_b_;
  std::vector<std::uint64_t> edges_;  ///< Scratch memory of queue_edges()
  std::vector<Entry> entries_;
  /// Scratch memory: neighbours that an edge's two vertices share
  std::vector<std::uint32_t> common_neighbours_;
};

}  // namespace kiln
