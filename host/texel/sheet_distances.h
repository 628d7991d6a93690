// A second search distance for samples on open sheets of the low poly, such as cards for leaves.
#pragma once

#include <vector>

#include "cl/context.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Second search distances of samples that find no point nearby and lie on open sheets of the low
/// poly (mesh/open_sheets.h): the size of the sheet, or 0 for samples on no open sheet. They are
/// stored in the last plane of TexelBand::points; a low poly without open sheets has none.
class SheetDistances {
 public:
  SheetDistances() = default;
  explicit SheetDistances(const LowSurface& surface);

  /// Largest search distance in frame units; 0 if the low poly has no open sheets
  float max_search_distance() const { return max_search_distance_; }
  /// Writes the search distances of a newly sampled band.
  void write_search_distances(cl::Context& context, TexelBand& band) const;

 private:
  float max_search_distance_ = 0;
  std::vector<float> triangle_search_distances_;
};

}  // namespace kiln
