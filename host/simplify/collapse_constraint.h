// Constraints on edge collapses in addition to triangle shapes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/quadric.h"
#include "simplify/collapse_mesh.h"

namespace kiln {

/// The vertex of an edge that may not move.
enum class Anchor : std::uint8_t { none, first, second };

/// Interface that EdgeCollapser calls before and at each collapse. place() must be safe to call from several threads.
class CollapseConstraint {
 public:
  virtual ~CollapseConstraint() = default;

  /// Adds the constraint's planes to the quadrics of its vertices, before the first collapse.
  virtual void add_planes(const CollapseMesh&, std::vector<Quadric>&) const {}

  /// Allowed position of the merged vertex, close to the minimum of `sum`; nullopt if the edge may not collapse. Adds
  /// the cost of the constraint itself (such as UV error) to `sum`.
  virtual std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                     Anchor anchor, Quadric& sum) const = 0;

  /// True if repairs may use every position that keeps() allows, not only the one from place().
  virtual bool any_place() const { return false; }

  /// True if the collapse keeps the constraint. Called for few edges, just before the collapse.
  virtual bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                     const Vec3d& target) const = 0;

  /// Finds collapses that must happen together with this one: those of its UV copies, which must stay copies. keeps()
  /// has allowed the given collapse. Each found edge starts with the vertex that corresponds to `a`. Until
  /// end_twins(), the constraint treats collapses of the found edges as parts of the given one.
  /// \returns false if a copy cannot collapse, which rejects the whole group
  virtual bool find_twins(const CollapseMesh&, std::uint32_t, std::uint32_t, Anchor, const Vec3d&,
                          std::vector<std::array<std::uint32_t, 2>>&) {
    return true;
  }
  virtual void end_twins() {}

  /// Notifies the constraint of the collapse: both vertices of the edge become `kept`, at `target`.
  virtual void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                        const Vec3d& target, std::uint32_t kept) = 0;

  /// True if the constraint allows the vertex at `target`.
  virtual bool may_move(const CollapseMesh& mesh, std::uint32_t vertex,
                        const Vec3d& target) const = 0;
};

}  // namespace kiln
