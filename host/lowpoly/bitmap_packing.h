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
/// Each outline goes, largest first, to the lowest place that is free at any of up to 16 turns. A row of
/// cells is 64 places a word, and rows of what is taken are kept widened by every power of two, so that
/// a run of cells is tried at 64 places by two words. The scale is halved in on, several orders a step.
/// Deterministic on any number of threads.
/// \param outlines  each of positive area
/// \param padding   texels, above 0
/// \param threads   0: thread_count()
OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             int threads = 0);

}  // namespace kiln
