// Packs outlines of any shape into a square by bitmaps, at up to 16 rotations; gaps and holes are used, too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pack/atlas_bitmap.h"

namespace kiln {

/// The state of a search. Another search can continue from it, even with slightly different outlines.
struct PackState {
  std::vector<double> angles;  ///< Angle of each outline's first rotation, in radians
  PackOrder order;             ///< The best order with which all outlines fit
  PackedOutlines packed;       ///< The places of the outlines if they are placed in `order`
  /// Share of the square that outlines cover; 0 if they do not fit with any order
  double share = 0;
  /// The best order found at a slightly larger scale, at which some outlines do not fit yet.
  PackOrder attempt;
  /// Share of the square that `attempt` would cover; 0 if there is none.
  double attempt_coverage = 0;
};

struct OutlinePacking {
  double scale = 0;  ///< Texels per unit of the outlines; 0 if they do not fit.
  std::vector<OutlinePlace> places;
};

/// Searches for the order in which outlines cover the largest share of the square, on a coarse grid, on the calling
/// thread. Local search: the scale is slightly too large for all outlines to fit; random changes of the order are kept
/// if they reduce the area of the outlines that do not fit. When all outlines fit, the scale is increased. Random
/// numbers depend on the seed alone.
/// \param outlines  outlines of positive area
/// \param padding   distance between outlines in texels, above 0
/// \param effort  number of orders to try; fewer are tried for large numbers of outlines
/// \param from  state from which the search continues; null: it starts with orders by size
PackState search_packing(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::uint32_t effort, std::uint32_t seed, const PackState* from = nullptr);

/// Packs outlines into [0, size] x [0, size] at the largest scale that the search finds, at a distance of `padding`
/// from each other, and of half of it from the square's sides. Outlines are never mirrored.
///
/// Outlines are placed one after another, each at the lowest free place over up to 16 rotations. Four searches with
/// different seeds run in parallel, and are repeated for up to three rounds while the covered share is low. Suitable
/// for up to several thousand outlines: unwrap_charts() uses pack_boxes() for more. Deterministic on any number of
/// threads.
/// \param outlines  outlines of positive area
/// \param padding   distance between outlines in texels, above 0
/// \param from  see search_packing()
/// \param threads   0: thread_count()
OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             const PackState* from = nullptr, int threads = 0);

}  // namespace kiln
