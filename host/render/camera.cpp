#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mesh/usable.h"

namespace kiln {
namespace {

/// Returns the sine and the cosine of an angle, exact at multiples of 90 degrees, so that views along an axis are
/// exactly aligned with it.
std::pair<double, double> exact_sine_cosine(double degrees) {
  constexpr double kPi = 3.14159265358979323846;
  const double quarters = std::nearbyint(degrees / 90);
  const double radians = (degrees - quarters * 90) * (kPi / 180);
  double sine = std::sin(radians);
  double cosine = std::cos(radians);
  const int quarter = static_cast<int>(std::fmod(quarters, 4) + 4) % 4;
  for (int i = 0; i < quarter; ++i) sine = std::exchange(cosine, -sine);
  return {sine, cosine};
}

/// Converts a vector from axes with +Y up and +Z to the front to the axes of RenderOptions::z_up.
Vec3d to_option_axes(const Vec3d& v, bool z_up) { return z_up ? Vec3d{v.x, -v.z, v.y} : v; }

Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

/// Chooses the direction to the key light, in camera axes. By default the light comes from the front, from above and
/// from the left. Flat meshes such as terrains and reliefs would hardly be shaded by this light; for these, the angle
/// between the light and the mean normal is 60 degrees, so that slopes are visible.
/// \param facing  CameraTarget::facing
Vec3d choose_key_light(const Vec3d& facing, const Camera& camera) {
  constexpr double kMinSheetFacing = 0.7;
  const Vec3d default_light = {-0.5145, 0.6860, 0.5145};
  if (length(facing) < kMinSheetFacing) return default_light;
  Vec3d n = unit({dot(facing, camera.right), dot(facing, camera.up), dot(facing, camera.toward)});
  if (n.z < 0) n = n * -1.0;  // Shading treats back faces as front faces
  const Vec3d from_upper_left = {-1, 1, 0};
  const Vec3d across = from_upper_left - n * dot(from_upper_left, n);
  if (length(across) < 1e-6) return default_light;
  return n * 0.5 + unit(across) * std::sqrt(0.75);
}

}  // namespace

std::array<double, 3> PictureGeometry::project(const std::array<double, 3>& point) const {
  const Vec3d from(point[0] - center[0], point[1] - center[1], point[2] - center[2]);
  const auto along = [&](const std::array<double, 3>& axis) {
    return from.x * axis[0] + from.y * axis[1] + from.z * axis[2];
  };
  return {width / 2.0 + along(right) / pixel, height / 2.0 - along(up) / pixel, along(toward)};
}

CameraTarget CameraTarget::of(const Mesh& mesh) {
  CameraTarget target{Frame::of(mesh), {}, {}};
  std::vector<bool> is_used_vertex(mesh.positions.size());
  double area = 0;
  for (const Triangle& triangle : mesh.triangles) {
    if (!has_area(mesh.positions, triangle)) continue;
    for (std::uint32_t i : triangle) is_used_vertex[i] = true;
    const Vec3d a = to_double(target.local_frame.to_frame(mesh, triangle[0]));
    const Vec3d normal = cross(to_double(target.local_frame.to_frame(mesh, triangle[1])) - a,
                               to_double(target.local_frame.to_frame(mesh, triangle[2])) - a);
    target.facing += normal;
    area += length(normal);
  }
  if (area > 0) target.facing = target.facing * (1 / area);
  // Vertices farther from the origin of the mesh's local frame than this, in its units (see Frame), do not count: the
  // camera is not fitted to them.
  constexpr double kMaxLocalDistance = 1;
  for (std::size_t i = 0; i < is_used_vertex.size(); ++i) {
    if (!is_used_vertex[i]) continue;
    const Vec3 point = target.local_frame.to_frame(mesh, i);
    if (length(to_double(point)) <= kMaxLocalDistance) target.points.push_back(point);
  }
  return target;
}

Camera Camera::fit(const CameraTarget& target, const RenderOptions& options) {
  const auto [sin_a, cos_a] = exact_sine_cosine(options.azimuth_degrees);
  const auto [sin_e, cos_e] = exact_sine_cosine(options.elevation_degrees);
  Camera camera;
  camera.right = to_option_axes({cos_a, 0, -sin_a}, options.z_up);
  camera.up = to_option_axes({-sin_a * sin_e, cos_e, -cos_a * sin_e}, options.z_up);
  camera.toward = to_option_axes({sin_a * cos_e, sin_e, cos_a * cos_e}, options.z_up);

  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double low_x = kInfinity;
  double low_y = kInfinity;
  double high_x = -kInfinity;
  double high_y = -kInfinity;
  for (const Vec3& point : target.points) {
    const double x = dot(to_double(point), camera.right);
    const double y = dot(to_double(point), camera.up);
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  }
  // The extent has a lower bound, so that even a line that is seen end-on gives a picture.
  constexpr double kMinExtent = 1e-6;    // in units of the local frame
  constexpr double kMarginShare = 0.04;  // width of the margin, as a share of the longer side
  const double extent_x = high_x - low_x, extent_y = high_y - low_y;
  const double extent = std::max({extent_x, extent_y, kMinExtent});
  const double side = extent / (1 - 2 * kMarginShare);
  camera.half_side = side / 2 / target.local_frame.scale / options.zoom;
  const auto pixels = [&](double target_extent) {
    const double share = options.trim ? (target_extent + 2 * kMarginShare * side) / side : 1;
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(share * options.size - 1e-6)));
  };
  camera.width = std::min(options.size, pixels(extent_x));
  camera.height = std::min(options.size, pixels(extent_y));
  const Vec3d target_center =
      camera.right * ((low_x + high_x) / 2) + camera.up * ((low_y + high_y) / 2);
  camera.center = {target.local_frame.center[0] + target_center.x / target.local_frame.scale,
                   target.local_frame.center[1] + target_center.y / target.local_frame.scale,
                   target.local_frame.center[2] + target_center.z / target.local_frame.scale};
  if (options.at) camera.center = *options.at;
  camera.key = choose_key_light(target.facing, camera);
  return camera;
}

}  // namespace kiln
