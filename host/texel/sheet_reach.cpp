#include "texel/sheet_reach.h"

#include <algorithm>
#include <span>

#include "mesh/open_sheets.h"

namespace kiln {

SheetReach::SheetReach(const LowSurface& surface) : of_triangle_(sheet_sizes(surface)) {
  for (const float reach : of_triangle_) farthest_ = std::max(farthest_, reach);
}

void SheetReach::apply(cl::Context& context, TexelBand& band) const {
  if (!(farthest_ > 0) || band.sample_count == 0) return;
  std::vector<std::uint32_t> triangle(band.sample_count);
  band.triangle.read(context, triangle);
  std::vector<float> reach(triangle.size());
  for (std::size_t i = 0; i < reach.size(); ++i) reach[i] = of_triangle_[triangle[i]];
  band.points.write(context, std::span<const float>(reach), std::size_t{6} * band.capacity);
}

}  // namespace kiln
