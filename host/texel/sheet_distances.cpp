#include "texel/sheet_distances.h"

#include <algorithm>
#include <span>

#include "mesh/open_sheets.h"

namespace kiln {

SheetDistances::SheetDistances(const LowSurface& surface)
    : triangle_search_distances_(sheet_sizes(surface)) {
  for (const float search_distance : triangle_search_distances_)
    max_search_distance_ = std::max(max_search_distance_, search_distance);
}

void SheetDistances::write_search_distances(cl::Context& context, TexelBand& band) const {
  if (!(max_search_distance_ > 0) || band.sample_count == 0) return;
  std::vector<std::uint32_t> triangle(band.sample_count);
  band.triangle.read(context, triangle);
  std::vector<float> search_distance(triangle.size());
  for (std::size_t i = 0; i < search_distance.size(); ++i)
    search_distance[i] = triangle_search_distances_[triangle[i]];
  band.points.write(context, std::span<const float>(search_distance),
                    std::size_t{6} * band.capacity);
}

}  // namespace kiln
