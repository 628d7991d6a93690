// Oracle for ambient occlusion, bent normals and thickness: random rays against every triangle, in double
// precision.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>

#include "kiln/types.h"

namespace kiln::reference {

struct HemisphereSearch {
  double distance = std::numeric_limits<double>::infinity();  ///< Hits further away do not count
  /// Darkening by a hit, by its share of `distance`; null: 1
  std::function<double(double)> darkens = nullptr;
  bool back_faces = true;  ///< Faces that point along the ray count, too
  std::uint32_t rays = 4096;
  std::uint64_t seed = 1;
};

struct HemisphereView {
  double open = 0;  ///< Share of rays that hit nothing, or the mean of 1 - darkens
  std::array<double, 3>
      lean{};      ///< Sum of their directions by as much, over the number of all rays
  double way = 0;  ///< Mean distance to the first hit, `distance` where there is none
};

/// Rays from `point`, as likely in a direction as its cosine to `about` is large.
/// \param about  unit length
HemisphereView view_hemisphere(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                               const std::array<double, 3>& point,
                               const std::array<double, 3>& about, const HemisphereSearch& search);

}  // namespace kiln::reference
