// Packing of outlines into a square by bitmaps: any shape, at many turns, into any gap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pack/atlas_bitmap.h"

namespace kiln {

/// The state of a search. Another search can continue from it, also with slightly different outlines.
struct PackState {
  std::vector<double> angles;  ///< First rotation of each outline.
  PackOrder order;             ///< The best that fits,
  Packed packed;               ///< and what it came to.
  double share = 0;            ///< Share of the square that outlines cover; 0 if none fits.
  PackOrder attempt;           ///< The best order that does not quite fit
  double attempt_share = 0;    ///< at this share, if that is above 0.
};

struct OutlinePacking {
  double scale = 0;  ///< Texels per unit of the outlines; 0 where they do not fit.
  std::vector<OutlinePlace> places;
};

/// Looks for an order in which outlines fill much of the square, on coarse cells, on the calling thread. An
/// order is changed again and again, by numbers that are random but follow from the seed; what leaves less
/// out of a square that is a little too small stays. Where all fit, they are drawn larger.
/// \param outlines  each of positive area
/// \param padding   texels, above 0
/// \param effort    orders to try; of many outlines, fewer
/// \param from      where to go on; null: from orders by size
PackState search_packing(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::uint32_t effort, std::uint32_t seed, const PackState* from = nullptr);

/// Packs outlines into [0, size] x [0, size] at the largest scale that the search finds: `padding` apart,
/// and half of it from the sides. They are never mirrored.
///
/// Each outline goes, in some order, to the lowest place that is free at any of up to 16 turns. A few
/// searches with other seeds run side by side, more where little is covered. For up to some thousand:
/// unwrap_charts() gives more to pack_boxes(). Deterministic on any number of threads.
/// \param outlines  each of positive area
/// \param padding   texels, above 0
/// \param from      as for search_packing()
/// \param threads   0: thread_count()
OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             const PackState* from = nullptr, int threads = 0);

}  // namespace kiln
