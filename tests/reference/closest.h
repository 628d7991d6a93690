// Oracle for nearest points: every triangle against every sample, in double precision.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kiln/types.h"

namespace kiln::reference {

struct TriangleShape {
  double longest = 0;            ///< Edge
  double height = 0;             ///< The least one
  std::array<double, 3> normal;  ///< Not of unit length: twice the area
};
TriangleShape triangle_shape(std::span<const Vec3> positions, const Triangle& triangle);

/// The distance from a point to a triangle.
double triangle_distance(std::span<const Vec3> positions, const Triangle& triangle,
                         const std::array<double, 3>& point);

struct ClosestHit {
  bool found = false;
  std::uint32_t triangle = 0xFFFFFFFFu;
  double distance = 0;
};

struct ClosestSearch {
  double max_distance = 1;
  bool two_sided = false;
  /// Unless two-sided: a face counts where normal . direction >= this times its longest edge squared.
  double least_facing = 0;
};

ClosestHit closest_point(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                         const std::array<double, 3>& point, const std::array<double, 3>& direction,
                         const ClosestSearch& search);

}  // namespace kiln::reference
