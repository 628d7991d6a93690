// Oracle for mip-maps: every texel of every level straight from level 0, in double precision, by brute
// force; charts by comparing all pairs of triangles. No code of the product's.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "kiln/mesh.h"

namespace kiln::reference {

/// Level 0: rows from the top. A chart of -1 is empty.
struct MipBase {
  int width = 0, height = 0;
  std::vector<int> chart;
  std::vector<double> area;
  std::vector<std::array<double, 3>> value;
};

/// A chart's share of a texel.
struct MipShare {
  double area = 0;
  std::array<double, 3> mean{};
};

/// Share of each of `size` texels that lies in each texel of level `level` along one axis, rows by texel of
/// that level. Each level is the one before stretched over floor(n / 2) texels, so areas are those of
/// overlapping intervals.
std::vector<std::vector<double>> mip_overlaps(int size, int level);

/// The shares of a texel. \param across, down  overlaps of its column and row
std::map<int, MipShare> mip_shares(const MipBase& base, const std::vector<double>& across,
                                   const std::vector<double>& down);

/// The chart with most of a texel, the lowest of equals (to 1e-9); -1 where there is none.
int mip_winner(const std::map<int, MipShare>& shares);

/// Charts by flood fill over all pairs of triangles that share an edge in space and in UV.
std::vector<std::uint32_t> charts(const Mesh& mesh);

}  // namespace kiln::reference
