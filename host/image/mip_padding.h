// Padding under which mip levels keep the mean of the charts.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/image.h"
#include "kiln/map.h"

namespace kiln {

/// Fills all texels of a map that lie farther than 2 texels from its charts, whatever they hold, so that mip levels made
/// by a box filter neither darken nor tint the charts.
///
/// Engines make mip levels of the whole picture. A background bleeds into the charts from the level on whose texels are
/// as wide as the padding; copies of the nearest texels do not, but give borders of charts more weight than their inside.
/// Two steps avoid both:
///   1. An unknown texel gets the mean of the charts' texels in the smallest square of the mip pyramid around it that has
///      any. The mean of each texel of a level is then near that of its part of the charts; and squares of one value
///      take few bytes in a PNG.
///   2. What remains is a bias of each level: the charts' mean minus the mean of the level's texels, weighted by the part
///      of the charts that each covers. Biases are linear in the filled texels. From level 4 on, filled texels move by a
///      share of their way to the highest or the lowest of the charts' values, a share a square of 16 x 16 texels: the
///      smallest shares, in least squares, that bring all biases below 0.3 of a step of 8 bits, where that is possible.
///
/// The coarsest level, the mean of the whole picture, is then the charts' mean, too. Vectors in the padding are not normalised, as
/// those of mip levels are not. Deterministic on any number of threads. Linear time.
/// \param coverage  per texel, kCoverageBaked or kCoverageMissed: its value belongs to a chart; kCoverageGutter: a copy of
///                  a chart's texel, kept within 2 texels of charts
void pad_for_mips(Image& image, std::span<const std::uint8_t> coverage);

/// The same for a map with stored values. Does nothing to maps whose mean is meaningless (ids, coverage), and to those that have
/// mip levels of their own.
void pad_for_mips(BakedMap& map, std::span<const std::uint8_t> coverage);

}  // namespace kiln
