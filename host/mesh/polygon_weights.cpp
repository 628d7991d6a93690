// Corner weights of polygons, for vertex normals.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mesh/normals.h"

namespace kiln {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// A corner of a polygon and its two neighbours.
struct Corner {
  std::uint32_t vertex, before, after;
};

/// The sides of a polygon in the order of their vertices. These are the sides of its triangles that belong to one
/// triangle only. Empty if they do not form a single ring through as many vertices as the polygon has corners.
std::vector<Corner> boundary_ring_of(std::span<const Triangle> triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(t[k], t[(k + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Edge> polygon_sides;
  for (const Edge& edge : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), Edge{edge.second, edge.first})) {
      polygon_sides.push_back(edge);
    }
  }
  std::vector<Corner> corners(polygon_sides.size());
  if (polygon_sides.size() != triangles.size() + 2) return {};
  const auto corner_of = [&](std::uint32_t vertex) {
    return std::lower_bound(polygon_sides.begin(), polygon_sides.end(), Edge{vertex, 0}) -
           polygon_sides.begin();
  };
  for (std::size_t i = 0; i < polygon_sides.size(); ++i) {
    // Exactly one side must start at each vertex.
    if (i > 0 && polygon_sides[i].first == polygon_sides[i - 1].first) return {};
    corners[i].vertex = polygon_sides[i].first;
    corners[i].after = polygon_sides[i].second;
  }
  std::vector<bool> is_reached(polygon_sides.size());
  for (const Edge& side : polygon_sides) {
    const auto at = static_cast<std::size_t>(corner_of(side.second));
    if (at >= polygon_sides.size() || corners[at].vertex != side.second || is_reached[at])
      return {};
    is_reached[at] = true;
    corners[at].before = side.first;
  }
  return corners;
}

/// Weights the corners of a polygon.
/// \returns false if its triangles must be weighted separately instead
bool weigh_polygon(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   CornerWeights* weights) {
  Vec3d area{};
  for (const Triangle& t : triangles) {
    for (const std::uint32_t index : t) {
      if (!is_finite(positions[index])) return false;
    }
    const Vec3d a = to_double(positions[t[0]]);
    area += cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
  }
  const double size = length(area);
  if (!(size > 0) || !std::isfinite(size)) return false;
  const std::vector<Corner> corners = boundary_ring_of(triangles);
  if (corners.empty()) return false;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    weights[t] = {};
    weights[t].normal = area * (1 / size);
  }
  // At each corner, the first triangle gets the whole angle.
  std::vector<bool> has_angle(corners.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto corner =
          std::lower_bound(corners.begin(), corners.end(), triangles[t][k],
                           [](const Corner& a, std::uint32_t vertex) { return a.vertex < vertex; });
      if (corner == corners.end() || corner->vertex != triangles[t][k]) continue;
      const auto i = static_cast<std::size_t>(corner - corners.begin());
      if (has_angle[i]) continue;
      has_angle[i] = true;
      const Vec3d at = to_double(positions[corner->vertex]);
      const Vec3d back = to_double(positions[corner->before]) - at;
      const Vec3d to_next = to_double(positions[corner->after]) - at;
      weights[t].angles[k] = std::atan2(length(cross(back, to_next)), dot(back, to_next));
    }
  }
  return true;
}

}  // namespace

void corner_weights(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                    std::span<const std::uint32_t> polygons, std::size_t begin, std::size_t end,
                    CornerWeights* weights) {
  for (std::size_t first = begin, last = begin; first < end; first = last) {
    last = first + 1;
    if (!polygons.empty()) {
      // The polygon belongs to another range.
      if (first > 0 && polygons[first] == polygons[first - 1]) continue;
      while (last < triangles.size() && polygons[last] == polygons[first]) ++last;
    }
    const std::span<const Triangle> own = triangles.subspan(first, last - first);
    if (own.size() > 1 && weigh_polygon(positions, own, weights + (first - begin))) continue;
    for (std::size_t t = first; t < last; ++t) {
      weights[t - begin] = corner_weights(positions, triangles[t]);
    }
  }
}

}  // namespace kiln
