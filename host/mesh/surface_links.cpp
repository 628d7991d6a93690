#include "mesh/surface_links.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "mesh/kernels_shared.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Maximum number of triangles that a walk may cross.
constexpr int kMaxWalkTriangles = 64;

struct LinkSide {
  std::uint32_t low, high;  // Vertices of the edge
  std::uint32_t triangle;
  std::uint8_t edge;    // Corner opposite the edge
  bool runs_to_higher;  // True if the side runs from the lower to the higher vertex
};

std::uint32_t root_of_link(std::vector<std::uint32_t>& parent, std::uint32_t triangle) {
  while (parent[triangle] != triangle) {
    parent[triangle] = parent[parent[triangle]];
    triangle = parent[triangle];
  }
  return triangle;
}

bool same_uv(const Vec2& a, const Vec2& b) { return a.x == b.x && a.y == b.y; }

using BarycentricWeights = std::array<double, 3>;

/// Barycentric coordinates of a point in a triangle's UVs. Returns false if the UVs have no area.
bool uv_weights(const std::array<LowSurface::Corner, 3>& corners, const std::array<double, 2>& at,
                BarycentricWeights& weights) {
  const Vec2& a = corners[0].uv;
  const double ux = double{corners[1].uv.x} - a.x;
  const double uy = double{corners[1].uv.y} - a.y;
  const double vx = double{corners[2].uv.x} - a.x;
  const double vy = double{corners[2].uv.y} - a.y;
  const double area = ux * vy - uy * vx;
  if (!std::isfinite(area) || area == 0) return false;
  const double x = at[0] - a.x;
  const double y = at[1] - a.y;
  weights[1] = (x * vy - y * vx) / area;
  weights[2] = (ux * y - uy * x) / area;
  weights[0] = 1 - weights[1] - weights[2];
  return true;
}

Vec3d point_at(const std::array<LowSurface::Corner, 3>& corners,
               const BarycentricWeights& weights) {
  return to_double(corners[0].position) * weights[0] + to_double(corners[1].position) * weights[1] +
         to_double(corners[2].position) * weights[2];
}

/// Barycentric coordinates of a point in the plane of a triangle.
BarycentricWeights plane_weights(const std::array<LowSurface::Corner, 3>& corners,
                                 const Vec3d& point) {
  const Vec3d a = to_double(corners[0].position);
  const Vec3d b = to_double(corners[1].position) - a;
  const Vec3d c = to_double(corners[2].position) - a;
  const Vec3d normal = cross(b, c);
  const double scale = 1 / dot(normal, normal);
  const Vec3d p = point - a;
  BarycentricWeights weights{};
  weights[1] = dot(cross(p, c), normal) * scale;
  weights[2] = dot(cross(b, p), normal) * scale;
  weights[0] = 1 - weights[1] - weights[2];
  return weights;
}

/// A unit vector along an edge, and one perpendicular to it in the triangle's plane, which points outwards.
struct EdgeFrame {
  Vec3d along{}, outward{};
  EdgeFrame(const std::array<LowSurface::Corner, 3>& corners, std::size_t edge) {
    const Vec3d from = to_double(corners[(edge + 1) % 3].position);
    const Vec3d to = to_double(corners[(edge + 2) % 3].position);
    const Vec3d apex = to_double(corners[edge].position);
    const Vec3d side = to - from;
    along = side * (1 / length(side));
    const Vec3d inward = (apex - from) - along * dot(apex - from, along);
    outward = inward * (-1 / length(inward));
  }
};

}  // namespace

SurfaceTopology SurfaceTopology::of(const LowSurface& surface) {
  const std::size_t count = surface.triangles.size();
  std::vector<Vec3> corner_positions(3 * count);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k)
      corner_positions[3 * t + k] = surface.triangles[t][k].position;
  }
  const std::vector<std::uint32_t> weld = weld_vertices(corner_positions);
  SurfaceTopology topology;
  topology.vertices.resize(count);
  topology.neighbour.assign(count, {KILN_NO_TRIANGLE, KILN_NO_TRIANGLE, KILN_NO_TRIANGLE});
  std::vector<std::uint32_t> vertex_numbers(corner_positions.size(), 0);
  for (std::size_t i = 0; i < corner_positions.size(); ++i) {
    vertex_numbers[i] = weld[i] == i ? topology.vertex_count++ : vertex_numbers[weld[i]];
    topology.vertices[i / 3][i % 3] = vertex_numbers[i];
  }

  std::vector<LinkSide> sides;
  sides.reserve(3 * count);
  for (const std::uint32_t t : surface.usable_triangles()) {
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t from = topology.vertices[t][(k + 1U) % 3];
      const std::uint32_t to = topology.vertices[t][(k + 2U) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), t, k, from < to});
    }
  }
  std::stable_sort(sides.begin(), sides.end(), [](const LinkSide& a, const LinkSide& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  std::vector<std::uint32_t> parent(count);
  for (std::uint32_t t = 0; t < count; ++t) parent[t] = t;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low &&
           sides[end].high == sides[i].high) {
      ++end;
    }
    if (end - i == 2 && sides[i].runs_to_higher != sides[i + 1].runs_to_higher) {
      const LinkSide& a = sides[i];
      const LinkSide& b = sides[i + 1];
      topology.neighbour[a.triangle][a.edge] = b.triangle;
      topology.neighbour[b.triangle][b.edge] = a.triangle;
      const auto& x = surface.triangles[a.triangle];
      const auto& y = surface.triangles[b.triangle];
      if (same_uv(x[(a.edge + 1U) % 3].uv, y[(b.edge + 2U) % 3].uv) &&
          same_uv(x[(a.edge + 2U) % 3].uv, y[(b.edge + 1U) % 3].uv)) {
        const auto [low, high] =
            std::minmax({root_of_link(parent, a.triangle), root_of_link(parent, b.triangle)});
        parent[high] = low;
      }
    }
    i = end;
  }
  std::uint32_t charts = 0;
  topology.chart.resize(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t first = root_of_link(parent, t);
    topology.chart[t] = first == t ? charts++ : topology.chart[first];
  }
  return topology;
}

SurfacePlace walk_surface(const LowSurface& surface, const SurfaceTopology& topology,
                          std::uint32_t triangle, const std::array<double, 2>& from,
                          const std::array<double, 2>& to) {
  const auto* corners = &surface.triangles[triangle];
  BarycentricWeights at{};
  BarycentricWeights target_weights{};
  if (!uv_weights(*corners, from, at) || !uv_weights(*corners, to, target_weights)) return {};
  std::size_t entry_edge = 3;  // Edge at which the walk entered the triangle
  for (int step = 0; step < kMaxWalkTriangles; ++step) {
    std::size_t exit_edge = 3;
    double share = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == entry_edge || !(target_weights[k] < 0)) continue;
      const double inside = std::max(0.0, at[k]);
      const double cut = inside / (inside - target_weights[k]);
      if (cut < share) {
        share = cut;
        exit_edge = k;
      }
    }
    if (exit_edge == 3) {
      double u = 0;
      double v = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        u += target_weights[k] * (*corners)[k].uv.x;
        v += target_weights[k] * (*corners)[k].uv.y;
      }
      return {triangle, u, v};
    }
    const std::uint32_t next = topology.neighbour[triangle][exit_edge];
    if (next == KILN_NO_TRIANGLE) return {};
    std::size_t entry_edge_of_next = 0;
    while (entry_edge_of_next < 3 && (topology.neighbour[next][entry_edge_of_next] != triangle ||
                                      topology.vertices[next][(entry_edge_of_next + 1) % 3] !=
                                          topology.vertices[triangle][(exit_edge + 2) % 3])) {
      ++entry_edge_of_next;
    }
    if (entry_edge_of_next == 3) return {};
    const Vec3d start = point_at(*corners, at);
    const Vec3d to_target = point_at(*corners, target_weights) - start;
    const Vec3d crossing = start + to_target * share;
    const Vec3d remaining_step = to_target * (1 - share);
    const EdgeFrame edge_frame(*corners, exit_edge);
    corners = &surface.triangles[next];
    // Across the edge, the component along the edge is unchanged, whatever the next triangle's orientation. The
    // perpendicular component changes from outwards to inwards.
    const EdgeFrame next_frame(*corners, entry_edge_of_next);
    const double across = dot(remaining_step, edge_frame.outward);
    const Vec3d goal_point = crossing + edge_frame.along * dot(remaining_step, edge_frame.along) -
                             next_frame.outward * across;
    at = plane_weights(*corners, crossing);
    target_weights = plane_weights(*corners, goal_point);
    triangle = next;
    entry_edge = entry_edge_of_next;
  }
  return {};
}

TexelLinks TexelLinks::of(const LowSurface& surface, const SurfaceTopology& topology,
                          std::span<const std::uint32_t> texel_triangle, std::uint32_t width,
                          std::uint32_t height, std::uint32_t first_row) {
  constexpr int kSteps[8][2] = {{-1, 0},  {1, 0},  {0, -1}, {0, 1},
                                {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
  const auto w = static_cast<std::int64_t>(width);
  const std::size_t rows = texel_triangle.size() / width;
  const auto h = static_cast<std::int64_t>(rows);
  constexpr std::uint32_t kNoChart = 0xFFFFFFFFU;
  const auto chart_at = [&](std::int64_t x, std::int64_t y) {
    if (x < 0 || y < 0 || x >= w || y >= h) return kNoChart;
    const std::uint32_t triangle = texel_triangle[static_cast<std::size_t>(y * w + x)];
    return triangle == KILN_NO_TRIANGLE ? kNoChart : topology.chart[triangle];
  };
  /// The texel of a chart that contains a point, or else the nearest one beside it.
  const auto texel_at = [&](const SurfacePlace& place) {
    if (place.triangle == KILN_NO_TRIANGLE) return KILN_VISIBILITY_NO_LINK;
    const double px = place.u * static_cast<double>(width);
    const double py = (1 - place.v) * static_cast<double>(height) - first_row;
    if (!(px > -2 && py > -2 && px < static_cast<double>(w + 2) && py < static_cast<double>(h + 2)))
      return KILN_VISIBILITY_NO_LINK;
    const auto x = static_cast<std::int64_t>(std::floor(px));
    const auto y = static_cast<std::int64_t>(std::floor(py));
    const std::uint32_t chart = topology.chart[place.triangle];
    if (chart_at(x, y) == chart) return static_cast<std::uint32_t>(y * w + x);
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t nearest_texel = KILN_VISIBILITY_NO_LINK;
    for (std::int64_t j = y - 1; j <= y + 1; ++j) {
      for (std::int64_t i = x - 1; i <= x + 1; ++i) {
        if (chart_at(i, j) != chart) continue;
        const double dx = static_cast<double>(i) + 0.5 - px;
        const double dy = static_cast<double>(j) + 0.5 - py;
        if (dx * dx + dy * dy < nearest) {
          nearest = dx * dx + dy * dy;
          nearest_texel = static_cast<std::uint32_t>(j * w + i);
        }
      }
    }
    return nearest_texel;
  };

  TexelLinks result;
  result.kind.assign(texel_triangle.size(), KILN_VISIBILITY_EMPTY);
  constexpr std::size_t kRowsPerTask = 16;
  std::vector<std::vector<std::uint32_t>> links_of_tasks((rows + kRowsPerTask - 1) / kRowsPerTask);
  parallel_for(rows, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
    // All rows may be processed by a single thread.
    std::vector<std::uint32_t>& part = links_of_tasks[begin / kRowsPerTask];
    for (auto y = static_cast<std::int64_t>(begin); y < static_cast<std::int64_t>(end); ++y) {
      for (std::int64_t x = 0; x < w; ++x) {
        const std::uint32_t chart = chart_at(x, y);
        if (chart == kNoChart) continue;
        const auto texel = static_cast<std::size_t>(y * w + x);
        bool is_inner = true;
        const std::uint32_t own = texel_triangle[texel];
        const bool within = x > 0 && y > 0 && x + 1 < w && y + 1 < h;
        for (const auto& [dx, dy] : kSteps) {
          // Fast path: most neighbouring texels lie on the same triangle.
          if (within && texel_triangle[static_cast<std::size_t>((y + dy) * w + x + dx)] == own) {
            continue;
          }
          is_inner = is_inner && chart_at(x + dx, y + dy) == chart;
        }
        result.kind[texel] = is_inner ? KILN_VISIBILITY_INNER : KILN_VISIBILITY_BORDER;
        if (is_inner) continue;
        const auto place = [&](std::int64_t i, std::int64_t j) -> std::array<double, 2> {
          return {(static_cast<double>(i) + 0.5) / static_cast<double>(width),
                  1 - (static_cast<double>(j) + first_row + 0.5) / static_cast<double>(height)};
        };
        part.push_back(static_cast<std::uint32_t>(texel));
        for (const auto& [dx, dy] : kSteps) {
          if (chart_at(x + dx, y + dy) == chart) {
            part.push_back(static_cast<std::uint32_t>((y + dy) * w + x + dx));
          } else {
            part.push_back(texel_at(walk_surface(surface, topology, texel_triangle[texel],
                                                 place(x, y), place(x + dx, y + dy))));
          }
        }
      }
    }
  });
  for (const std::vector<std::uint32_t>& part : links_of_tasks) {
    result.links.insert(result.links.end(), part.begin(), part.end());
  }
  return result;
}

}  // namespace kiln
