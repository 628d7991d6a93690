// What low polys weigh.
#include <algorithm>

#include "kiln/light_plan.h"

namespace kiln {

LightBytes light_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                       const std::vector<std::uint32_t>& channels, std::uint32_t bits) {
  LightBytes bytes;
  bytes.vertices = vertices * (size == 0 ? 16 : 24) + faces * 3 * (vertices > 65536 ? 4 : 2);
  const std::uint64_t texels = std::uint64_t{size} * size;
  std::uint64_t halves = 0;  // bytes a texel, twice
  for (const std::uint32_t count : channels) {
    // A normal map has two channels: the third follows.
    halves += bits > 8 ? 4 * std::uint64_t{std::min(count, 2U)} : count == 1 ? 1 : 2;
  }
  bytes.texels = (texels * halves / 2 * 4 + 2) / 3;
  return bytes;
}

std::uint64_t split_vertices(const Mesh& mesh) {
  const bool laid_out = mesh.uv_triangles.size() == mesh.triangles.size();
  const std::vector<Triangle>& with = laid_out ? mesh.uv_triangles : mesh.normal_triangles;
  if (with.size() != mesh.triangles.size()) return mesh.positions.size();
  std::vector<std::uint64_t> pairs;
  pairs.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      pairs.push_back(std::uint64_t{mesh.triangles[t][k]} << 32 | with[t][k]);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return static_cast<std::uint64_t>(std::unique(pairs.begin(), pairs.end()) - pairs.begin());
}

}  // namespace kiln
