// UV coordinates in fixed point: how any mesh's layout comes to lie on a map's samples.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kiln/types.h"

namespace kiln {

inline bool is_finite(const Vec2& uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); }

/// Corners of a UV triangle in fixed point: x = u * width * N * 2^shift to the right, y down from v = 1.
struct FixedTriangle {
  std::array<std::int32_t, 3> x;
  std::array<std::int32_t, 3> y;
};

/// Twice the signed area, in fixed-point units squared: exact.
std::int64_t doubled_area(const FixedTriangle& triangle);

/// Samples of a row or column: none where last < first.
struct SampleRange {
  std::int64_t first = 0, last = -1;
};

/// Samples whose centres lie in [low, high], both in fixed point, cut to [0, count).
SampleRange samples_within(std::int64_t low, std::int64_t high, std::uint32_t shift,
                           std::uint32_t count);

/// Rows of samples whose centres a triangle may hold.
SampleRange rows_of(const FixedTriangle& triangle, std::uint32_t shift, std::uint32_t count);

/// The samples of a map, and the fixed-point units between them.
struct UvGrid {
  std::uint32_t sample_width = 0;
  std::uint32_t sample_height = 0;
  std::uint32_t shift = 0;  ///< Fixed-point bits below one sample, 10 to 28

  /// \param sample_width, sample_height  of the map, in samples, 1 to 2^18
  static UvGrid of(std::uint32_t sample_width, std::uint32_t sample_height);

  std::int32_t fixed_x(double u) const;
  std::int32_t fixed_y(double v) const;
  bool beyond_square(const FixedTriangle& f) const;  ///< Reaches out of the unit square
  bool misses_square(const FixedTriangle& f) const;  ///< Has no area in it
};

/// A corner of a clipped polygon, with its barycentric weights in the triangle.
struct ClipVertex {
  double u = 0, v = 0;
  std::array<double, 3> weight{};
};

/// True if fixed-point coordinates can hold a UV: within [-1, 2] x [-1, 2].
bool in_prism(const Vec2& uv);

/// Part of a triangle that lies there: a convex polygon, or nothing. In double precision, the same way from
/// both sides of a shared edge.
std::vector<ClipVertex> clip_to_prism(const std::array<Vec2, 3>& uvs);

}  // namespace kiln
