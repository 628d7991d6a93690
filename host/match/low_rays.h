// How far rays may go before they meet the light mesh again.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

/// The light mesh as rays meet it.
class LowRays {
 public:
  LowRays(cl::Context& context, const LowSurface& surface);

  /// How far out each sample may look: up to `farthest`, or to the light mesh; 0 within another part of it.
  std::vector<float> limits(cl::Context& context, const TexelBand& samples, float farthest) const;

  /// How far points are from the light mesh, up to `farthest`. \param points  seven planes, as TexelBand's
  std::vector<float> distances(cl::Context& context, const std::vector<float>& points,
                               float farthest) const;

 private:
  std::vector<Vec3d> normals_;
  std::shared_ptr<const Tree> tree_;
  std::optional<RayCaster> rays_;
};

}  // namespace kiln
