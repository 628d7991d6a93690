// Starts of samples' rays as a cage mesh says.
#pragma once

#include <memory>
#include <vector>

#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Writes the reach of samples (TexelBand::points, the last plane): by the outer of two shells, or as far as a
/// hull lies along their direction. Does nothing without such a cage.
class CageReach {
 public:
  CageReach() = default;
  /// \param surface  of a hull, it is told how long rays are: LowSurface::cage_length
  /// \throws Error(input) where a hull does not enclose the low poly
  CageReach(cl::Context& context, const Frame& frame, LowSurface& surface);

  bool writes() const { return writes_; }
  /// Writes the reach of a band that was just sampled and turned. \throws Error(input) where a hull does not enclose it
  void apply(cl::Context& context, TexelBand& band) const;
  /// World units; none without a cage mesh.
  std::optional<CageReport> report(const LowSurface& surface) const;

 private:
  std::vector<float> to_hull(cl::Context& context, const cl::Array<float>& points,
                             std::uint32_t count, std::uint32_t capacity) const;

  bool writes_ = false;
  Frame frame_;
  cl::Array<float> outer_;  ///< See LowSurface::shell
  std::shared_ptr<const CageHull> hull_;
  std::unique_ptr<RayCaster> rays_;
  std::vector<float> ways_;  ///< To a hull, from places all over the low poly
};

}  // namespace kiln
