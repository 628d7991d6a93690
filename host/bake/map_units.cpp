#include "bake/map_units.h"

#include <array>
#include <cmath>
#include <numbers>

#include "base/cube_root.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// CIELAB coordinates of a linear sRGB colour (D65 white; IEC 61966-2-1, CIE 15).
Vec3d to_cielab(const float* rgb) {
  const double r = rgb[0], g = rgb[1], b = rgb[2];
  const std::array<double, 3> xyz{(0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505,
                                  0.2126 * r + 0.7152 * g + 0.0722 * b,
                                  (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089};
  const auto root = [](double t) {
    constexpr double kLabLinearLimit = 6.0 / 29;
    return t > kLabLinearLimit * kLabLinearLimit * kLabLinearLimit
               ? cube_root(t)
               : t / (3 * kLabLinearLimit * kLabLinearLimit) + 4.0 / 29;
  };
  const double x = root(xyz[0]), y = root(xyz[1]), z = root(xyz[2]);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

}  // namespace

MapUnit unit_of(const MapRow& row) {
  if (row.info.type == MapType::unit_vector) return {"degrees", 1};
  if (row.info.type == MapType::color) return {"ΔE", 1};
  if (!row.unit.empty()) return {row.unit, 1};
  return {"1/255", 255};
}

double map_difference(const MapRow& row, const float* a, const float* b) {
  const MapInfo& map = row.info;
  if (map.type == MapType::unit_vector) {
    const Vec3d p(a[0], a[1], a[2]), q(b[0], b[1], b[2]);
    return std::atan2(length(cross(p, q)), dot(p, q)) * 180 / std::numbers::pi;
  }
  if (map.type == MapType::color && map.channels >= 3) {
    const double alpha = map.channels > 3 ? 100 * (double{a[3]} - b[3]) : 0;
    return std::hypot(length(to_cielab(a) - to_cielab(b)), alpha);
  }
  double squared_sum = 0;
  const std::uint32_t compared_channels = row.compared_channels;
  for (std::uint32_t c = 0; c < (compared_channels != 0 ? compared_channels : map.channels); ++c) {
    const double difference = double{a[c]} - b[c];
    squared_sum += difference * difference;
  }
  return std::sqrt(squared_sum) * unit_of(row).scale;
}

}  // namespace kiln
