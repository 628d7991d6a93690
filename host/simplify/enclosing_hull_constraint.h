// Hulls: no step takes anything away from what the surface encloses.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "simplify/collapse_constraint.h"

namespace kiln {

/// A half-space: normal . p >= offset.
struct HalfSpace {
  Vec3d normal;  ///< Unit length
  double offset = 0;
};

/// The minimum of a quadric within all of the half-spaces, each moved out by `slack`; nothing if they have no
/// point in common. Near the middle of a and b where the quadric leaves a direction free.
std::optional<Vec3d> least_within(const Quadric& quadric, const Vec3d& a, const Vec3d& b,
                                  std::span<const HalfSpace> spaces, double slack);

/// After Sander, Gu, Gortler, Hoppe and Snyder 2000 ("Silhouette Clipping", section 4.1): a vertex comes to lie
/// outside of, or on, the planes of all triangles around the edge. So each step only adds tetrahedra to the solid.
/// The winding number of the surface around any point never falls, also where the surface crosses itself. Vertices of
/// open borders lie beyond the planes that stand on the border's edges, too: the border moves outwards alone. Where
/// triangles disagree on what is outside, vertices stay in place.
class EnclosingHullConstraint : public CollapseConstraint {
 public:
  using Snap = std::function<Vec3d(const Vec3d&)>;

  /// \param snap   to where the mesh's numbers can hold a point
  /// \param slack  how far that moves a point, at most
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
  std::vector<std::uint8_t> fixed_;  ///< Vertices where triangles disagree on what is outside
  std::vector<std::uint8_t> open_;   ///< Vertices on open borders
};

}  // namespace kiln
