#include "mesh/charts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "mesh/weld.h"

namespace kiln {
namespace {

/// Hash map that keeps the first value of each key. It uses open addressing and is at most half full.
class FirstValueMap {
 public:
  explicit FirstValueMap(std::size_t largest_count)
      : mask_(std::bit_ceil(largest_count * 2 + 2) - 1), keys_(mask_ + 1), values_(mask_ + 1) {}

  std::uint32_t get_or_put(std::uint64_t key, std::uint32_t value) {
    std::uint64_t hash = key * 0x9E3779B97F4A7C15U;
    hash = (hash ^ (hash >> 32)) * 0xBF58476D1CE4E5B9U;
    std::size_t slot = (hash ^ (hash >> 29)) & mask_;
    while (values_[slot] != 0 && keys_[slot] != key) slot = (slot + 1) & mask_;
    if (values_[slot] == 0) {
      keys_[slot] = key;
      values_[slot] = value + 1;
    }
    return values_[slot] - 1;
  }

 private:
  std::size_t mask_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> values_;  // For each slot, its value plus 1; 0 if it is free
};

/// Root of a triangle in a disjoint-set forest.
std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t triangle) {
  while (parent[triangle] != triangle) {
    parent[triangle] = parent[parent[triangle]];
    triangle = parent[triangle];
  }
  return triangle;
}

}  // namespace

std::vector<std::uint32_t> uv_charts(const Mesh& mesh) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const std::vector<std::uint32_t> position = weld_vertices(mesh.positions);
  std::vector<Vec3> flat(mesh.uvs.size());
  std::transform(mesh.uvs.begin(), mesh.uvs.end(), flat.begin(), [](const Vec2& uv) {
    return Vec3{uv.x, uv.y, 0};
  });
  const std::vector<std::uint32_t> uv = weld_vertices(flat);

  std::vector<std::uint32_t> parent(count);
  for (std::uint32_t t = 0; t < count; ++t) parent[t] = t;
  FirstValueMap corners(std::size_t{3} * count);
  FirstValueMap edges(std::size_t{3} * count);
  for (std::uint32_t t = 0; t < count; ++t) {
    Triangle corner{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint64_t key = std::uint64_t{position[mesh.triangles[t][k]]} << 32;
      corner[k] = corners.get_or_put(key | uv[mesh.uv_triangles[t][k]], 3 * t + k);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(corner[k], corner[(k + 1) % 3]);
      const std::uint32_t other = edges.get_or_put((std::uint64_t{low} << 32) | high, t);
      const auto [first, second] = std::minmax({root(parent, t), root(parent, other)});
      parent[second] = first;
    }
  }

  std::uint32_t charts = 0;
  std::vector<std::uint32_t> chart(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t first = root(parent, t);
    chart[t] = first == t ? charts++ : chart[first];
  }
  return chart;
}

std::vector<std::uint32_t> uv_charts(const Mesh& mesh, std::span<const std::uint32_t> triangles) {
  if (triangles.size() == mesh.triangles.size()) return uv_charts(mesh);
  Mesh part;
  // Copies the used items of a pool in their order, so that of equal items, the one with the lowest index stays first.
  const auto copy_used = [&](const std::vector<Triangle>& corners, const auto& pool,
                             std::vector<Triangle>& part_corners, auto& part_pool) {
    std::vector<std::uint32_t> used;
    used.reserve(3 * triangles.size());
    for (const std::uint32_t t : triangles) {
      used.insert(used.end(), corners[t].begin(), corners[t].end());
    }
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const std::uint32_t item : used) part_pool.push_back(pool[item]);
    for (const std::uint32_t t : triangles) {
      Triangle& renumbered = part_corners.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        renumbered[k] = static_cast<std::uint32_t>(
            std::lower_bound(used.begin(), used.end(), corners[t][k]) - used.begin());
      }
    }
  };
  copy_used(mesh.triangles, mesh.positions, part.triangles, part.positions);
  copy_used(mesh.uv_triangles, mesh.uvs, part.uv_triangles, part.uvs);
  const std::vector<std::uint32_t> charts = uv_charts(part);
  std::vector<std::uint32_t> result(mesh.triangles.size());
  for (std::size_t i = 0; i < charts.size(); ++i) result[triangles[i]] = charts[i];
  return result;
}

double uv_area(const Vec2& a, const Vec2& b, const Vec2& c) {
  const double doubled_area =
      (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
  return std::isfinite(doubled_area) ? std::abs(doubled_area) / 2 : 0;
}

double uv_area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.uv_triangles)
    sum += uv_area(mesh.uvs[a], mesh.uvs[b], mesh.uvs[c]);
  return sum;
}

}  // namespace kiln
