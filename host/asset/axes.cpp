#include "asset/axes.h"

namespace kiln {

AffineMap rotation_to_y_up(UpAxis up) {
  // Column k of a matrix is the image of axis k. All matrices are rotations; Z up is rotated to Y up as in Blender.
  switch (up) {
    case UpAxis::as_given:
    case UpAxis::y:
      break;
    case UpAxis::x:
      return {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    case UpAxis::z:
      return {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
    case UpAxis::minus_x:
      return {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    case UpAxis::minus_y:
      return {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
    case UpAxis::minus_z:
      return {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1};
  }
  return kIdentityMap;
}

WorldFrame world_frame(const LoadMeshOptions& options,
                       const std::optional<AffineMap>& axis_rotation, double metres_per_unit) {
  AffineMap map = axis_rotation.value_or(kIdentityMap);
  double metres = metres_per_unit;
  if (options.up != UpAxis::as_given && (options.override_up || !axis_rotation))
    map = rotation_to_y_up(options.up);
  if (options.metres > 0 && (options.override_unit || metres_per_unit == 0))
    metres = options.metres;
  if (metres > 0) {
    for (std::size_t i = 0; i < 12; ++i) map[i] *= metres;
  }
  WorldFrame frame;
  frame.metres = metres > 0 ? 1 : 0;
  if (map != kIdentityMap) frame.map = map;
  return frame;
}

}  // namespace kiln
