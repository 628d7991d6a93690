// The working frame: all device work happens in a box of about unit size around the origin.
#pragma once

#include <array>
#include <vector>

#include "kiln/bake.h"
#include "kiln/mesh.h"

namespace kiln {

/// Maps world coordinates to the frame and back: frame = (world - center) * scale. The scale is a
/// power of two, so that scaling is exact; the high poly's bounding box has a diagonal in (0.5, 1]
/// there. Scenes of 1e-30 or 1e30 units, or far from the origin, thus meet the kernels alike.
struct Frame {
  std::array<double, 3> center{};
  double scale = 1;
  double diagonal = 1;  ///< Of the high poly's bounding box, in world units.

  /// From the finite vertices that triangles use. \throws Error(input) where there are none or all
  /// coincide.
  static Frame of(const Mesh& mesh);
  /// From a box that the mesh lies in, as it moves. \throws Error(usage) for one without size
  static Frame of(const Mesh& mesh, const Bounds& bounds);

  Vec3 to_frame(const Mesh& mesh, std::size_t vertex) const;
  std::vector<Vec3> to_frame(const Mesh& mesh) const;
};

}  // namespace kiln
