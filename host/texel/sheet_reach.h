// Search distance of samples on open sheets of a low poly that have no surface nearby.
#pragma once

#include <vector>

#include "cl/context.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Writes the search distance of samples (TexelBand::points, the last plane): that of their open sheet
/// (mesh/open_sheets.h), or 0 for samples on no sheet. Does nothing for low polys without open sheets.
class SheetReach {
 public:
  SheetReach() = default;
  explicit SheetReach(const LowSurface& surface);

  /// Largest search distance in frame units; 0: there are no sheets
  float farthest() const { return farthest_; }
  /// Writes the search distances of a newly sampled band.
  void apply(cl::Context& context, TexelBand& band) const;

 private:
  float farthest_ = 0;
  std::vector<float> of_triangle_;
};

}  // namespace kiln
