// Charts as flat meshes: cuts them open, projects, checks and measures them. The solvers are in flat_solvers.cpp.
#include "unwrap/flat_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "mesh/half_edge.h"
#include "unwrap/flat_predicates.h"

namespace kiln {
namespace {

/// Minimum ratio of a triangle's height to its longest side. Flatter triangles (needles) are treated as if they had
/// this height.
constexpr double kMinHeightRatio = 2e-3;
/// Ratio of FlatChart::roughness_energy to the variance of the chart's bends. It was measured on rough balls, with the
/// energy of their best layouts.
constexpr double kRoughnessEnergyFactor = 3.5;
/// Relative increase of the limit on single triangles' distortion, for each unit of FlatChart::roughness_energy.
constexpr double kRoughnessStretchFactor = 6;
/// Minimum distance between border edges, as a share of the square root of the surface's area. It corresponds to a few
/// UV steps (kUvSteps).
constexpr double kMinBorderDistance = 1e-6;

/// Corners of a triangle in its own plane, counter-clockwise, with its longest side along x.
std::array<Vec2d, 3> rest_points(const ChartSurface& surface, std::uint32_t t) {
  std::uint32_t base = 0;  // Corner at which the longest side starts
  for (std::uint32_t k = 1; k < 3; ++k) {
    if (surface.length[3 * t + k] > surface.length[3 * t + base]) base = k;
  }
  const auto at = [&](std::uint32_t k) {
    return surface.positions[surface.triangles[t][(base + k) % 3]];
  };
  const double side = surface.length[3 * t + base];
  const Vec3d side_direction = (at(1) - at(0)) * (1 / side);
  const double foot = dot(at(2) - at(0), side_direction);
  const double height = std::max(2 * surface.area[t] / side, kMinHeightRatio * side);
  std::array<Vec2d, 3> points{};
  points[base] = {0, 0};
  points[(base + 1) % 3] = {side, 0};
  points[(base + 2) % 3] = {foot, height};
  return points;
}

RestShape rest_shape(const std::array<Vec2d, 3>& p) {
  RestShape rest;
  rest.area = 0.5 * cross(p[1] - p[0], p[2] - p[0]);
  for (std::uint32_t k = 0; k < 3; ++k) {
    const Vec2d opposite = p[(k + 2) % 3] - p[(k + 1) % 3];
    rest.gradient[k] = {-opposite.y / (2 * rest.area), opposite.x / (2 * rest.area)};
  }
  return rest;
}

/// Which edges are glued: see cut_open().
struct GluedEdges {
  std::span<const std::uint8_t> glued, inverted;
  bool operator[](std::uint32_t h) const {
    return glued[h] != (inverted.empty() ? 0 : inverted[h]);
  }
};

/// The half-edges of the border in order. At each vertex, rotates over glued edges to the next open half-edge.
std::vector<std::uint32_t> border_of(const ChartSurface& surface, const GluedEdges& glued,
                                     std::uint32_t first) {
  std::vector<std::uint32_t> border;
  std::uint32_t h = first;
  do {
    border.push_back(h);
    h = next_half_edge(h);
    while (glued[h]) h = next_half_edge(surface.mate[h]);
  } while (h != first);
  return border;
}

/// Length of the chart along the longest of eight directions, which is at least 0.98 times the chart's diameter.
double length_of(const FlatChart& chart) {
  constexpr int kDirections = 8;
  double longest = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = std::numbers::pi * i / kDirections;
    const Vec2d direction{std::cos(angle), std::sin(angle)};
    double min_coordinate = std::numeric_limits<double>::infinity(),
           max_coordinate = -min_coordinate;
    for (const std::uint32_t v : chart.boundary) {
      min_coordinate = std::min(min_coordinate, dot(direction, chart.points[v]));
      max_coordinate = std::max(max_coordinate, dot(direction, chart.points[v]));
    }
    longest = std::max(longest, max_coordinate - min_coordinate);
  }
  return longest;
}

}  // namespace

FlatChart cut_open(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                   std::span<const std::uint8_t> glued_by,
                   std::vector<std::uint32_t>& index_in_chart,
                   std::span<const std::uint8_t> other_by, std::vector<RestShape> rest) {
  const GluedEdges glued{glued_by, other_by};
  FlatChart chart;
  chart.source.assign(triangles.begin(), triangles.end());
  const auto count = static_cast<std::uint32_t>(triangles.size());
  for (std::uint32_t i = 0; i < count; ++i) index_in_chart[triangles[i]] = i;
  std::vector<std::uint32_t> root(std::size_t{count} * 3);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t c) {
    while (root[c] != c) c = root[c] = root[root[c]];
    return c;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    root[std::max(a, b)] = std::min(a, b);
  };
  std::uint32_t open = kNoIndex;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * triangles[i] + k;
      if (!glued[h]) {
        if (open == kNoIndex) open = h;
        continue;
      }
      const std::uint32_t m = surface.mate[h];
      if (m < h) continue;
      const std::uint32_t other = 3 * index_in_chart[m / 3];
      join(3 * i + k, other + (m % 3 + 1) % 3);
      join(3 * i + (k + 1) % 3, other + m % 3);
    }
  }
  std::vector<std::uint32_t> new_vertex(root.size());
  chart.triangles.resize(count);
  for (std::uint32_t c = 0; c < root.size(); ++c) {
    const std::uint32_t r = find(c);
    if (r == c) {
      new_vertex[c] = static_cast<std::uint32_t>(chart.vertex.size());
      chart.vertex.push_back(surface.triangles[triangles[c / 3]][c % 3]);
    }
    chart.triangles[c / 3][c % 3] = new_vertex[r];
  }
  double area = 0, bend = 0, bend_squared = 0;
  const bool is_known = rest.size() == count;
  chart.rest = std::move(rest);
  chart.rest.reserve(count);
  for (const std::uint32_t t : triangles) {
    if (!is_known) chart.rest.push_back(rest_shape(rest_points(surface, t)));
    area += surface.area[t];
    bend += surface.area[t] * surface.bend[t];
    bend_squared += surface.area[t] * surface.bend_squared[t];
  }
  bend /= area, bend_squared /= area;
  // Only the variance of bends counts as roughness. A uniform bend is part of the shape, and cuts can remove it.
  chart.roughness_energy = kRoughnessEnergyFactor * std::max(0.0, bend_squared - bend * bend);
  for (const std::uint32_t h : border_of(surface, glued, open)) {
    chart.boundary.push_back(chart.triangles[index_in_chart[h / 3]][h % 3]);
  }
  chart.points.resize(chart.vertex.size());
  chart.min_border_distance = kMinBorderDistance * std::sqrt(surface.total_area);
  return chart;
}

bool is_disc(const FlatChart& chart) {
  return 2 * chart.points.size() == 2 + chart.triangles.size() + chart.boundary.size();
}

void project_to_mean_plane(FlatChart& chart, const ChartSurface& surface) {
  Vec3d n{};
  for (const std::uint32_t t : chart.source) n += surface.normal[t] * surface.area[t];
  const double size = length(n);
  n = size > 0 ? n * (1 / size) : Vec3d{0, 0, 1};
  const Vec3d helper = std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d u = cross(helper, n);
  u = u * (1 / length(u));
  const Vec3d v = cross(n, u);
  for (std::size_t i = 0; i < chart.vertex.size(); ++i) {
    const Vec3d& p = surface.positions[chart.vertex[i]];
    chart.points[i] = {dot(p, u), dot(p, v)};
  }
}

void lay_out_triangle(FlatChart& chart, const ChartSurface& surface) {
  const std::array<Vec2d, 3> points = rest_points(surface, chart.source[0]);
  for (std::size_t k = 0; k < 3; ++k) chart.points[chart.triangles[0][k]] = points[k];
}

bool is_injective(const FlatChart& chart, double min_distance) {
  for (const Triangle& t : chart.triangles) {
    if (!orient2d_certain(chart.points[t[0]], chart.points[t[1]], chart.points[t[2]])) return false;
  }
  std::vector<Vec2d> border;
  border.reserve(chart.boundary.size());
  for (const std::uint32_t v : chart.boundary) border.push_back(chart.points[v]);
  return is_simple(border, min_distance);
}

FlatDistortion distortion(const FlatChart& chart) {
  FlatDistortion result;
  double area = 0, sum = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    Vec2d du{}, dv{};  // Rows of the Jacobian
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d& p = chart.points[chart.triangles[i][k]];
      du = du + chart.rest[i].gradient[k] * p.x;
      dv = dv + chart.rest[i].gradient[k] * p.y;
    }
    const double det = cross(du, dv);
    if (!(det > 0))
      return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    const double squares = dot(du, du) + dot(dv, dv);
    area += chart.rest[i].area;
    sum += chart.rest[i].area * (squares * (1 + 1 / (det * det)) / 4 - 1);
    const double a =
        0.5 * (std::sqrt(squares + 2 * det) + std::sqrt(std::max(0.0, squares - 2 * det)));
    result.max_stretch = std::max({result.max_stretch, a, a / det});
  }
  result.energy = sum / area;
  return result;
}

bool is_short(const FlatChart& chart, const ChartLimits& limits) {
  if (std::isinf(limits.length) || length_of(chart) <= limits.length) return true;
  // A chart that is as long as one of its edges cannot be shortened by cuts.
  constexpr double kMaxEdgeRatio = 1.1;
  double longest = 0;
  for (const Triangle& t : chart.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d edge = chart.points[t[(k + 1) % 3]] - chart.points[t[k]];
      longest = std::max(longest, std::hypot(edge.x, edge.y));
    }
  }
  return length_of(chart) <= kMaxEdgeRatio * longest;
}

bool is_within_limits(const FlatChart& chart, const ChartLimits& limits) {
  if (!is_short(chart, limits)) return false;
  const FlatDistortion d = distortion(chart);
  return d.energy <= limits.energy + chart.roughness_energy &&
         d.max_stretch <=
             limits.max_stretch * (1 + kRoughnessStretchFactor * chart.roughness_energy);
}

double flat_area(const FlatChart& chart) {
  double area = 0;
  for (const Triangle& t : chart.triangles) {
    const Vec2d& a = chart.points[t[0]];
    area += 0.5 * cross(chart.points[t[1]] - a, chart.points[t[2]] - a);
  }
  return area;
}

void scale_to_surface_area(FlatChart& chart) {
  double area = 0;
  for (const auto& rest : chart.rest) area += rest.area;
  const double flat = flat_area(chart);
  if (!(flat > 0)) return;
  const double scale = std::sqrt(area / flat);
  for (Vec2d& p : chart.points) p = p * scale;
}

}  // namespace kiln
