// Oracle for gutters: brute force, double precision, no code of the product's.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace kiln::reference {

struct Place {
  int x = 0, y = 0;
};

/// The source nearest to a texel's centre within a radius: of all sources, by distance, then row, then
/// column.
std::optional<Place> nearest_source(const std::vector<bool>& source, int width, int height, int x,
                                    int y, double radius);

}  // namespace kiln::reference
