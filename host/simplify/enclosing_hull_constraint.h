// Constraint for hulls: rejects collapses that would cut something off the enclosed solid.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "simplify/collapse_constraint.h"

namespace kiln {

/// The half-space of all points p with normal . p >= offset.
struct HalfSpace {
  Vec3d normal{};  ///< Unit normal
  double offset = 0;
};

/// The minimum of a quadric within the intersection of half-spaces, each of which is moved outwards by `slack`; nullopt
/// if the intersection is empty. Along directions in which the quadric is constant, the result is near the middle of a
/// and b.
std::optional<Vec3d> minimum_within(const Quadric& quadric, const Vec3d& a, const Vec3d& b,
                                    std::span<const HalfSpace> spaces, double slack);

/// Keeps the simplified surface outside of the original one, after Sander, Gu, Gortler, Hoppe and Snyder 2000
/// ("Silhouette Clipping", section 4.1): the merged vertex lies on or outside the planes of all triangles around the
/// edge, so each collapse only adds tetrahedra to the solid. The winding number of the surface around any point never
/// falls, even if the surface intersects itself. At an open border, vertices also stay outside the planes through the
/// border's edges that stand perpendicular to the surface, so borders only move outwards. Vertices whose triangles are
/// oriented inconsistently do not move.
class EnclosingHullConstraint : public CollapseConstraint {
 public:
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// \param snap   rounds a point to a position that the caller's mesh can store
  /// \param slack  largest distance by which `snap` moves a point
  EnclosingHullConstraint(const CollapseMesh& mesh, Snap snap, double slack);

  std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                             Anchor anchor, Quadric& sum) const override;
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
             const Vec3d& target) const override;
  void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                const Vec3d& target, std::uint32_t kept) override;
  bool may_move(const CollapseMesh& mesh, std::uint32_t vertex, const Vec3d& target) const override;

 private:
  bool is_outside(const CollapseMesh& mesh, std::uint32_t vertex, const Vec3d& target) const;

  Snap snap_;
  double slack_;
  /// For each vertex, 1 if its triangles are oriented inconsistently
  std::vector<std::uint8_t> fixed_;
  /// For each vertex, 1 if it lies on an open border
  std::vector<std::uint8_t> is_on_open_border_;
};

}  // namespace kiln
