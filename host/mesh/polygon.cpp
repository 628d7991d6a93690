#include "mesh/polygon.h"

#include <algorithm>
#include <cmath>

#include "mesh/ears.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

// A triangle is a needle if its area is below this share of the quad's area. Its third corner then lies on the opposite
// side, up to rounding.
constexpr double kMinNeedleShare = 1e-4;

/// The start from which the cyclic list of positions is lexicographically the smallest (Shiloach 1981).
std::size_t smallest_rotation_start(PolygonCorners corners) {
  const std::size_t n = corners.size();
  std::size_t i = 0, j = 1, k = 0;
  while (i < n && j < n && k < n) {
    const auto &a = corners[(i + k) % n], &b = corners[(j + k) % n];
    if (a == b) {
      ++k;
      continue;
    }
    (a > b ? i : j) += k + 1;
    if (i == j) ++j;
    k = 0;
  }
  return std::min(i, j);
}

/// Cuts a quad between corners 0 and 2, as nearly all programs do. Cuts between 1 and 3 only if this avoids a flipped
/// triangle or a needle.
bool cut_quad_by_shape(PolygonCorners corners, CornerTriangles& triangles) {
  double polygon_size = 0;
  for (const auto& corner : corners)
    polygon_size = std::max(polygon_size, squared_distance(corner, corners[0]));
  polygon_size = std::sqrt(polygon_size);
  triangles.assign({{0, 1, 2}, {0, 2, 3}});
  if (!(polygon_size > 0) || !std::isfinite(polygon_size)) return false;
  std::array<Vec3d, 4> at{};
  for (std::size_t i = 0; i < 4; ++i) {
    at[i] = {(corners[i][0] - corners[0][0]) / polygon_size,
             (corners[i][1] - corners[0][1]) / polygon_size,
             (corners[i][2] - corners[0][2]) / polygon_size};
  }
  // Twice the area vector of the quad, which does not depend on the cut.
  const Vec3d normal = cross(at[2] - at[0], at[3] - at[1]);
  const double squared_area = dot(normal, normal);
  const auto smaller_area = [&](std::size_t first) {
    const Vec3d &a = at[first], &b = at[first + 1], &c = at[first + 2], &d = at[(first + 3) % 4];
    return std::min(dot(cross(b - a, c - a), normal), dot(cross(c - a, d - a), normal));
  };
  const double along_0_2 = smaller_area(0), along_1_3 = smaller_area(1),
               needle = kMinNeedleShare * squared_area;
  if (along_0_2 > needle) return true;
  if (along_1_3 > needle || along_1_3 > along_0_2 + needle) {
    triangles.assign({{1, 2, 3}, {0, 1, 3}});
  }
  return squared_area > 0 && std::max(along_0_2, along_1_3) >= -needle;
}

}  // namespace

bool triangulate(std::span<const std::array<double, 3>> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles) {
  triangles.clear();
  const std::size_t n = corners.size();
  if (n == 4) return cut_quad_by_shape(corners, triangles);
  std::vector<std::uint32_t> corner_order(n);
  const std::size_t start = n == 3 ? 0 : smallest_rotation_start(corners);
  for (std::size_t i = 0; i < n; ++i) corner_order[i] = static_cast<std::uint32_t>((start + i) % n);
  if (n == 3) {
    triangles.push_back({0, 1, 2});
    return true;
  }
  std::vector<std::array<double, 3>> ring(n);
  for (std::size_t i = 0; i < n; ++i) ring[i] = corners[corner_order[i]];
  const FlatPolygon flat = seen_along_normal(ring);
  if (flat.empty()) {
    split_as_convex(corner_order, triangles);
    return false;
  }
  const bool is_simple = shortest_ears(ring, flat, triangles);
  raise_smallest_angles(flat, triangles);
  for (auto& triangle : triangles) {
    for (std::uint32_t& corner : triangle) corner = corner_order[corner];
  }
  return is_simple;
}

}  // namespace kiln
