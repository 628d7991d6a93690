#include "unwrap/chart_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "mesh/box.h"
#include "mesh/half_edge.h"
#include "mesh/usable.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Half-edges stay unpaired at edges that more triangles than this share.
constexpr std::size_t kMaxPairedTriangles = 32;

/// Pairs the half-edges at an edge of more than two triangles. The two whose triangles enclose the smallest angle
/// between their normals are paired first. So each of the surfaces that touch at the edge continues smoothly across it.
void pair_by_bend(ChartSurface& surface,
                  std::span<const std::pair<std::uint64_t, std::uint32_t>> edges) {
  struct PairBend {
    double cosine = 0;
    std::uint32_t a = 0, b = 0;
  };
  std::vector<PairBend> bends;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    for (std::size_t j = i + 1; j < edges.size(); ++j) {
      const std::uint32_t a = edges[i].second, b = edges[j].second;
      if (start_of(surface, a) != end_of(surface, b)) continue;
      bends.push_back({dot(surface.normal[a / 3], surface.normal[b / 3]), a, b});
    }
  }
  std::stable_sort(bends.begin(), bends.end(),
                   [](const PairBend& p, const PairBend& q) { return p.cosine > q.cosine; });
  for (const PairBend& bend : bends) {
    if (surface.mate[bend.a] != kNoIndex || surface.mate[bend.b] != kNoIndex) continue;
    surface.mate[bend.a] = bend.b;
    surface.mate[bend.b] = bend.a;
  }
}

/// Pairs opposite half-edges, which run along an edge in opposite directions.
/// \returns 1 for each vertex on an edge of more than two triangles
std::vector<std::uint8_t> find_mates(ChartSurface& surface) {
  std::vector<std::uint8_t> is_on_shared_edge(surface.positions.size(), 0);
  const std::size_t count = surface.triangles.size() * 3;
  surface.mate.assign(count, kNoIndex);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges(count);
  for (std::uint32_t h = 0; h < count; ++h) {
    const std::uint64_t a = start_of(surface, h), b = end_of(surface, h);
    edges[h] = {std::min(a, b) << 32 | std::max(a, b), h};
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < count;) {
    std::size_t end = i + 1;
    while (end < count && edges[end].first == edges[i].first) ++end;
    const std::uint32_t a = edges[i].second, b = edges[end - 1].second;
    if (end - i == 2 && start_of(surface, a) == end_of(surface, b)) {
      surface.mate[a] = b;
      surface.mate[b] = a;
    } else if (end - i > 2) {
      is_on_shared_edge[start_of(surface, a)] = is_on_shared_edge[end_of(surface, a)] = 1;
      if (end - i <= kMaxPairedTriangles)
        pair_by_bend(surface, std::span(edges).subspan(i, end - i));
    }
    i = end;
  }
  return is_on_shared_edge;
}

void measure_triangles(ChartSurface& surface) {
  surface.length.resize(surface.triangles.size() * 3);
  for (std::uint32_t h = 0; h < surface.length.size(); ++h) {
    surface.length[h] =
        length(surface.positions[end_of(surface, h)] - surface.positions[start_of(surface, h)]);
  }
  for (const Triangle& t : surface.triangles) {
    const Vec3d& a = surface.positions[t[0]];
    const Vec3d n = cross(surface.positions[t[1]] - a, surface.positions[t[2]] - a);
    const double doubled = length(n);
    surface.area.push_back(0.5 * doubled);
    surface.normal.push_back(doubled > 0 ? n * (1 / doubled) : Vec3d{0, 0, 1});
    surface.total_area += surface.area.back();
  }
}

/// Computes the bend at each vertex from the angles around it. A vertex at which several fans meet is treated as one
/// vertex.
/// \param open  1 for each vertex whose angle sum is undefined; border vertices are added here
void find_bends(ChartSurface& surface, std::vector<std::uint8_t> open) {
  constexpr double kMinAngle = 0.1;
  const std::size_t count = surface.positions.size();
  std::vector<double> vertex_bend(count, 0);
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    const double to = surface.length[h], from = surface.length[previous_half_edge(h)],
                 across = surface.length[next_half_edge(h)];
    const double cosine = (to * to + from * from - across * across) / (2 * to * from);
    vertex_bend[start_of(surface, h)] += std::acos(std::clamp(cosine, -1.0, 1.0));
    if (surface.mate[h] == kNoIndex) open[start_of(surface, h)] = open[end_of(surface, h)] = 1;
  }
  for (std::size_t v = 0; v < count; ++v) {
    vertex_bend[v] =
        open[v] != 0 ? 0 : std::log(std::max(vertex_bend[v] / (2 * std::numbers::pi), kMinAngle));
  }
  for (const Triangle& t : surface.triangles) {
    const double a = vertex_bend[t[0]], b = vertex_bend[t[1]], c = vertex_bend[t[2]];
    surface.bend.push_back((a + b + c) / 3);
    surface.bend_squared.push_back((a * a + b * b + c * c) / 3);
  }
}

}  // namespace

void measure_surface(ChartSurface& surface) {
  measure_triangles(surface);
  find_bends(surface, std::vector<std::uint8_t>(surface.positions.size(), 0));
}

ChartSurface chart_surface(const Mesh& mesh) {
  ChartSurface surface;
  const std::vector<std::uint32_t> welded_vertex = weld_vertices(mesh.positions);
  Box<Vec3d> box;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!has_area(mesh.positions, mesh.triangles[t])) continue;
    surface.source.push_back(t);
    for (const std::uint32_t v : mesh.triangles[t]) box.add(to_double(mesh.positions[v]));
  }
  if (surface.source.empty()) return surface;
  const Vec3d size = box.size();
  const double extent = std::max({size.x, size.y, size.z});
  const double scale = std::ldexp(1.0, -std::ilogb(extent));
  const auto moved_position = [&](std::uint32_t v) {
    return (to_double(mesh.positions[v]) - box.low) * scale;
  };
  // Triangles near the origin may be so small that moving them to the new origin rounds all their corners to one point,
  // as at the pole of a sphere where sin(pi) is 1e-16. Such triangles have no shape to lay out.
  std::erase_if(surface.source, [&](std::uint32_t t) {
    const Triangle& c = mesh.triangles[t];
    return length(moved_position(c[0]) - moved_position(c[1])) == 0 &&
           length(moved_position(c[0]) - moved_position(c[2])) == 0;
  });
  std::vector<std::uint32_t> new_vertex(mesh.positions.size(), kNoIndex);
  for (const std::uint32_t t : surface.source) {
    Triangle corners = mesh.triangles[t];
    for (std::uint32_t& corner : corners) {
      std::uint32_t& index = new_vertex[welded_vertex[corner]];
      if (index == kNoIndex) {
        index = static_cast<std::uint32_t>(surface.positions.size());
        surface.positions.push_back(moved_position(welded_vertex[corner]));
      }
      corner = index;
    }
    surface.triangles.push_back(corners);
  }
  measure_triangles(surface);
  find_bends(surface, find_mates(surface));
  return surface;
}

}  // namespace kiln
