#include "mesh/usable.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/parallel.h"

namespace kiln {

bool has_area(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const auto largest = [](const Vec3d& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  };
  const Vec3d u = b - a, v = c - a, sum = a + b + c;
  const double size = std::max(largest(u), largest(v));
  if (!(size > 0) || !std::isfinite(sum.x + sum.y + sum.z)) return false;
  // Bound on the sine between collinear sides that is due to rounding: half a unit in the last place per coordinate,
  // times 2.
  const double max_parallel_sine = 0x1p-50 * std::max({largest(a), largest(b), largest(c)}) / size;
  return largest(cross(u * (1 / size), v * (1 / size))) > max_parallel_sine;
}

std::uint64_t count_without_area(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles) {
  constexpr std::size_t kTrianglesPerBlock = 1 << 16;
  std::vector<std::uint64_t> block_counts((triangles.size() + kTrianglesPerBlock - 1) /
                                          kTrianglesPerBlock);
  parallel_for(triangles.size(), kTrianglesPerBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    for (std::size_t i = begin; i < end; ++i) count += has_area(positions, triangles[i]) ? 0 : 1;
    block_counts[begin / kTrianglesPerBlock] = count;
  });
  return std::accumulate(block_counts.begin(), block_counts.end(), std::uint64_t{0});
}

}  // namespace kiln
