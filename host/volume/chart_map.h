// Layout of the low poly in few large charts, and the normal map for that layout.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "kiln/unwrap.h"
#include "unwrap/texel_detail.h"
#include "unwrap/unwrap_charts.h"
#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// A low poly with large charts.
struct ChartLayout {
  Mesh mesh;
  UnwrapReport unwrapped;
  double texels_per_unit = 0;  ///< Texels of the map per world unit
};

/// \param border  texels around each chart
/// \param detail  distributes texels by detail; null: by area
/// \param known   see unwrap_for()
/// \throws Error(input) if there are too many charts for the size
ChartLayout lay_out_charts(const SimplifiedIsosurface& low_poly, const Volume& volume,
                           std::uint32_t size, std::uint32_t border,
                           const TexelDetail* detail = nullptr, KnownCharts* known = nullptr);

/// Chooses the map's size, a multiple of 16 texels up to 8192, for about the given density, and lays out the
/// charts.
/// \param size  [out] side of the map
ChartLayout lay_out_charts_at(const SimplifiedIsosurface& low_poly, const Volume& volume,
                              double texels_per_unit, std::uint32_t border, std::uint32_t& size,
                              const TexelDetail* detail = nullptr);

/// Splats fine vertices into a map of the polygons at twice the resolution, and resamples it for the charts, so that
/// both sides of a seam get the same values.
/// \param layout    of `low_poly`
/// \param splatted  [out] texels of the polygons' map that contain fine vertices
Image chart_map(cl::Context& context, const FineSurface& surface,
                const SimplifiedIsosurface& low_poly, const Volume& volume,
                const ChartLayout& layout, double spacing, const ExtractOptions& options,
                std::uint64_t& splatted);

}  // namespace kiln
