// The low poly laid out by few large charts, and its map.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "kiln/unwrap.h"
#include "unwrap/texel_detail.h"
#include "unwrap/unwrap_charts.h"
#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// A low poly by large charts.
struct ChartLayout {
  Mesh mesh;
  UnwrapReport unwrapped;
  double texels_per_unit = 0;  ///< Side of the world's unit in texels of the map
};

/// \param border  texels around each chart
/// \param detail  for texels by it; null: by area
/// \param known   see unwrap_for()
/// \throws Error(input) where the charts are too many for the size
ChartLayout lay_out_charts(const SimplifiedIsosurface& low_poly, const Volume& volume,
                           std::uint32_t size, std::uint32_t border,
                           const TexelDetail* detail = nullptr, KnownCharts* known = nullptr);

/// The same with a map, a multiple of 16 texels, that is about large enough for a density; at most 8192.
/// \param size  [out]
ChartLayout lay_out_charts_at(const SimplifiedIsosurface& low_poly, const Volume& volume,
                              double texels_per_unit, std::uint32_t border, std::uint32_t& size,
                              const TexelDetail* detail = nullptr);

/// Splats fine vertices into a map of the polygons, twice as fine, and reads that at the charts' texels: what
/// two charts hold along a seam is the same.
/// \param layout    of `low_poly`
/// \param splatted  [out] texels of the polygons that fine vertices fell into
Image chart_map(cl::Context& context, const FineSurface& surface,
                const SimplifiedIsosurface& low_poly, const Volume& volume,
                const ChartLayout& layout, double spacing, const ExtractOptions& options,
                std::uint64_t& splatted);

}  // namespace kiln
