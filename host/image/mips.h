// Mip chains filtered within charts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/image.h"
#include "texel/texels.h"

namespace kiln {

/// Chart of each texel of a map, and the number of its samples in it.
struct ChartMap {
  std::vector<std::uint32_t> chart;  ///< Per texel; undefined where not covered
  /// Number of samples of that chart; empty for maps with one sample a texel
  std::vector<std::uint16_t> weight;

  ChartMap() = default;
  ChartMap(std::size_t texels, std::uint32_t samples);
  /// Stores the charts of a band: a texel belongs to the chart with most of its samples, ties to the lowest chart.
  void store(cl::Context& context, const TexelBand& band, std::uint32_t width,
             const std::vector<std::uint32_t>& chart_of_triangle);
};

struct MipOptions {
  /// The first three channels are a unit vector; means are normalized
  bool unit_vectors = false;
  bool missed_have_values = true;  ///< Texels marked missed have valid values
  std::array<float, 4> missed{};   ///< otherwise: value of texels over missed ones only
};

/// A level below the first. Texels without a chart are 0.
struct MipLevel {
  Image image;
  std::vector<std::uint8_t> coverage;  ///< Empty, baked or missed, as in gutter.h
};

/// Makes all levels below a map, down to 1 x 1; sides halve, rounded down.
///
/// Ordinary box filtering bleeds across the borders of charts (Wang, Froehlich and Goebel, "Fast Normal Map Generation
/// for Simplified Meshes", section 6). Here a texel represents one chart: the one with the greatest area in it, the
/// lowest of equals. Its value is the mean over this chart's part of the texel in level 0, without other charts and
/// without the empty space between. To that end each texel stores, on every level, the area and the mean of each chart
/// in it; charts that lose a level are kept for the next.
///
/// A texel of an odd side reaches over three, weighted by the area that it covers of each (Guthe and Heckbert,
/// "Non-Power-of-Two Mipmap Creation", NVIDIA TR-01838-001, 2005). So every row counts exactly once.
///
/// Vectors are normalized in the result only. Means stay unnormalized along the chain, shorter where directions differ,
/// so that means of means, weighted by area, equal the mean over level 0. Its direction minimizes the sum of squared
/// chords to all vectors under the texel. If levels were normalized, a rough patch would count as much as a smooth one.
/// Where vectors cancel (a mean shorter than 1e-6), the first one's direction is used, by rows. A map that is constant
/// over a chart stays constant to the last bit.
///
/// Texels marked missed without values count only where nothing else covers a texel, which is then marked missed.
///
/// Runs on the host's threads, with the same bytes for any number of them. 0.25 s for a map of 4096^2 on two (a kernel
/// on the same cores took 0.1 s with its transfers for the texels of one chart of level 1 alone, which leaves too
/// little to gain). Memory: two thirds of the image's, and 4 bytes a texel for the charts.
/// \param image     1 to 4 channels; texels without coverage are not read
/// \param coverage  per texel, as in gutter.h; padding counts as empty
std::vector<MipLevel> make_mips(const Image& image, std::span<const std::uint8_t> coverage,
                                const ChartMap& charts, const MipOptions& options);

}  // namespace kiln
