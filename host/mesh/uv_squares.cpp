#include "mesh/uv_squares.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln {
namespace {

// UVs are not moved to the unit square if a coordinate of the triangle's centroid is at least this
constexpr double kMaxTileOffset = 1e6;
constexpr double kInsideTolerance = 1e-3;  // Tolerance, as a share of a triangle's height
// Binary logarithm of the smallest square's side: about 1e-9
constexpr int kMinSquareLog2 = -30;

double twice_area(const UvPosition& a, const UvPosition& b, const UvPosition& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Intersection of a triangle with three half-planes, which is a convex polygon of at most six corners.
struct CutPolygon {
  std::array<UvPosition, 9> corner{};
  std::size_t count = 0;

  /// Keeps the part to the left of the line from `a` to `b`.
  void keep_left_of(const UvPosition& a, const UvPosition& b) {
    const CutPolygon uncut_polygon = *this;
    count = 0;
    for (std::size_t k = 0; k < uncut_polygon.count; ++k) {
      const UvPosition &p = uncut_polygon.corner[k],
                       &q = uncut_polygon.corner[(k + 1) % uncut_polygon.count];
      const double at_p = twice_area(a, b, p), at_q = twice_area(a, b, q);
      if (at_p >= 0) corner[count++] = p;
      if ((at_p < 0) == (at_q < 0) || at_p == at_q) continue;
      const double share = at_p / (at_p - at_q);
      corner[count++] = {p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])};
    }
  }
};

}  // namespace

UvPlace UvPlace::of(const std::array<LowSurface::Corner, 3>& corners) {
  UvPlace place;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) {
      place.uv[k][axis] = axis == 0 ? corners[k].uv.x : corners[k].uv.y;
      place.middle[axis] += place.uv[k][axis] / 3;
    }
    if (!(std::abs(place.middle[axis]) < kMaxTileOffset)) return place;
    place.offset[axis] = std::floor(place.middle[axis]);
    place.middle[axis] -= place.offset[axis];
    for (auto& uv : place.uv) uv[axis] -= place.offset[axis];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &p = place.uv[k], &q = place.uv[(k + 1) % 3];
    const double u = p[0] - q[0], v = p[1] - q[1];
    place.side = std::max(place.side, u * u + v * v);
  }
  place.side = std::sqrt(place.side);
  place.area = twice_area(place.uv[0], place.uv[1], place.uv[2]);
  return place;
}

double UvPlace::tolerance() const { return std::min(1e-4, 0.05 * side); }

bool UvPlace::contains(const UvPosition& point) const {
  const double min_weight = -kInsideTolerance * std::abs(area), sign = area < 0 ? -1 : 1;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(sign * twice_area(uv[k], uv[(k + 1) % 3], point) >= min_weight)) return false;
  }
  return true;
}

bool are_near(const UvPosition& a, const UvPosition& b, double near) {
  return std::abs(a[0] - b[0]) <= near && std::abs(a[1] - b[1]) <= near;
}

double shared_area(const std::array<UvPosition, 3>& a, const std::array<UvPosition, 3>& b) {
  CutPolygon polygon;
  for (const UvPosition& corner : a) polygon.corner[polygon.count++] = corner;
  const bool mirrored = twice_area(b[0], b[1], b[2]) < 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const UvPosition &p = b[k], &q = b[(k + 1) % 3];
    mirrored ? polygon.keep_left_of(q, p) : polygon.keep_left_of(p, q);
  }
  double area = 0;
  for (std::size_t k = 2; k < polygon.count; ++k) {
    area += twice_area(polygon.corner[0], polygon.corner[k - 1], polygon.corner[k]);
  }
  return std::abs(area);
}

UvSquares::UvSquares(std::span<const UvPlace> places)
    : places_(places), newest_entry_(std::bit_ceil(2 * places.size() + 1), kEnd) {
  square_entries_.reserve(2 * places.size());
}

void UvSquares::add(std::uint32_t triangle) {
  const UvPlace& place = places_[triangle];
  // The square must contain the triangle and its tolerance.
  const int level = std::max(std::ilogb(1.2 * place.side) + 1, kMinSquareLog2);
  if (std::find(levels_.begin(), levels_.end(), level) == levels_.end()) levels_.push_back(level);
  UvPosition low = place.uv[0], high = low;
  for (const UvPosition& uv : place.uv) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], uv[axis]);
      high[axis] = std::max(high[axis], uv[axis]);
    }
  }
  const double tolerance = place.tolerance();
  const auto first = square_of({low[0] - tolerance, low[1] - tolerance}, level);
  const auto last = square_of({high[0] + tolerance, high[1] + tolerance}, level);
  for (std::int64_t x = first[0]; x <= last[0]; ++x) {
    for (std::int64_t y = first[1]; y <= last[1]; ++y) {
      std::uint32_t& head = newest_entry_[slot(x, y, level)];
      square_entries_.push_back({triangle, head});
      head = static_cast<std::uint32_t>(square_entries_.size() - 1);
    }
  }
}

std::array<std::int64_t, 2> UvSquares::square_of(const UvPosition& point, int level) {
  const auto number = [&](double value) {
    return static_cast<std::int64_t>(std::floor(std::ldexp(value, -level)));
  };
  return {number(point[0]), number(point[1])};
}

std::size_t UvSquares::slot(std::int64_t x, std::int64_t y, int level) const {
  std::uint64_t key = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U ^
                      static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FU ^
                      static_cast<std::uint64_t>(level) * 0x165667B19E3779F9U;
  key ^= key >> 32U;
  return static_cast<std::size_t>(key) & (newest_entry_.size() - 1);
}

}  // namespace kiln
