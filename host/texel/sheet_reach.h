// Second search distance, for samples that find no point nearby and lie on open sheets of the low poly, such as
// cards for leaves.
#pragma once

#include <vector>

#include "cl/context.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Writes search distances for samples (TexelBand::points, the last plane): the size of the sample's open sheet
/// (mesh/open_sheets.h), or 0 for a sample that is on no such sheet. Does nothing for low polys without open sheets.
class SheetReach {
 public:
  SheetReach() = default;
  explicit SheetReach(const LowSurface& surface);

  /// Largest search distance in frame units; 0 if the low poly has no open sheets
  float max_search_distance() const { return max_search_distance_; }
  /// Writes the search distances of a newly sampled band.
  void write_search_distances(cl::Context& context, TexelBand& band) const;

 private:
  float max_search_distance_ = 0;
  std::vector<float> triangle_search_distances_;
};

}  // namespace kiln
