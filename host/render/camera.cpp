#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kiln {
namespace {

/// Sine and cosine, exact at multiples of 90 degrees: views along an axis are along it.
std::pair<double, double> sine_cosine(double degrees) {
  constexpr double kPi = 3.14159265358979323846;
  const double quarters = std::nearbyint(degrees / 90);
  const double radians = (degrees - quarters * 90) * (kPi / 180);
  double sine = std::sin(radians);
  double cosine = std::cos(radians);
  const int quarter = static_cast<int>(std::fmod(quarters, 4) + 4) % 4;
  for (int i = 0; i < quarter; ++i) sine = std::exchange(cosine, -sine);
  return {sine, cosine};
}

/// From a world whose up axis is +Y and whose front is +Z to the options'.
Vec3d oriented(const Vec3d& v, bool z_up) { return z_up ? Vec3d{v.x, -v.z, v.y} : v; }

}  // namespace

CameraTarget CameraTarget::of(const Mesh& mesh) {
  CameraTarget target{Frame::of(mesh), {}};
  std::vector<bool> used(mesh.positions.size());
  for (const Triangle& triangle : mesh.triangles) {
    const bool finite = std::all_of(triangle.begin(), triangle.end(),
                                    [&](std::uint32_t i) { return is_finite(mesh.positions[i]); });
    if (!finite) continue;
    for (std::uint32_t i : triangle) used[i] = true;
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) target.points.push_back(target.frame.to_frame(mesh, i));
  }
  return target;
}

Camera Camera::fit(const CameraTarget& target, const RenderOptions& options) {
  const auto [sin_a, cos_a] = sine_cosine(options.azimuth_degrees);
  const auto [sin_e, cos_e] = sine_cosine(options.elevation_degrees);
  Camera camera;
  camera.right = oriented({cos_a, 0, -sin_a}, options.z_up);
  camera.up = oriented({-sin_a * sin_e, cos_e, -cos_a * sin_e}, options.z_up);
  camera.toward = oriented({sin_a * cos_e, sin_e, cos_a * cos_e}, options.z_up);

  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double low_x = kInfinity;
  double low_y = kInfinity;
  double high_x = -kInfinity;
  double high_y = -kInfinity;
  for (const Vec3& point : target.points) {
    const double x = dot(Vec3d(point), camera.right);
    const double y = dot(Vec3d(point), camera.up);
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  }
  // A line seen end on still gets a picture: the frame's unit is the smallest that could be meant.
  constexpr double kMargin = 0.04;
  const double extent = std::max({high_x - low_x, high_y - low_y, 1e-6});
  camera.half_side = extent / 2 / (1 - 2 * kMargin) / target.frame.scale;
  const Vec3d middle = camera.right * ((low_x + high_x) / 2) + camera.up * ((low_y + high_y) / 2);
  camera.center = {target.frame.center[0] + middle.x / target.frame.scale,
                   target.frame.center[1] + middle.y / target.frame.scale,
                   target.frame.center[2] + middle.z / target.frame.scale};
  return camera;
}

}  // namespace kiln
