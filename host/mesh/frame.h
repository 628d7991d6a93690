// The working frame in which all device work is done: a box of about unit size around the origin.
#pragma once

#include <array>
#include <vector>

#include "kiln/mesh.h"
#include "kiln/source.h"

namespace kiln {

/// Maps world coordinates to the frame and back: frame = (world - center) * scale. The scale is a power of two, so that
/// scaling is exact. In the frame, the high poly's bounding box has a diagonal in (0.5, 1]. Extreme outliers do not
/// count (see bulk_bounds()), since they would leave no precision for other vertices. So kernels get input of the same
/// size for scenes of 1e-30 or 1e30 units, or far from the origin.
struct Frame {
  std::array<double, 3> center{};
  double scale = 1;
  double diagonal = 1;  ///< Diagonal of the high poly's box in world units

  /// The frame of a mesh's triangles that have an area, see bulk_bounds().
  /// \throws Error(input) if there are none
  static Frame of(const Mesh& mesh);
  /// The frame of a box that contains the mesh throughout its motion.
  /// \throws Error(usage) if the box has no size
  static Frame of(const Mesh& mesh, const Bounds& bounds);

  Vec3 to_frame(const Mesh& mesh, std::size_t vertex) const;
  /// \param origin  origin of the mesh, see Mesh::origin
  Vec3 to_frame(const Vec3& position, const std::array<double, 3>& origin) const;
  /// The inverse of to_frame() for meshes whose origin is 0, up to rounding to single precision.
  Vec3 to_world(const Vec3& in_frame) const;
  /// All vertices in the frame. A vertex beyond `reach` that only degenerate triangles use becomes NaN, since rounding
  /// could turn these into large triangles.
  /// \param reach  largest coordinate; 0.5 for the high poly's box
  std::vector<Vec3> to_frame_within(const Mesh& mesh, double reach) const;
  std::vector<Vec3> to_frame(const Mesh& mesh) const { return to_frame_within(mesh, kReach); }
  /// The value of `reach` for a mesh that does not move: half of its box, and a margin for rounding.
  static constexpr double kReach = 0.500001;
};

/// An origin relative to which single precision can hold a mesh's coordinates. If the centre of the mesh's box is
/// farther from 0 than 16 diagonals, it is a point near the centre (rounded to a power of two above the diagonal); else
/// it is 0. Similar boxes give the same origin, and subtracting it from a position is exact in double precision.
std::array<double, 3> local_origin(const std::array<double, 3>& center, double diagonal);

}  // namespace kiln
