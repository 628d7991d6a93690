// Rasterises a chart's outline, rotated, scaled and widened by half the padding, as rows of cells.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vector2.h"

namespace kiln {

/// Closed polygons that do not cross each other, filled by the even-odd rule.
struct Outline {
  std::vector<std::vector<Vec2d>> rings;
  double area = 0;  ///< Area of the interior
};

/// A conservative set of the cells that a widened outline touches.
struct ChartMask {
  /// A run of cells in one row, from `first` to `last` inclusive.
  struct Run {
    std::uint32_t row = 0, first = 0, last = 0;
  };
  std::uint32_t width = 0, height = 0;
  /// Runs of cells: the longest first, then runs in rows far from each other (see sort_runs()).
  std::vector<Run> runs;
  std::vector<std::int16_t> longest;  ///< Length of each row's longest run, in cells
  Vec2d turn{1, 0};                   ///< Cosine and sine of the rotation
  Vec2d shift{};                      ///< Translation of the rotated, scaled outline, in cells

  /// Sorts runs so that searches fail early, and sets `longest`.
  void sort_runs();
};

/// Masks of an outline at an angle, and at that angle plus 90, 180 and 270 degrees. The other three masks are the first
/// one with rotated cells, which is faster than rasterising again. Since a mask's size is an integer number of cells,
/// the outline in a rotated mask touches the opposite side.
/// \param scale   cells per unit of the outline
/// \param margin  cells by which the outline is widened; the distance between outlines of two disjoint masks is at
///        least twice this
std::array<ChartMask, 4> make_turned_masks(const Outline& outline, double angle, double scale,
                                           double margin);

/// The rotation in [0, pi / 2) with the smallest axis-aligned bounding box.
double best_box_angle(const Outline& outline);

}  // namespace kiln
