#include "reference/gutter.h"

#include <cmath>
#include <cstddef>

namespace kiln::reference {

std::optional<Place> nearest_source(const std::vector<bool>& source, int width, int height, int x,
                                    int y, double radius) {
  std::optional<Place> best;
  double best_distance = 0;
  // Rows, then columns, upward: the first of equals is the one the rule names.
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      if (!source[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)]) {
        continue;
      }
      const double distance = std::hypot(column - x, row - y);
      if (distance > radius) continue;
      if (!best || distance < best_distance) {
        best = Place{column, row};
        best_distance = distance;
      }
    }
  }
  return best;
}

}  // namespace kiln::reference
