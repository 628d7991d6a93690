// UV coordinates in fixed point, which determine the samples in UV triangles.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kiln/types.h"

namespace kiln {

inline bool is_finite(const Vec2& uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); }

/// Corners of a UV triangle in fixed point: x = u * width * N * 2^shift to the right; y points down from v = 1.
struct FixedPointTriangle {
  std::array<std::int32_t, 3> x;
  std::array<std::int32_t, 3> y;
};

/// Twice the signed area, in squared fixed-point units. The result is exact.
std::int64_t doubled_area(const FixedPointTriangle& triangle);

/// A range of samples in a row or column; empty if last < first.
struct SampleRange {
  std::int64_t first = 0, last = -1;
};

/// The samples whose centres lie in [low, high] (fixed point), clamped to [0, count).
SampleRange samples_within(std::int64_t low, std::int64_t high, std::uint32_t shift,
                           std::uint32_t count);

/// The rows of samples whose centres a triangle may contain.
SampleRange rows_of(const FixedPointTriangle& triangle, std::uint32_t shift, std::uint32_t count);

/// The sample grid of a map, and its resolution in fixed-point units.
struct UvGrid {
  std::uint32_t sample_width = 0;
  std::uint32_t sample_height = 0;
  std::uint32_t shift = 0;  ///< Fixed-point bits per sample, 10 to 28

  /// \param sample_width, sample_height  number of samples along the sides of the map, 1 to 2^18
  static UvGrid of(std::uint32_t sample_width, std::uint32_t sample_height);

  std::int32_t fixed_x(double u) const;
  std::int32_t fixed_y(double v) const;
  /// True if the triangle extends beyond the unit square
  bool is_beyond_square(const FixedPointTriangle& f) const;
  /// True if the triangle has no area within the unit square
  bool is_outside_square(const FixedPointTriangle& f) const;
};

/// A corner of a clipped polygon, with its barycentric coordinates in the triangle.
struct ClipVertex {
  double u = 0, v = 0;
  std::array<double, 3> weight{};
};

/// True if fixed-point coordinates can represent a UV: it must lie within [-1, 2] x [-1, 2].
bool in_prism(const Vec2& uv);

/// Clips a triangle to [-1, 2] x [-1, 2]. The result is a convex polygon, or empty. Computed in double precision, with
/// identical results on both sides of a shared edge.
std::vector<ClipVertex> clip_to_prism(const std::array<Vec2, 3>& uvs);

}  // namespace kiln
