// The working frame: all device work happens in a box of about unit size around the origin.
#pragma once

#include <array>
#include <vector>

#include "kiln/bake.h"
#include "kiln/mesh.h"

namespace kiln {

/// Maps world coordinates to the frame and back: frame = (world - center) * scale. The scale is a
/// power of two, so that scaling is exact; the high poly's bounding box has a diagonal in (0.5, 1]
/// there, but for vertices that lie absurdly far out, see bulk_bounds(): they would leave the others no digits. Scenes of 1e-30 or 1e30 units, or far from the origin, thus meet the kernels alike.
struct Frame {
  std::array<double, 3> center{};
  double scale = 1;
  double diagonal = 1;  ///< Diagonal of that box, world units.

  /// From the triangles with area, see bulk_bounds(). \throws Error(input) where there are none
  static Frame of(const Mesh& mesh);
  /// From a box that the mesh lies in, as it moves. \throws Error(usage) for one without size
  static Frame of(const Mesh& mesh, const Bounds& bounds);

  Vec3 to_frame(const Mesh& mesh, std::size_t vertex) const;
  /// All vertices, but NaN for those that no triangle with area uses and that lie beyond `reach`: rounded there, a
  /// triangle without area could get one, and be a large one. \param reach  0.5: all of the high poly's box
  std::vector<Vec3> to_frame_within(const Mesh& mesh, double reach) const;
  std::vector<Vec3> to_frame(const Mesh& mesh) const { return to_frame_within(mesh, 0.500001); }
};

/// Origin of a mesh's coordinates, such that single precision holds them: near the middle of its box where
/// that lies farther from 0 than 16 diagonals, rounded to a power of two above the diagonal; else 0. Nearly the same
/// box gives the same origin, and a position minus it is exact in double.
std::array<double, 3> local_origin(const std::array<double, 3>& center, double diagonal);

}  // namespace kiln
