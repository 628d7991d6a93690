// Packing of outlines into a square by bitmaps: any shape, at many turns, into any gap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lowpoly/chart_mask.h"

namespace kiln {

/// Where an outline goes: turned, scaled and moved, in texels.
struct OutlinePlace {
  FlatPoint turn{1, 0};  ///< Cosine and sine.
  FlatPoint shift;
};

struct OutlinePacking {
  double scale = 0;  ///< Texels per unit of the outlines; 0 where they do not fit.
  std::vector<OutlinePlace> places;
};

/// Packs outlines into [0, size] x [0, size], `padding` apart and half of it from the sides, at the
/// largest scale that the search finds. They are never mirrored.
///
/// Each outline goes, in some order, to the lowest place that is free at any of up to 16 turns. A few orders
/// by size come first, at a scale at which they just fill the square. The best of them is then changed
/// again and again, by numbers that are random but always the same; what is lower stays. At the end the
/// outlines go to nearly the same places on finer cells, at the largest scale that fits.
/// Deterministic on any number of threads.
/// \param outlines  each of positive area
/// \param padding   texels, above 0
/// \param threads   0: thread_count()
OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             int threads = 0);

/// The share of the square that pack_outlines() can be expected to fill, after the first orders: an
/// estimate, on the calling thread.
/// \param tolerance  how far from a square it may be taken of, as a share of the side
double expected_share(std::span<const Outline> outlines, std::uint32_t size, double padding,
                      double tolerance);

}  // namespace kiln
