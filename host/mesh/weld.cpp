#include "mesh/weld.h"

#include <bit>

#include "mesh/vector.h"

namespace kiln {

std::vector<std::uint32_t> weld_vertices(std::span<const Vec3> positions) {
  // Open addressing with at most half the slots in use; a slot holds vertex + 1.
  std::vector<std::uint32_t> first(positions.size());
  const std::size_t mask = std::bit_ceil(positions.size() * 2 + 2) - 1;
  std::vector<std::uint32_t> table(mask + 1, 0);
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value + 0.0f); };
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    first[i] = i;
    const Vec3& p = positions[i];
    if (!is_finite(p)) continue;
    std::uint64_t hash = bits(p.x);
    hash = (hash ^ (std::uint64_t{bits(p.y)} << 32)) * 0x9E3779B97F4A7C15u;
    hash = (hash ^ (hash >> 29) ^ bits(p.z)) * 0xBF58476D1CE4E5B9u;
    std::size_t slot = (hash ^ (hash >> 32)) & mask;
    while (table[slot] != 0 && !(positions[table[slot] - 1] == p)) slot = (slot + 1) & mask;
    if (table[slot] == 0) {
      table[slot] = i + 1;
    } else {
      first[i] = table[slot] - 1;
    }
  }
  return first;
}

std::vector<Triangle> welded_triangles(const Mesh& mesh) {
  const std::vector<std::uint32_t> first = weld_vertices(mesh.positions);
  std::vector<Triangle> triangles = mesh.triangles;
  for (Triangle& t : triangles) {
    for (std::uint32_t& v : t) v = first[v];
  }
  return triangles;
}

}  // namespace kiln
