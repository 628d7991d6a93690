// Checks of a texture layout, by exact integer arithmetic and brute force over neighbours.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/mesh.h"

namespace kiln::test {

struct LayoutFacts {
  std::string first_fault;      ///< Empty where all is well.
  std::uint64_t charts = 0;     ///< Parts connected by shared UV edges, of positive area.
  std::uint64_t collapsed = 0;  ///< Triangles without UV area.
  double coverage = 0;
  double density_spread = 0;   ///< Standard deviation of log2(UV area / area) by area.
  double smallest_texels = 0;  ///< Smallest positive UV area, square texels of `size`.
};

/// Checks that every UV lies on the grid of `grid` steps in [0, 1]; that no triangle is mirrored; that
/// no two overlap; and that triangles of different charts are at least `border` steps apart. `size` is
/// the map's, for the smallest area.
LayoutFacts check_layout(const Mesh& mesh, std::int64_t grid, std::int64_t border,
                         std::int64_t size);

}  // namespace kiln::test
