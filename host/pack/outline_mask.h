// A chart's outline, turned, scaled and widened by half the padding, as rows of cells.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vector2.h"

namespace kiln {

/// Closed polygons, none crossing another; inside is where a line to the outside crosses an odd number
/// of sides.
struct Outline {
  std::vector<std::vector<Vec2d>> rings;
  double area = 0;  ///< Inside.
};

/// The cells that a widened outline touches: all of them, and few more.
struct ChartMask {
  /// Cells first to last of one row.
  struct Run {
    std::uint32_t row = 0, first = 0, last = 0;
  };
  std::uint32_t width = 0, height = 0;
  std::vector<Run> runs;              ///< The longest first, then of rows far from each other.
  std::vector<std::int16_t> longest;  ///< Cells of each row's longest run.
  Vec2d turn{1, 0};                   ///< Cosine and sine.
  Vec2d shift;                        ///< Cells: what the turned, scaled outline is moved by.

  /// Puts runs in their order, and finds each row's longest.
  void arrange();
};

/// An outline at an angle, and three quarter turns on. Of these the cells are turned, not drawn again: a mask is as
/// wide as whole cells, and the outline lies on its other side.
/// \param scale   cells per unit of the outline
/// \param margin  cells that the outline is widened by; two masks without a common cell are of outlines
///                at least twice this apart
std::array<ChartMask, 4> make_turned_masks(const Outline& outline, double angle, double scale,
                                           double margin);

/// The turn, in [0, pi / 2), whose upright box is smallest.
double best_box_angle(const Outline& outline);

}  // namespace kiln
