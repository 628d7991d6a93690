#include "detail/value_ranges.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "detail/registry.h"
#include "mesh/curvature.h"
#include "mesh/length.h"

namespace kiln {
namespace {

/// Tolerance below which a multiple counts as a whole number in spite of rounding.
constexpr double kMultipleTolerance = 1e-9;

double power_of_ten_below(double value) { return std::pow(10.0, std::floor(std::log10(value))); }

/// Rounds up to two significant digits.
float rounded_up(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 0;
  const double step = power_of_ten_below(value) / 10;
  const double rounded = std::ceil(value / step - kMultipleTolerance) * step;
  return static_cast<float>(std::min(rounded, double{std::numeric_limits<float>::max()}));
}

ValueRange symmetric_range(float bound) { return {-bound, bound}; }

}  // namespace

ValueRange range_of_bounds(const RangeRequest& request, std::uint32_t channel) {
  const Source::Impl& source = request.source;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Triangle& triangle : source.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Vec3& p = source.positions[corner];
      if (!is_finite(p)) continue;
      const double at = channel == 0 ? p.x : channel == 1 ? p.y : p.z;
      low = std::min(low, at);
      high = std::max(high, at);
    }
  }
  if (!(low <= high)) return {0, 0};
  const Frame& frame = source.frame;
  const double step = power_of_ten_below(frame.diagonal) / 10;
  const double origin = map_origin(request.options, frame)[channel];
  const auto to_world = [&](double at) {
    return at / frame.scale + (frame.center[channel] - origin);
  };
  // Tolerance for the rounding of positions in the frame and of values in the map.
  const double slack = kMultipleTolerance + 1e-6 * frame.diagonal / step;
  const auto first = static_cast<float>(std::floor(to_world(low) / step + slack) * step);
  const auto last = static_cast<float>(std::ceil(to_world(high) / step - slack) * step);
  // If all values are equal, as on a flat mesh, the range extends to both sides of the value.
  if (first < last) return {first, last};
  return {static_cast<float>(first - step), static_cast<float>(last + step)};
}

ValueRange range_of_reach(const RangeRequest& request, std::uint32_t /*channel*/) {
  return {0, rounded_up(request.reach)};
}

ValueRange range_of_reach_signed(const RangeRequest& request, std::uint32_t /*channel*/) {
  return symmetric_range(rounded_up(request.reach));
}

ValueRange range_of_curvature(const RangeRequest& request, std::uint32_t /*channel*/) {
  const double radius = curvature_radius(request.options.curvature_radius, request.source);
  return {0, rounded_up(request.source.frame.scale / radius)};
}

ValueRange range_of_curvature_signed(const RangeRequest& request, std::uint32_t channel) {
  return symmetric_range(range_of_curvature(request, channel).high);
}

double curvature_radius(const std::optional<Length>& option, const Source::Impl& source) {
  // Default radius of the neighbourhood over which curvature is averaged, as a share of the
  // diagonal
  constexpr double kDefaultRadiusShare = 0.005;
  // Bounds of the radius in frame units; the mesh has a size of about 1. Radii outside the bounds give the
  // same curvature as the bounds.
  constexpr double kMinRadius = 1e-9, kMaxRadius = 16;
  const double radius = option
                            ? to_frame(*option, source.frame)
                            : std::max(to_frame(Length::share(kDefaultRadiusShare), source.frame),
                                       kMinFacetsPerRadius * source.facets());
  return std::clamp(radius, kMinRadius, kMaxRadius);
}

}  // namespace kiln
