#include "mesh/weld.h"

#include <array>
#include <bit>
#include <utility>

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {

namespace {

constexpr std::size_t kVerticesPerBlock = std::size_t{1} << 15;
/// Number of hash tables. Vertices are distributed by the leading bits of their hash, so that each table fits in a
/// cache and tables are filled in parallel.
constexpr std::size_t kHashTables = 16;

std::uint32_t hash_of(const Vec3& p) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value + 0.0f); };
  std::uint64_t hash = bits(p.x);
  hash = (hash ^ (std::uint64_t{bits(p.y)} << 32)) * 0x9E3779B97F4A7C15u;
  hash = (hash ^ (hash >> 29) ^ bits(p.z)) * 0xBF58476D1CE4E5B9u;
  return static_cast<std::uint32_t>(hash ^ (hash >> 32));
}
std::size_t table_of_hash(std::uint32_t hash) { return hash >> 28; }

/// Welds a subset of the vertices, in ascending order.
void weld(std::span<const Vec3> positions, std::span<const std::uint32_t> subset,
          const std::vector<std::uint32_t>& hashes, std::vector<std::uint32_t>& lowest_vertex) {
  // The table uses open addressing and is at most half full. A slot holds the index of a vertex + 1.
  const std::size_t mask = std::bit_ceil(subset.size() * 2 + 2) - 1;
  std::vector<std::uint32_t> vertex_of_hash(mask + 1, 0);
  for (const std::uint32_t i : subset) {
    lowest_vertex[i] = i;
    const Vec3& p = positions[i];
    if (!is_finite(p)) continue;
    std::size_t slot = hashes[i] & mask;
    while (vertex_of_hash[slot] != 0 && !(positions[vertex_of_hash[slot] - 1] == p))
      slot = (slot + 1) & mask;
    if (vertex_of_hash[slot] == 0) {
      vertex_of_hash[slot] = i + 1;
    } else {
      lowest_vertex[i] = vertex_of_hash[slot] - 1;
    }
  }
}

}  // namespace

std::vector<std::uint32_t> weld_vertices(std::span<const Vec3> positions) {
  const std::size_t count = positions.size();
  std::vector<std::uint32_t> hashes(count), order(count), lowest_vertex(count);
  // Counting sort of the vertices by table: first counts per block and table, then positions at which to write.
  std::vector<std::array<std::uint32_t, kHashTables>> next(count / kVerticesPerBlock + 1);
  const auto each_part = [&](const auto& body) {
    parallel_for(count, kVerticesPerBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i, next[begin / kVerticesPerBlock]);
    });
  };
  each_part([&](std::size_t i, std::array<std::uint32_t, kHashTables>& own) {
    hashes[i] = hash_of(positions[i]);
    ++own[table_of_hash(hashes[i])];
  });
  std::array<std::uint32_t, kHashTables + 1> start{};
  std::uint32_t sum = 0;
  for (std::size_t table = 0; table < kHashTables; ++table) {
    for (auto& own : next) sum += std::exchange(own[table], sum);
    start[table + 1] = sum;
  }
  each_part([&](std::size_t i, std::array<std::uint32_t, kHashTables>& own) {
    order[own[table_of_hash(hashes[i])]++] = static_cast<std::uint32_t>(i);
  });
  parallel_for(kHashTables, count > kVerticesPerBlock ? 1 : kHashTables,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t table = begin; table < end; ++table) {
                   const std::size_t size = start[table + 1] - start[table];
                   weld(positions, std::span(order).subspan(start[table], size), hashes,
                        lowest_vertex);
                 }
               });
  return lowest_vertex;
}

std::vector<Triangle> welded_triangles(const Mesh& mesh) {
  const std::vector<std::uint32_t> lowest_vertex = weld_vertices(mesh.positions);
  std::vector<Triangle> triangles = mesh.triangles;
  for (Triangle& t : triangles) {
    for (std::uint32_t& v : t) v = lowest_vertex[v];
  }
  return triangles;
}

}  // namespace kiln
