// Clips triangles by a ball.
#pragma once

#include <array>
#include <cstddef>

#include "mesh/vector.h"

namespace kiln {

/// The part of a triangle that lies in a ball: its area, and the shares of its edges.
struct BallClip {
  double area = 0;
  /// For each edge k, which starts at corner k, the share of its length that lies in the ball
  std::array<double, 3> edge_share{};
};

/// Clips a triangle by a ball around the origin. Each edge is clipped to its part in the ball. The area is clipped by
/// the circle in which the ball cuts the triangle's plane; it is computed as a sum of triangles and circular sectors at
/// the circle's centre.
BallClip clip_by_ball(const std::array<Vec3d, 3>& corners, double squared_radius);

/// Several triangles, one per lane, whose area and bend within a ball are computed together.
struct BallBatch {
  static constexpr std::size_t kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  std::array<Lanes, 9>
      corner{};  ///< Coordinate i % 3 of corner i / 3, relative to the ball's centre
  std::array<Lanes, 3> angle{};  ///< Signed angle at edge k, which starts at corner k
  /// On entry: area and bend of each whole triangle. On return: those of its part in the ball
  Lanes area{}, bend{};
};

/// Replaces each lane's area and bend by those of the triangle's part in the ball: the clipped area, and the sum over
/// edges of angle * clipped length / 4. Each lane gets the same bits as from clip_by_ball(), also where AVX-512 or AVX2
/// are used.
void sum_in_ball(BallBatch& batch, double squared_radius);

}  // namespace kiln
