#include "detail/low_frames.h"

#include <array>

#include "mesh/low_shading.h"

namespace kiln {
namespace {

/// Interpolates three consecutive vectors by the weights of corners 1 and 2.
Vec3d interpolate(const float* corners, double u, double v) {
  const auto at = [&](std::size_t k) {
    return Vec3d{corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
  };
  return at(0) * (1 - u - v) + at(1) * u + at(2) * v;
}

/// The bitangent that is computed at the corners and interpolated between them (Bitangent::vertex).
Vec3d corner_bitangent(const kiln_low_shading& low, double u, double v) {
  const std::array<double, 3> weights = {1 - u - v, u, v};
  Vec3d sum{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float* n = low.normal + 3 * k;
    const float* t = low.tangent + 3 * k;
    sum += cross(Vec3d(n[0], n[1], n[2]), Vec3d(t[0], t[1], t[2])) * (low.sign * weights[k]);
  }
  return sum;
}

}  // namespace

LowFrames::LowFrames(const MapRequest& request)
    : shading_(low_shading(request.surface, /*with_uvs=*/true)),
      space_(request.options.encoding.space),
      interpolates_bitangent_(request.options.encoding.bitangent == Bitangent::vertex),
      y_scale_(request.options.encoding.flip_y ? -1 : 1) {}

Vec3d LowFrames::transform_to_space(const HighPoint& point, const Vec3d& vector) const {
  Vec3d result = compute_components(point, vector);
  result.y *= y_scale_;
  return result;
}

Vec3d LowFrames::compute_components(const HighPoint& point, const Vec3d& vector) const {
  const kiln_low_shading& low = shading_[point.low_triangle];
  if (space_ == NormalMapSpace::object) return vector;
  if (space_ == NormalMapSpace::face) {
    const Vec3d normal = interpolate(low.face_normal, 0, 0);
    const Vec3d x_axis = interpolate(low.face_tangent, 0, 0);
    return {dot(vector, x_axis), dot(vector, cross(normal, x_axis)), dot(vector, normal)};
  }
  // The frame is interpolated without normalizing, as in shaders, and inverted by Cramer's rule.
  const Vec3d normal = interpolate(low.normal, point.low_u, point.low_v);
  const Vec3d tangent = interpolate(low.tangent, point.low_u, point.low_v);
  Vec3d bitangent = cross(normal, tangent) * double{low.sign};
  if (interpolates_bitangent_) bitangent = corner_bitangent(low, point.low_u, point.low_v);
  const Vec3d across = cross(bitangent, normal);
  const double determinant = dot(tangent, across);
  if (determinant == 0) return {};
  return Vec3d{dot(vector, across), dot(vector, cross(normal, tangent)),
               dot(vector, cross(tangent, bitangent))} *
         (1 / determinant);
}

}  // namespace kiln
