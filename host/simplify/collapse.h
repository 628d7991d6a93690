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

/// Reduces a triangle mesh step by step. The edge whose collapse costs least goes first, to the point
/// that its quadric calls best (Garland and Heckbert 1997, "Surface Simplification Using Quadric Error
/// Metrics"). Planes hold open borders in place (section 6). Without a rule, a step costs what
/// it adds to distances, not to their squares. Quadrics are made anew whenever half of the triangles are gone then.
///
/// Kept at every step: the topology (link condition; borders do not pinch, components do not vanish).
/// Triangles do not turn over, fold onto a neighbour or lose their area. Unless that costs several times
/// as much, they do not become slivers or turn far either.
/// Edges with any number of triangles are allowed. Deterministic: ties go to the lower vertices.
/// Coordinates should be of about unit size; arithmetic is in double precision.
/// Cost: about 5 microseconds a collapse, n log n in all: a vertex of very many triangles stays where it
/// is, and its neighbours come to it.
class EdgeCollapser {
 public:
  /// To where the mesh's numbers can hold a point.
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// Triangles must have three different vertices, and no twin of the same orientation.
  /// \param mesh  must outlive this. As it gets smaller, what is left of it gets new numbers (CollapseMesh::compact()),
  ///              unless there is a rule or a bound
  /// \param rule  what must be kept beside the shape; may be null; must outlive this
  /// \param fixed  by vertex, whether no edge there may go; empty: all may
  explicit EdgeCollapser(CollapseMesh& mesh, CollapseConstraint* rule = nullptr, Snap snap = {},
                         std::vector<std::uint8_t> fixed = {});

  /// From now on no step that this refuses is taken. It must have been made of the mesh as it is, and outlive this.
  /// \param sharpening  how much sharper sharp edges may become (cosine); none may become sharp
  /// \param bound       of lines between labels: how far they may be from where they are now, root mean square
  void limit_deviation(DeviationBound* deviation, double sharpening, double bound) {
    deviation_bound_ = deviation;
    shape_.limit_edges(sharpening);
    touched_.assign(mesh_.points.size(), 1);
    bound_lines(bound);
  }

  /// Moves vertices, one after another, to where the distances around them are less and the bound allows them. Makes
  /// quadrics anew.
  void relax(Distances which);

  /// Collapses until at most `faces` triangles are left (backs of two-sided ones count), or nothing more is allowed.
  /// May be called again with lower `faces`, and goes on where it stopped.
  void run(std::size_t faces);

  /// The planes that a vertex stands for.
  const Quadric& quadric(std::uint32_t vertex) const { return quadrics_[vertex]; }

  /// Takes collapses that cost at most so much, in order. Edges of a vertex that changes wait for the next call.
  void run_cheap(double cost);

  /// Moves a corner of a bad triangle or collapses one of its sides, whatever strays least. No triangle
  /// around is bad then. False where there is no such way.
  bool mend(std::uint32_t triangle, const std::function<bool(const TriangleCorners&)>& bad);

 private:
  using Entry = CollapseEntry;
  /// A collapse as it would be taken.
  struct Step {
    explicit Step(const Quadric& planes) : sum(planes) {}
    bool allowed = false;
    Anchor anchor = Anchor::none;
    Vec3d target;
    Quadric sum;
    double cost = 0;
  };

  std::vector<std::uint64_t> build_quadrics();
  void renew_queue();
  void bound_lines(double bound);
  bool keeps_lines(std::uint32_t a, std::uint32_t b, const Vec3d& target) const;
  bool renew();
  void compact();
  void fetch_ahead() const;
  void fetch_planes(std::uint32_t vertex) const {
    prefetch(&quadrics_[vertex]);
    prefetch(&quadrics_[vertex].area);
    mesh_.fetch(vertex);
  }
  bool is_current(const Entry& entry) const {
    return entry.stamp_a == stamps_[entry.a] && entry.stamp_b == stamps_[entry.b];
  }
  void fill_queue(std::vector<std::uint64_t> all, bool only_touched = false);
  Step step_for(std::uint32_t a, std::uint32_t b) const;
  Entry entry_for(std::uint32_t a, std::uint32_t b) const;
  void make_entries(std::span<const std::uint64_t> edges, Entry* entries) const;
  void push(std::uint32_t a, std::uint32_t b);
  void push_all(std::uint32_t v, const std::vector<CollapseMesh::Neighbour>& others);
  bool keeps_topology(std::uint32_t a, std::uint32_t b);
  bool keeps_topology_at_hub(std::uint32_t hub, std::uint32_t b);
  bool lies_on_another(std::uint32_t a, std::uint32_t b);
  bool keeps_shapes(const Entry& entry, const Step& step);
  void collapse(std::uint32_t a, std::uint32_t b, const Step& step);
  void relax_at(std::uint32_t vertex, Distances which);
  bool bound_keeps(std::uint32_t a, std::uint32_t b, Anchor anchor, const Vec3d& target);
  bool is_within_bound(const Entry& entry, Step& step);
  bool take(const Entry& entry);
  bool has_twins(std::uint32_t a, std::uint32_t b, const Step& step);
  std::optional<Step> step_of_twin(const Entry& twin);
  bool take_with_twins(const Entry& entry, Step& step);
  bool mend_by_moving(std::uint32_t triangle, const auto& bad);
  bool mend_by_collapse(std::uint32_t triangle, const auto& bad);

  CollapseMesh& mesh_;
  CollapseConstraint* rule_;
  Snap snap_;
  CollapseShape shape_;
  DeviationBound* deviation_bound_ = nullptr;
  std::vector<std::uint8_t>
      touched_;  ///< Under a bound: whether what is around changed since the queue was filled.
  std::vector<Quadric> quadrics_;
  std::vector<double> off_;  ///< Quadric::off() of each vertex where it is, without a rule.
  std::vector<Quadric>
      lines_;  ///< Under a bound: planes on lines between labels; empty without any.
  double lines_bound_ = 0;
  std::size_t next_renewal_ = 0;  ///< Triangle count at which quadrics are rebuilt next.
  std::vector<std::uint32_t> stamps_;
  std::vector<std::uint8_t> fixed_;   ///< May be empty.
  std::vector<std::uint8_t> border_;  ///< True if a vertex came from one on an open border.
  double penalty_;  ///< By how many times a step that leaves bad shapes must be cheaper.
  CollapseQueue queue_;
  std::optional<std::vector<std::uint32_t>> deferred_;  ///< Changed vertices whose edges wait.
  std::vector<CollapseMesh::Neighbour> near_a_, near_b_;
  std::vector<std::uint64_t> edges_;  ///< Scratch of push_all()
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> common_;  ///< Vertices next to both ends of an edge.
};

}  // namespace kiln
