// Mip-maps that know charts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/image.h"
#include "texel/texels.h"

namespace kiln {

/// Which chart each texel of a map belongs to, and with how much of it.
struct ChartMap {
  std::vector<std::uint32_t> chart;   ///< Per texel; no meaning where the texel is not covered
  std::vector<std::uint16_t> weight;  ///< Samples of that chart; empty where a texel has one sample

  ChartMap() = default;
  ChartMap(std::size_t texels, std::uint32_t samples);
  /// Looks a band's charts up: a texel belongs to the chart with most of its samples, ties to the
  /// lowest chart.
  void store(cl::Context& context, const TexelBand& band, std::uint32_t width,
             const std::vector<std::uint32_t>& chart_of_triangle);
};

struct MipOptions {
  bool unit_vectors = false;       ///< The first three channels are a unit vector, and so they stay
  bool missed_have_values = true;  ///< Texels marked missed hold values like any other
  std::array<float, 4> missed{};   ///< ... else, what texels of missed ones alone hold
};

/// A level below the first: texels that no chart covers hold 0.
struct MipLevel {
  Image image;
  std::vector<std::uint8_t> coverage;  ///< Empty, baked or missed, as gutter.h has them
};

/// Makes all levels below a map, down to 1 x 1; sides halve, rounded down.
///
/// Ordinary box filtering bleeds across the borders of charts (Wang, Froehlich and Goebel, "Fast
/// Normal Map Generation for Simplified Meshes", section 6). Here a texel stands for one chart: the
/// one that covers most of it, the lowest of equals. Its value is the mean over this chart's part
/// of the texel in level 0, and over nothing else: neither other charts nor the empty space
/// between. To that end each texel keeps, level for level, the covered area and the mean of each
/// chart there; no chart is given up on the way down where another wins a level.
///
/// A texel of an odd side reaches over three, weighted by the area that it covers of each
/// (Guthe and Heckbert, "Non-Power-of-Two Mipmap Creation", NVIDIA TR-01838-001, 2005). So no row
/// is left out, and none counts twice.
///
/// Vectors are made unit in the result only. What goes down the chain is the mean as it is, shorter
/// where directions differ: means of means, weighted by area, are then the very mean over level 0.
/// Its direction has the least sum of squared chords to all vectors under the texel. Made unit on
/// the way, a rough patch would count as much as a smooth one, more than it should. Where vectors
/// cancel (a mean shorter than 1e-6), the first one's direction is taken, by rows. A map that is
/// constant over a chart stays so to the last bit.
///
/// Texels marked missed that have no value count only where nothing else covers a texel; it is then
/// marked missed.
///
/// Runs on the host's threads: same bytes on any number of them. 0.25 s for a map of 4096^2 on two (a
/// kernel on the same cores took 0.1 s with its transfers for the texels of one chart of level 1 alone,
/// which leaves too little to gain). Memory: two thirds of the image's, and 4 bytes a texel for the
/// charts.
/// \param image     1 to 4 channels; texels without coverage are not read
/// \param coverage  per texel, as gutter.h has it; gutter counts as empty
std::vector<MipLevel> make_mips(const Image& image, std::span<const std::uint8_t> coverage,
                                const ChartMap& charts, const MipOptions& options);

}  // namespace kiln
