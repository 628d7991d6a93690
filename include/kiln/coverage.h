#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// What a bake leaves out of the high poly, which no measure over the low poly can tell: the share
/// of the high poly near the low poly that views from outside show and no sample stands for.
///
/// Places lie evenly over the high poly's area. A place counts within the match's distance of the
/// low poly. Its face turns less than 60 degrees from the low poly's there: a map along that normal
/// cannot hold steeper ones. Its weight is what 64 directions all around see of it past the high
/// poly: the sum of their cosines, as pixels of pictures would count it. A sample stands for a
/// place within one and a half samples' steps of its point. The two faces do not look opposite
/// ways. Layers closer than that are one.
struct HighCoverageReport {
  std::uint64_t places = 0;  ///< That counted
  double weight = 0;         ///< Of all of these, so that reports of several maps can be joined
  double lost = 0;           ///< Share that no sample stands for, 0 to 1
  double largest = 0;        ///< Share of the largest connected part of it, 0 to 1
  /// Of `lost`, the share near triangles that share others' texels and find another surface than these
  /// (BakeReport::uv_copies_differ), 0 to 1. What finds the same is on these texels, and not lost.
  double by_copies = 0;
  std::array<double, 3> where{};  ///< A place in the middle of that part, world units
};

/// Per vertex of the high poly: whether a sample stands for it.
enum class VertexCoverage : std::uint8_t {
  beside,  ///< Does not count: unseen, steep, or not near the low poly
  held,    ///< A sample stands for it
  lost,    ///< None does
};

}  // namespace kiln
