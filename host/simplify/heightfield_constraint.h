// Constraint for height fields: keeps the outline a rectangle, and all triangles facing up.
#pragma once

#include <cstdint>
#include <vector>

#include "simplify/collapse_constraint.h"

namespace kiln {

/// Vertices on the sides of the bounding rectangle (in x and y) stay on these sides; the rectangle's corners do not
/// move. Seen from +z, no triangle flips or nearly loses its area.
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
  /// For each vertex, one bit for each side of the rectangle on which it lies
  std::vector<std::uint8_t> rectangle_sides_;
};

/// Shape of a triangle seen from +z: twice its projected area, divided by the square of its longest projected side.
/// Negative if it faces down; 0 if it degenerates to a point.
double upward_quality(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Minimum of upward_quality(). Triangles below it may not get worse. Triangles at this limit are still safely
/// non-degenerate in single precision.
inline constexpr double kMinUpwardQuality = 1e-4;

}  // namespace kiln
