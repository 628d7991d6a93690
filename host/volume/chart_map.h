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

/// A low poly whose layout has few large charts.
struct ChartLayout {
  Mesh mesh;
  UnwrapReport unwrapped;
  double texels_per_unit = 0;  ///< Texels of the map per world unit
};

/// \param border  padding around each chart, in texels
/// \param detail  texels are distributed by this measure of detail; null: by area
/// \param known   see unwrap_for()
/// \throws Error(input) if there are too many charts for the size
ChartLayout lay_out_charts(const SimplifiedIsosurface& low_poly, const Volume& volume,
                           std::uint32_t size, std::uint32_t border,
                           const TexelDetail* detail = nullptr, KnownCharts* known = nullptr);

/// Lays out the charts in a map whose size gives about the requested density. The size is a
/// multiple of 16 texels, up to 8192.
/// \param size  [out] side of the map in texels
ChartLayout lay_out_charts_at(const SimplifiedIsosurface& low_poly, const Volume& volume,
                              double texels_per_unit, std::uint32_t border, std::uint32_t& size,
                              const TexelDetail* detail = nullptr);

/// Splats the fine vertices into an intermediate map at twice the resolution, in which each polygon
/// is a chart, and resamples that map for the large charts. So both sides of a seam get the same
/// values.
/// \param layout    layout of `low_poly`
/// \param splatted  [out] number of texels of the intermediate map that contain fine vertices
Image make_chart_map(cl::Context& context, const FineSurface& surface,
                     const SimplifiedIsosurface& low_poly, const Volume& volume,
                     const ChartLayout& layout, double spacing, const ExtractOptions& options,
                     std::uint64_t& splatted);

}  // namespace kiln
