// Distributes texels to charts by their detail: charts with a higher error get more texels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// Error of a piece of the surface at several texel sizes, from which the number of texels it needs is derived.
struct TexelNeed {
  double area = 0;       ///< Area of the piece on the surface
  TexelErrors errors{};  ///< Error at each of kTexelSides, times the area
};

/// Largest ratio between the texel sides of two charts.
inline constexpr double kMaxDensityRatio = 4;

/// Optimal scales of pieces on the map, relative to a uniform density. They minimize the sum of errors for a constant
/// number of texels. Each piece's error is fitted by a power law e * s^-p in its scale s. By Lagrange multipliers, the
/// optimal s is proportional to (p e)^(1 / (2 + p)). The largest scale is at most kMaxDensityRatio times the smallest.
/// The sum of area * s^2 over all pieces equals the sum of their areas.
std::vector<double> texel_scales(std::span<const TexelNeed> needs);

/// The price of a cut, as area of the surface at uniform texel density.
struct DensityPrice {
  double margin = 0;  ///< Half of the padding, as a length on the surface
  /// Area to save per unit of a cut's length, on top of the area of its padding
  double seam = 0;
  double min_part_area = 0;  ///< Minimum area of a part
};

/// UV positions of the triangles of the mesh that the surface was made from.
/// \param count  number of the mesh's triangles
FlatTriangles flat_triangles(const ChartSurface& surface, const ChartBorders& borders,
                             const std::vector<FlatChart>& charts, std::size_t count);

/// Sum of the errors of pieces at the given scales, by the power laws of texel_scales().
double expected_error(std::span<const TexelNeed> needs, std::span<const double> scales);

/// Texel needs of each triangle of the surface.
/// \param errors  per triangle of the surface's mesh
std::vector<TexelNeed> texel_needs(const ChartSurface& surface,
                                   std::span<const TexelErrors> errors);

/// Texel need of each chart, from its triangles.
std::vector<TexelNeed> chart_needs(const std::vector<FlatChart>& charts,
                                   std::span<const TexelNeed> needs);

/// Cuts charts in two along nearly straight lines where two different texel densities save more than the seam costs.
/// Both parts keep their layout. Deterministic.
/// \param needs  per triangle of the surface
void cut_by_density(const ChartSurface& surface, ChartBorders& borders, const DensityPrice& price,
                    std::span<const TexelNeed> needs, std::vector<FlatChart>& charts);

}  // namespace kiln
