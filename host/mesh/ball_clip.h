// Triangles clipped by a ball.
#pragma once

#include <array>
#include <cstddef>

#include "mesh/vector.h"

namespace kiln {

/// Area and edge lengths of a triangle inside of a ball.
struct BallClip {
  double area = 0;
  /// For edge k, which starts at corner k, the share of its length that lies in the ball
  std::array<double, 3> edge_share{};
};

/// Clips a triangle by a ball around the origin. An edge is clipped to its part in the ball. The area is clipped by
/// the circle in which the ball cuts the triangle's plane, as a sum of triangles and sectors at the circle's centre.
BallClip clip_by_ball(const std::array<Vec3d, 3>& corners, double squared_radius);

/// Triangles whose area and bend within a ball are computed together, one per lane.
struct BallBatch {
  static constexpr std::size_t kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  std::array<Lanes, 9>
      corner{};  ///< Coordinate i % 3 of corner i / 3, relative to the ball's centre
  std::array<Lanes, 3> angle{};  ///< Signed angle at edge k, which starts at corner k
  /// [in] sums of the whole triangles, [out] of their parts in the ball
  Lanes area{}, bend{};
};

/// Replaces each lane's sums by those of the triangle's part in the ball: the clipped area, and the sum over edges of
/// angle * clipped length / 4. A lane has the bits of clip_by_ball(). Uses AVX-512 or AVX2 where the processor has
/// them; the bits are the same.
void sum_in_ball(BallBatch& batch, double squared_radius);

}  // namespace kiln
