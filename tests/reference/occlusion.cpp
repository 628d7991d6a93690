#include "reference/occlusion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "reference/ray.h"

namespace kiln::reference {

HemisphereView view_hemisphere(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                               const std::array<double, 3>& point,
                               const std::array<double, 3>& about, const HemisphereSearch& search) {
  // Any frame will do: one axis is across `about` and the coordinate axis furthest from it.
  const std::size_t least = static_cast<std::size_t>(
      std::min_element(about.begin(), about.end(),
                       [](double a, double b) { return std::abs(a) < std::abs(b); }) -
      about.begin());
  std::array<double, 3> x{};
  for (std::size_t c = 0; c < 3; ++c) x[c] = (c == least ? 1 : 0) - about[least] * about[c];
  const double size = std::hypot(x[0], x[1], x[2]);
  for (double& c : x) c /= size;
  const std::array<double, 3> y = {about[1] * x[2] - about[2] * x[1],
                                   about[2] * x[0] - about[0] * x[2],
                                   about[0] * x[1] - about[1] * x[0]};
  RaySearch ray;
  ray.t_min = 1e-9;  // its own face is within rounding of 0
  ray.t_max = search.distance;
  ray.keep = search.back_faces ? 0 : -1;
  HemisphereView view;
  std::mt19937_64 random(search.seed);
  std::uniform_real_distribution<double> share(0, 1);
  for (std::uint32_t i = 0; i < search.rays; ++i) {
    const double squared = share(random), angle = 2 * std::numbers::pi * share(random);
    const double radius = std::sqrt(squared), height = std::sqrt(1 - squared);
    std::array<double, 3> direction{};
    for (std::size_t c = 0; c < 3; ++c) {
      direction[c] =
          radius * std::cos(angle) * x[c] + radius * std::sin(angle) * y[c] + height * about[c];
    }
    const RayHit hit = cast_ray(positions, triangles, point, direction, ray);
    view.way += (hit.found ? hit.t : search.distance) / search.rays;
    const double dark = search.darkens ? search.darkens(hit.t / search.distance) : 1;
    const double open = hit.found ? 1 - dark : 1;
    view.open += open / search.rays;
    for (std::size_t c = 0; c < 3; ++c) view.lean[c] += open * direction[c] / search.rays;
  }
  return view;
}

}  // namespace kiln::reference
