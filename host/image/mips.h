// Mip chains filtered within charts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/image_data.h"
#include "texel/texels.h"

namespace kiln {

/// Chart of each texel of a map, and the number of the texel's samples in that chart.
struct ChartMap {
  std::vector<std::uint32_t> chart;  ///< Chart of each texel; undefined for texels without coverage
  /// For each texel, number of samples in its chart; empty for maps with one sample per texel
  std::vector<std::uint16_t> weight;

  ChartMap() = default;
  ChartMap(std::size_t texels, std::uint32_t samples);
  /// Stores the charts of a band. A texel belongs to the chart in which most of its samples lie, or
  /// to the lowest of several equally frequent ones.
  void store(cl::Context& context, const TexelBand& band, std::uint32_t width,
             const std::vector<std::uint32_t>& chart_of_triangle);
};

struct MipOptions {
  /// The first three channels are a unit vector, so that means are normalized
  bool unit_vectors = false;
  bool missed_have_values = true;  ///< True if texels that are marked missed have valid values
  /// Value of texels that cover nothing but missed ones; used if these have no values
  std::array<float, 4> missed{};
};

/// A mip level after the first. Texels without a chart are 0.
struct MipLevel {
  Image image;
  /// Coverage of each texel: empty, baked or missed (gutter.h)
  std::vector<std::uint8_t> coverage;
};

/// Makes all coarser levels of a map, down to 1 x 1. Each level has half the sides of the one
/// before, rounded down.
///
/// Ordinary box filtering bleeds across the borders of charts (Wang, Froehlich and Goebel, "Fast Normal Map Generation
/// for Simplified Meshes", section 6). Here a texel represents one chart: the chart with the greatest area in it, or
/// the lowest of several such charts. Its value is the mean over this chart's part of the texel in level 0, without
/// other charts and the empty space between them. For this purpose, each texel of each level stores the area and the
/// mean of every chart in it; charts that a level does not show are kept for the next level.
///
/// In levels of odd size, a texel covers parts of three finer texels, weighted by the covered area (Guthe and
/// Heckbert, "Non-Power-of-Two Mipmap Creation", NVIDIA TR-01838-001, 2005). So every row of texels has the same
/// total weight.
///
/// Vectors are normalized in the result only. Within the chain, means are not normalized, so they
/// are shorter where directions differ. The mean of such means, weighted by area, therefore equals
/// the mean over level 0, whose direction minimizes the sum of squared chords to all vectors under
/// the texel. If levels were normalized, a rough patch would count as much as a smooth one. Where
/// vectors cancel (a mean shorter than 1e-6), the direction of the first vector, row by row, is
/// used. A map that is constant over a chart stays constant to the last bit.
///
/// Missed texels without values are ignored, except where nothing else covers a texel, which is then marked missed.
///
/// Runs on the host's threads; the result does not depend on their number. A map of 4096^2 takes 0.25 s on two cores.
/// A kernel on the same cores would gain little: it took 0.1 s, transfers included, for level 1 without the texels of
/// several charts. Memory: two thirds of the image's, and 4 bytes per texel for the charts.
/// \param image     1 to 4 channels; texels without coverage are not read
/// \param coverage  coverage of each texel (gutter.h); padding counts as empty
std::vector<MipLevel> make_mips(const Image& image, std::span<const std::uint8_t> coverage,
                                const ChartMap& charts, const MipOptions& options);

}  // namespace kiln
