#include "unwrap/smoothed_normals.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/half_edge.h"

namespace kiln {
namespace {

constexpr double kForward = 0.5, kBack = -0.52;

std::vector<Vec3d> smoothed(const ChartSurface& surface, int steps) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> links;
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    if (surface.mate[h] != kNoIndex && surface.mate[h] < h) continue;
    links.emplace_back(start_of(surface, h), end_of(surface, h));
  }
  std::vector<Vec3d> positions = surface.positions, sums(positions.size());
  std::vector<double> share(positions.size(), 0);
  for (const auto& [a, b] : links) ++share[a], ++share[b];
  for (double& s : share) s = s > 0 ? 1 / s : 0;
  for (int step = 0; step < 2 * steps; ++step) {
    const double by = step % 2 == 0 ? kForward : kBack;
    std::fill(sums.begin(), sums.end(), Vec3d{});
    for (const auto& [a, b] : links) {
      sums[a] += positions[b];
      sums[b] += positions[a];
    }
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (share[v] > 0) positions[v] += (sums[v] * share[v] - positions[v]) * by;
    }
  }
  return positions;
}

}  // namespace

std::vector<Vec3d> smoothed_normals(const ChartSurface& surface, int steps) {
  const std::vector<Vec3d> positions = smoothed(surface, steps);
  std::vector<Vec3d> normals = surface.normal;
  for (std::size_t t = 0; t < normals.size(); ++t) {
    const Triangle& c = surface.triangles[t];
    const Vec3d& a = positions[c[0]];
    const Vec3d n = cross(positions[c[1]] - a, positions[c[2]] - a);
    const double size = length(n);
    if (size > 0 && std::isfinite(size)) normals[t] = n * (1 / size);
  }
  return normals;
}

}  // namespace kiln
