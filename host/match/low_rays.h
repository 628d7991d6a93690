// Limits searches along rays to where the rays meet the low poly's own surface.
#pragma once

#include <memory>
#include <vector>

#include "accel/low_tree.h"
#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

/// Ray casting against the low poly.
class LowRays {
 public:
  LowRays(cl::Context& context, const LowSurface& surface);

  /// Writes the search limit of each sample: `farthest`, or the distance to the low poly's next front face if
  /// that is nearer; 0 if the sample is inside another part of the low poly.
  /// \param first  start index in `limits`, which may be a plane of the samples' points
  void write_search_limits(cl::Context& context, const TexelBand& samples, float farthest,
                           const cl::Array<float>& limits, std::uint32_t first) const;

  /// Distances of points from the low poly, up to `farthest`. \param points seven planes, as
  /// TexelBand::points
  std::vector<float> distances(cl::Context& context, const std::vector<float>& points,
                               float farthest) const;

 private:
  std::shared_ptr<const LowTree> low_;
  RayCaster rays_;
  cl::Array<float> triangle_normals_;  ///< Unit normals, three per triangle
};

}  // namespace kiln
