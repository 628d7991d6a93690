// Memory that low polys and their maps take in a renderer.
#include <algorithm>
#include <array>
#include <vector>

#include "kiln/plan.h"
#include "mesh/index_width.h"

namespace kiln {

LowPolyBytes low_poly_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                            const std::vector<std::uint32_t>& channels, std::uint32_t bits) {
  LowPolyBytes bytes;
  bytes.vertices =
      vertices * (size == 0 ? 16 : 24) + faces * 3 * (fits_16_bit_indices(vertices) ? 2 : 4);
  const std::uint64_t texels = std::uint64_t{size} * size;
  std::uint64_t half_bytes_per_texel = 0;  // Summed over all maps
  for (const std::uint32_t count : channels) {
    // Bytes of block-compressed formats. A normal map has two channels, since the third is computed from these.
    half_bytes_per_texel += bits > 8 ? 4 * std::uint64_t{std::min(count, 2U)} : count == 1 ? 1 : 2;
  }
  bytes.texels = (texels * half_bytes_per_texel / 2 * 4 + 2) / 3;
  return bytes;
}

std::uint64_t split_vertices(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  const bool has_uvs = mesh.uv_triangles.size() == count;
  const bool has_normals = mesh.normal_triangles.size() == count;
  if (!has_uvs && !has_normals) return mesh.positions.size();
  std::vector<std::array<std::uint32_t, 3>> corners;
  corners.reserve(3 * count);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      corners.push_back({mesh.triangles[t][k], has_uvs ? mesh.uv_triangles[t][k] : 0,
                         has_normals ? mesh.normal_triangles[t][k] : 0});
    }
  }
  std::sort(corners.begin(), corners.end());
  return static_cast<std::uint64_t>(std::unique(corners.begin(), corners.end()) - corners.begin());
}

}  // namespace kiln
