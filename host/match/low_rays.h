// How far rays may go before they meet the low poly again.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

/// The low poly as rays meet it.
class LowRays {
 public:
  LowRays(cl::Context& context, const LowSurface& surface);

  /// How far out each sample may look: up to `farthest`, or to the low poly; 0 within another part of it.
  std::vector<float> limits(cl::Context& context, const TexelBand& samples, float farthest) const;

  /// How far points are from the low poly, up to `farthest`. \param points  seven planes, as TexelBand's
  std::vector<float> distances(cl::Context& context, const std::vector<float>& points,
                               float farthest) const;

 private:
  std::vector<Vec3d> normals_;
  std::shared_ptr<const Tree> tree_;
  std::optional<RayCaster> rays_;
};

}  // namespace kiln
