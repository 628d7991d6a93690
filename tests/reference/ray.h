// Oracle for rays: every triangle against every ray, in double precision.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kiln/types.h"

namespace kiln::reference {

struct RayHit {
  bool found = false;
  std::uint32_t triangle = 0xFFFFFFFFu;
  double t = 0;
  double u = 0, v = 0;  ///< Weights of corners 1 and 2
};

struct RaySearch {
  double t_min = 0;
  double t_max = 1;
  bool greatest_first = false;         ///< The greatest t
  bool nearest_outward_first = false;  ///< Nearest with t >= 0, else nearest with t < 0
  /// 0 keeps all faces; 1 only those whose normal does not point against the ray's direction; -1 only
  /// those whose normal does not point along it.
  int keep = 0;
  double slack = 0;  ///< Barycentrics may be this far below 0
};

/// Signed volumes of the tetrahedra between the ray's line and the triangle's edges.
RayHit cast_ray(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                const std::array<double, 3>& origin, const std::array<double, 3>& direction,
                const RaySearch& search);

}  // namespace kiln::reference
