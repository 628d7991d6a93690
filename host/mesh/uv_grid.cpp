#include "mesh/uv_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln {
namespace {

constexpr double kPrismLow = -1;
constexpr double kPrismHigh = 2;

/// Intersection of an edge with the line u = bound or v = bound. The end points are sorted first, so that the triangles
/// on both sides of the edge get the same point.
ClipVertex crossing(ClipVertex a, ClipVertex b, double ClipVertex::*axis, double bound) {
  if (b.u < a.u || (b.u == a.u && b.v < a.v)) std::swap(a, b);
  const double t = (bound - a.*axis) / (b.*axis - a.*axis);
  ClipVertex result;
  result.u = a.u + (b.u - a.u) * t;
  result.v = a.v + (b.v - a.v) * t;
  for (std::size_t k = 0; k < 3; ++k) {
    result.weight[k] = a.weight[k] + (b.weight[k] - a.weight[k]) * t;
  }
  result.*axis = bound;
  return result;
}

/// Clips a polygon by a half-plane (Sutherland and Hodgman 1974). Keeps the part where sign * (vertex.axis - bound) >=
/// 0.
std::vector<ClipVertex> clip(const std::vector<ClipVertex>& polygon, double ClipVertex::*axis,
                             double bound, double sign) {
  std::vector<ClipVertex> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const ClipVertex& a = polygon[i];
    const ClipVertex& b = polygon[(i + 1) % polygon.size()];
    const bool a_stays = sign * (a.*axis - bound) >= 0;
    const bool b_stays = sign * (b.*axis - bound) >= 0;
    if (a_stays) result.push_back(a);
    if (a_stays != b_stays) result.push_back(crossing(a, b, axis, bound));
  }
  return result;
}

}  // namespace

SampleRange samples_within(std::int64_t low, std::int64_t high, std::uint32_t shift,
                           std::uint32_t count) {
  const std::int64_t half = std::int64_t{1} << (shift - 1);
  const std::int64_t first = (low - half + (std::int64_t{1} << shift) - 1) >> shift;
  const std::int64_t last = (high - half) >> shift;
  return {std::max<std::int64_t>(first, 0), std::min<std::int64_t>(last, std::int64_t{count} - 1)};
}

SampleRange rows_of(const FixedPointTriangle& triangle, std::uint32_t shift, std::uint32_t count) {
  const auto [low, high] = std::minmax_element(triangle.y.begin(), triangle.y.end());
  return samples_within(*low, *high, shift, count);
}

std::int64_t doubled_area(const FixedPointTriangle& f) {
  return (std::int64_t{f.x[1]} - f.x[0]) * (std::int64_t{f.y[2]} - f.y[0]) -
         (std::int64_t{f.y[1]} - f.y[0]) * (std::int64_t{f.x[2]} - f.x[0]);
}

UvGrid UvGrid::of(std::uint32_t sample_width, std::uint32_t sample_height) {
  return {
      sample_width, sample_height,
      static_cast<std::uint32_t>(28 - std::bit_width(std::max(sample_width, sample_height) - 1))};
}

std::int32_t UvGrid::fixed_x(double u) const {
  const auto unit = static_cast<double>(std::int64_t{sample_width} << shift);
  return static_cast<std::int32_t>(std::nearbyint(u * unit));
}

std::int32_t UvGrid::fixed_y(double v) const {
  const std::int64_t unit = std::int64_t{sample_height} << shift;
  return static_cast<std::int32_t>(
      unit - static_cast<std::int64_t>(std::nearbyint(v * static_cast<double>(unit))));
}

bool UvGrid::is_beyond_square(const FixedPointTriangle& f) const {
  const std::int64_t right_edge = std::int64_t{sample_width} << shift;
  const std::int64_t bottom_edge = std::int64_t{sample_height} << shift;
  for (std::size_t k = 0; k < 3; ++k) {
    if (f.x[k] < 0 || f.x[k] > right_edge || f.y[k] < 0 || f.y[k] > bottom_edge) return true;
  }
  return false;
}

bool UvGrid::is_outside_square(const FixedPointTriangle& f) const {
  const std::int64_t right_edge = std::int64_t{sample_width} << shift;
  const std::int64_t bottom_edge = std::int64_t{sample_height} << shift;
  const auto [x_low, x_high] = std::minmax_element(f.x.begin(), f.x.end());
  const auto [y_low, y_high] = std::minmax_element(f.y.begin(), f.y.end());
  return *x_high <= 0 || *x_low >= right_edge || *y_high <= 0 || *y_low >= bottom_edge;
}

bool in_prism(const Vec2& uv) {
  return uv.x >= kPrismLow && uv.x <= kPrismHigh && uv.y >= kPrismLow && uv.y <= kPrismHigh;
}

std::vector<ClipVertex> clip_to_prism(const std::array<Vec2, 3>& uvs) {
  std::vector<ClipVertex> polygon(3);
  for (std::size_t k = 0; k < 3; ++k) {
    polygon[k].u = uvs[k].x;
    polygon[k].v = uvs[k].y;
    polygon[k].weight[k] = 1;
  }
  polygon = clip(polygon, &ClipVertex::u, kPrismLow, 1);
  polygon = clip(polygon, &ClipVertex::u, kPrismHigh, -1);
  polygon = clip(polygon, &ClipVertex::v, kPrismLow, 1);
  return clip(polygon, &ClipVertex::v, kPrismHigh, -1);
}

}  // namespace kiln
