// The way from the low poly to the high poly.
#include "detail/point_map.h"
#include "mesh/low_shading.h"

namespace kiln {
namespace {

/// Three vectors, stored one after another, at weights of corners 1 and 2.
Vec3d interpolate(const float* corners, double u, double v) {
  const auto at = [&](std::size_t k) {
    return Vec3d{corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
  };
  return at(0) * (1 - u - v) + at(1) * u + at(2) * v;
}

/// Components in the space of the bake's normals, as kernels/detail/detail.cl has them, but for
/// making them unit: the sum of the components times the frame's vectors is the way.
class Displacement : public PointFunction {
 public:
  explicit Displacement(const MapRequest& request)
      : shading_(low_shading(request.surface)),
        space_(request.options.space),
        y_scale_(request.options.flip_y ? -1 : 1) {}

  void operator()(const DensePoint& point, float* value) const override {
    const Vec3d way = in_space(point);
    value[0] = static_cast<float>(way.x);
    value[1] = static_cast<float>(way.y * y_scale_);
    value[2] = static_cast<float>(way.z);
  }

 private:
  Vec3d in_space(const DensePoint& point) const {
    const kiln_low_shading& low = shading_[point.low_triangle];
    const Vec3d& way = point.offset;
    if (space_ == NormalMapSpace::object) return way;
    if (space_ == NormalMapSpace::face) {
      const Vec3d normal = interpolate(low.face_normal, 0, 0);
      const Vec3d x_axis = interpolate(low.face_tangent, 0, 0);
      return {dot(way, x_axis), dot(way, cross(normal, x_axis)), dot(way, normal)};
    }
    // The frame is interpolated and not made unit, as shaders do it, and inverted by Cramer's rule.
    const Vec3d normal = interpolate(low.normal, point.low_u, point.low_v);
    const Vec3d tangent = interpolate(low.tangent, point.low_u, point.low_v);
    const Vec3d bitangent = cross(normal, tangent) * low.sign;
    const Vec3d across = cross(bitangent, normal);
    const double determinant = dot(tangent, across);
    if (determinant == 0) return {};
    return Vec3d{dot(way, across), dot(way, cross(normal, tangent)),
                 dot(way, cross(tangent, bitangent))} *
           (1 / determinant);
  }

  std::vector<kiln_low_shading> shading_;
  NormalMapSpace space_;
  double y_scale_;
};

}  // namespace

MapRow displacement_map() {
  MapRow row;
  row.info = {MapKind{"displacement"},
              3,
              MapType::vector,
              "vector from low poly to high poly, in the space of the normals, world units",
              0,
              0};
  row.follows_positions = true;
  row.make = [](const MapRequest& request) {
    return make_point_map(request, displacement_map().info,
                          std::unique_ptr<PointFunction>(std::make_unique<Displacement>(request)));
  };
  return row;
}

}  // namespace kiln
