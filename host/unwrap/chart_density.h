// Texels for charts by what maps leave out: more where the error per texel is higher.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// Error of a piece of the surface as a function of texel size.
struct TexelNeed {
  double area = 0;       ///< In units of the surface.
  TexelErrors errors{};  ///< At each of kTexelSides, times the area.
};

/// Sides of the densest chart's texels are no less than this share of those of the least dense.
inline constexpr double kMostDenser = 4;

/// Sides of pieces on the map, times what they are with texels spread evenly. The sum of errors is least for
/// as many texels. The error of a piece falls like a power p of its side s, as its three errors do best; then
/// s follows (p e)^(1 / (2 + p)), by Lagrange, for an error e at the side 1. The largest is at most kMostDenser
/// times the least. The sum of area s^2 is that of the areas.
std::vector<double> texel_scales(std::span<const TexelNeed> needs);

/// The price of a cut, in units of the surface with texels spread evenly.
struct DensityPrice {
  double margin = 0;  ///< Half of the padding.
  double seam = 0;    ///< Area that an edge of length 1 must save beside that.
  double least = 0;   ///< Parts have at least this area.
};

/// UV positions of the mesh's triangles.
/// \param count  of the mesh's triangles
FlatTriangles flat_triangles(const ChartSurface& surface, const ChartBorders& borders,
                             const std::vector<FlatChart>& charts, std::size_t count);

/// The sum of errors of pieces at some scales, by the power laws that texel_scales() takes.
double expected_error(std::span<const TexelNeed> needs, std::span<const double> scales);

/// Texel needs of each triangle of the surface.
/// \param errors  per triangle of the mesh that the surface is of
std::vector<TexelNeed> texel_needs(const ChartSurface& surface,
                                   std::span<const TexelErrors> errors);

/// Texel need of each chart, from its triangles.
std::vector<TexelNeed> chart_needs(const std::vector<FlatChart>& charts,
                                   std::span<const TexelNeed> needs);

/// Cuts charts in two along nearly straight lines, where parts that need other densities are worth the seam.
/// Both parts lie as they did. Deterministic.
/// \param needs  per triangle of the surface
void cut_by_density(const ChartSurface& surface, ChartBorders& borders, const DensityPrice& price,
                    std::span<const TexelNeed> needs, std::vector<FlatChart>& charts);

}  // namespace kiln
