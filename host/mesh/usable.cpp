#include "mesh/usable.h"

#include <numeric>
#include <vector>

#include "base/parallel.h"

namespace kiln {

std::uint64_t count_without_area(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles) {
  constexpr std::size_t kBlock = 1 << 16;
  std::vector<std::uint64_t> counts((triangles.size() + kBlock - 1) / kBlock);
  parallel_for(triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    for (std::size_t i = begin; i < end; ++i) count += has_area(positions, triangles[i]) ? 0 : 1;
    counts[begin / kBlock] = count;
  });
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

}  // namespace kiln
