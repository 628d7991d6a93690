// Constraints on edge collapses besides the surface's shape.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/quadric.h"
#include "simplify/collapse_mesh.h"

namespace kiln {

/// The end of an edge that may not move.
enum class Anchor : std::uint8_t { none, first, second };

/// Asked by EdgeCollapser before every step, and told of it. place() must allow calls from several threads.
class CollapseConstraint {
 public:
  virtual ~CollapseConstraint() = default;

  /// Adds planes that hold what must stay in place, at the start.
  virtual void add_planes(const CollapseMesh&, std::vector<Quadric>&) const {}

  /// Allowed position of the merged vertex, near the best point by `sum`; nothing: the edge must stay. The cost
  /// beyond the shape is added to `sum`.
  virtual std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                     Anchor anchor, Quadric& sum) const = 0;

  /// True if a step that mends may go anywhere that keeps() allows, not to place()'s alone.
  virtual bool any_place() const { return false; }

  /// True if the step leaves what must stay. Called for few edges, just before the step.
  virtual bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                     const Vec3d& target) const = 0;

  /// Steps that must be taken with this one, which keeps() allows: of copies, which stay copies. Each edge has the end
  /// that corresponds to `a` first. Until end_twins() the rule takes steps of these edges as parts of it.
  /// \returns false where one of them cannot be, so that this one must not
  virtual bool find_twins(const CollapseMesh&, std::uint32_t, std::uint32_t, Anchor, const Vec3d&,
                          std::vector<std::array<std::uint32_t, 2>>&) {
    return true;
  }
  virtual void end_twins() {}

  /// The step is about to be taken: both ends become `kept`, at `target`.
  virtual void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                        const Vec3d& target, std::uint32_t kept) = 0;

  /// True if a vertex may be moved to another place.
  virtual bool may_move(const CollapseMesh& mesh, std::uint32_t vertex,
                        const Vec3d& target) const = 0;
};

}  // namespace kiln
