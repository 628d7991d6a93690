// Constraints that edge collapses obey in addition to the limits of triangle shapes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/quadric.h"
#include "simplify/collapse_mesh.h"

namespace kiln {

/// Which vertex of an edge may not move.
enum class Anchor : std::uint8_t { none, first, second };

/// Interface that EdgeCollapser calls before and at each collapse. place() must be safe to call from several threads.
class CollapseConstraint {
 public:
  virtual ~CollapseConstraint() = default;

  /// Adds planes of the constraint to the quadrics of vertices. Called before the first collapse.
  virtual void add_planes(const CollapseMesh&, std::vector<Quadric>&) const {}

  /// The position of the merged vertex that the constraint allows, close to the minimum of `sum`; nullopt if the edge
  /// may not collapse. Adds the constraint's own cost (such as the UV error) to `sum`.
  virtual std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                     Anchor anchor, Quadric& sum) const = 0;

  /// True if repairs may use every position that keeps() allows; false if only the one from place().
  virtual bool allows_any_position() const { return false; }

  /// True if the collapse satisfies the constraint. Called for few edges, just before they collapse.
  virtual bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                     const Vec3d& target) const = 0;

  /// Finds the collapses that must happen together with the given one: those of its UV copies, which must stay copies.
  /// keeps() has allowed the given collapse before. Each edge that is found starts with the vertex that corresponds to
  /// `a`. Until end_twins() is called, the constraint treats collapses of these edges as parts of the given collapse.
  /// \returns false if a copy cannot collapse, which rejects all of them
  virtual bool find_twins(const CollapseMesh&, std::uint32_t, std::uint32_t, Anchor, const Vec3d&,
                          std::vector<std::array<std::uint32_t, 2>>&) {
    return true;
  }
  virtual void end_twins() {}

  /// Notifies the constraint of a collapse: both vertices of the edge have become `kept`, at the position `target`.
  virtual void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                        const Vec3d& target, std::uint32_t kept) = 0;

  /// True if the constraint allows the vertex to move to `target` without a collapse.
  virtual bool may_move(const CollapseMesh& mesh, std::uint32_t vertex,
                        const Vec3d& target) const = 0;
};

}  // namespace kiln
