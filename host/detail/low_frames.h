// Transforms vectors to the space of the bake's normals (EncodingOptions::space).
#pragma once

#include <vector>

#include "detail/point_map.h"
#include "mesh/kernels_shared.h"

namespace kiln {

/// Computes the components of a vector in the low poly's frame at a point. The frame is that of
/// kernels/detail/detail.clh, but is not normalized: the sum of the components times the frame's
/// vectors is exactly the vector.
class LowFrames {
 public:
  explicit LowFrames(const MapRequest& request);
  Vec3d transform_to_space(const HighPoint& point, const Vec3d& vector) const;

 private:
  Vec3d compute_components(const HighPoint& point, const Vec3d& vector) const;

  std::vector<kiln_low_shading> shading_;
  NormalMapSpace space_;
  // True if the bitangent is computed at corners and interpolated, instead of computed at each
  // point
  bool interpolates_bitangent_;
  double y_scale_;
};

}  // namespace kiln
