// Height fields keep their rectangle and face up.
#pragma once

#include <cstdint>
#include <vector>

#include "simplify/collapse_constraint.h"

namespace kiln {

/// Vertices on the sides of the bounding rectangle in x and y stay on them, corners where they are. No
/// triangle turns over as seen from +z, or nearly loses its area there.
class HeightfieldConstraint : public CollapseConstraint {
 public:
  explicit HeightfieldConstraint(const CollapseMesh& mesh);
  std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                             Anchor anchor, Quadric& sum) const override;
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
             const Vec3d& target) const override;
  void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                const Vec3d& target, std::uint32_t kept) override;
  bool may_move(const CollapseMesh& mesh, std::uint32_t vertex, const Vec3d& target) const override;

 private:
  bool faces_up(const CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other,
                const Vec3d& target) const;
  std::vector<std::uint8_t> sides_;  ///< Sides of the rectangle that a vertex lies on, a bit each.
};

/// Twice the area of a triangle seen from +z over the square of its longest side there; negative where it
/// faces down, 0 for a point.
double upward(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Triangles below this may not get worse: single precision still tells them from ones without area.
inline constexpr double kLeastUpward = 1e-4;

}  // namespace kiln
