// Limits of rays, which may meet the low poly again.
#pragma once

#include <memory>
#include <vector>

#include "accel/low_tree.h"
#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

/// The low poly as rays meet it.
class LowRays {
 public:
  LowRays(cl::Context& context, const LowSurface& surface);

  /// Writes how far out each sample may look: up to `farthest`, or to the low poly; 0 within another part of it.
  /// \param first  where in `limits` it begins; that may be a plane of the samples' points
  void limits(cl::Context& context, const TexelBand& samples, float farthest,
              const cl::Array<float>& limits, std::uint32_t first) const;

  /// Distances of points from the low poly, up to `farthest`. \param points  seven planes, as TexelBand's
  std::vector<float> distances(cl::Context& context, const std::vector<float>& points,
                               float farthest) const;

 private:
  std::shared_ptr<const LowTree> low_;
  RayCaster rays_;
  cl::Array<float> normals_;  ///< Three a triangle
};

}  // namespace kiln
