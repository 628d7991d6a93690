// Where the names of marks go, so that none covers another.
#pragma once

#include <string>
#include <vector>

namespace kiln::cli {

struct Point {
  double x = 0, y = 0;  ///< Pixels, y downwards
};

/// An upright rectangle.
struct Box {
  Point center;
  double width = 0, height = 0;
};

struct Line {
  Point from, to;
};

struct PlacedLabel {
  Box box;
  bool leader = false;  ///< Far enough from its mark for a line to it
};

/// What is in the way.
struct LabelScene {
  Box panel;                ///< Labels stay inside
  double mark_radius = 10;  ///< Of every mark
  std::vector<Box> kept;    ///< Not to be covered
  std::vector<Line> lines;  ///< Better not covered
};

/// Places a label beside each mark by local search from the nearest free places (after Christensen, Marks and
/// Shieber 1995, "An Empirical Study of Algorithms for Point-Feature Label Placement": discrete gradient
/// descent). The same marks give the same places.
/// \param sizes  of the labels: width and height, as many as marks
std::vector<PlacedLabel> place_labels(const std::vector<Point>& marks,
                                      const std::vector<Box>& sizes, const LabelScene& scene);

/// Whether two boxes share an area.
bool overlap(const Box& a, const Box& b);

}  // namespace kiln::cli
