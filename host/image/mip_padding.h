// Padding that keeps the mean of the charts in all mip levels.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/image_data.h"
#include "kiln/map.h"

namespace kiln {

/// Replaces all texels of a map that are farther than 2 texels from its charts, so that mip levels made by a box
/// filter neither darken nor tint the charts.
///
/// Engines make mip levels of the whole picture. A background colour bleeds into the charts on levels whose texels
/// are at least as wide as the padding. Copies of the nearest texels do not bleed, but give borders of charts more
/// weight than their interior. Three steps avoid both:
///   1. An unknown texel gets the mean of the charts' texels in the smallest enclosing square of the mip pyramid that
///      contains chart texels. The mean of each texel of a level is then near that of its part of the charts; and
///      squares of constant value take few bytes in a PNG.
///   2. The remaining error is a bias of each level: the charts' mean minus the mean of the level's texels, weighted
///      by the part of the charts that each texel covers. Biases are linear in the filled texels. From level 4 on,
///      filled texels are moved towards the highest or the lowest value of the charts, by a share of the difference
///      that is constant within each square of 16 x 16 texels. The shares are the smallest, in least squares, that
///      bring all biases below 0.3 steps of 8 bits, if that is possible.
///   3. Where more than 0.4 steps remain on a level, as in a dense atlas of strong colours, whose padding is narrow,
///      single texels are shifted, including copies that lie two texels from a chart, and the biases of levels 1 to 3
///      are corrected, too. The shifts are the smallest, in least squares, that bring all biases below 0.3 steps, if
///      the charts' range of values allows that. It does not always: for black and white charts 4 texels apart at
///      256 x 256, no choice of those texels leaves less than 0.56 steps.
///
/// The coarsest level, the mean of the whole picture, is then the charts' mean, too. Vectors in the padding are not
/// normalised, like those of mip levels. Deterministic on any number of threads. Linear time.
/// \param coverage  coverage of each texel. kCoverageBaked, kCoverageMissed: the value belongs to a chart;
///                  kCoverageGutter: a copy of a chart's texel, not replaced within 2 texels of charts
/// \param keeps_copies  true if the caller chose the padding's width: copies stay as they are at
///   any distance from a chart
void pad_for_mips(Image& image, std::span<const std::uint8_t> coverage, bool keeps_copies = false);

/// Pads for mip levels like the function above, for a map with stored values. Does nothing to maps
/// whose mean is meaningless (ids, coverage), and to those that have mip levels of their own.
void pad_for_mips(BakedMap& map, std::span<const std::uint8_t> coverage, bool keeps_copies = false);

}  // namespace kiln
