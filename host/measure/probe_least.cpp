// Lower bound on the error of any normal map.
#include <algorithm>
#include <cmath>
#include <utility>

#include "measure/normal_probe.h"
#include "measure/probe_parts.h"

namespace kiln {

double NormalProbe::min_error_share(const InfiniteMap& infinite_map_result) const {
  constexpr std::size_t kSampledPlaces = 2048;
  constexpr double kMinCosine = 0.05;
  if (places() == 0) return 1;
  const std::size_t step = (places_.size() + kSampledPlaces - 1) / kSampledPlaces;
  struct ViewedPlace {
    std::size_t place = 0;
    double cosine = 0;
    Vec3d toward{}, position{};
    double distance = 0;  // Distance from the ray's origin to the place
  };
  std::vector<ViewedPlace> views;
  for (const Vec3d& toward : picture_directions_) {
    for (std::size_t i = 0; i < places_.size(); i += step) {
      const Place& place = places_[i];
      const Vec3d normal = vector_at(shading_[place.triangle].face_normal);
      const double cosine = dot(normal, toward) * (place.seen_from_behind ? -1 : 1);
      if (cosine < kMinCosine) continue;
      const Vec3d position = position_at(surface_, place);
      views.push_back(
          {i / step, cosine, toward, position, ray_start_distance_ - dot(position, toward)});
    }
  }
  const auto count = static_cast<std::uint32_t>(views.size());
  if (count == 0) return 1;
  std::vector<float> points(std::size_t{7} * count, 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = to_float(views[i].position + views[i].toward * views[i].distance);
    const Vec3 d = to_float(views[i].toward * -1.0);
    const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
    for (std::size_t c = 0; c < 6; ++c) points[c * count + i] = values[c];
  }
  cl::Context& context = context_of(source_.device);
  const cl::Array<float> device_points(context, std::span<const float>(points));
  DeviceCorrespondence match(context, count);
  RayQuery query;
  query.t_max = static_cast<float>(2 * ray_start_distance_);
  query.two_sided = true;
  low_poly_rays_.intersect(device_points, count, count, query, match);
  std::vector<float> distance(count);
  match.distance.read(context, distance);
  source_.rays().intersect(device_points, count, count, query, match);
  const std::vector<std::uint32_t> triangle = match.triangle.download(context);
  const std::vector<float> barycentric = match.barycentric.download(context);
  const std::vector<std::uint32_t>& normal_indices =
      normal_reads_.read_source(source_.attributes.normal_indices);
  const std::vector<float>& normals = normal_reads_.read_source(source_.attributes.normals);

  std::vector<std::vector<std::pair<Vec3d, double>>> visible_directions(kSampledPlaces);
  for (std::size_t i = 0; i < count; ++i) {
    const ViewedPlace& viewed_place = views[i];
    // Another part of the low poly hides this place.
    if (distance[i] < viewed_place.distance - 1e-4 * ray_start_distance_ ||
        triangle[i] == KILN_NO_TRIANGLE)
      continue;
    const std::size_t t = triangle[i];
    std::array<Vec3d, 3> triangle_corners{}, shading{};
    for (std::size_t k = 0; k < 3; ++k) {
      triangle_corners[k] = to_double(source_.positions[source_.triangles[t][k]]);
      const float* n = &normals[3 * std::size_t{normal_indices[3 * t + k]}];
      shading[k] = Vec3d(n[0], n[1], n[2]);
    }
    const Vec3d face =
        cross(triangle_corners[1] - triangle_corners[0], triangle_corners[2] - triangle_corners[0]);
    const float u = barycentric[i], v = barycentric[i + count];
    const Vec3d sum = shading[0] * (1.0 - u - v) + shading[1] * double{u} + shading[2] * double{v};
    const double size = length(sum);
    if (!(size > 0)) continue;
    const double side = dot(face, viewed_place.toward) < 0 ? -1 : 1;
    visible_directions[viewed_place.place].emplace_back(sum * (side / size), viewed_place.cosine);
  }
  const auto mean_angle = [](const Vec3d& normal, const auto& directions) {
    double sum = 0, weights = 0;
    for (const auto& [n, weight] : directions) {
      sum += weight * std::atan2(length(cross(normal, n)), dot(normal, n));
      weights += weight;
    }
    return sum / weights;
  };
  double min_error_sum = 0, matched_error_sum = 0;
  for (std::size_t i = 0; i < kSampledPlaces; ++i) {
    const auto& directions = visible_directions[i];
    if (directions.empty()) continue;
    const std::size_t place = i * step;
    const float* matched_normal = &infinite_map_result.normals[3 * place];
    const double own_error =
        mean_angle(Vec3d(matched_normal[0], matched_normal[1], matched_normal[2]) *
                       (places_[place].seen_from_behind ? -1.0 : 1.0),
                   directions);
    // Weiszfeld's iteration: starting at the least-squares direction, finds the direction with the smallest mean angle
    // to all normals.
    Vec3d best{};
    for (const auto& [n, weight] : directions) best += n * weight;
    double error = own_error;
    for (int iteration = 0; iteration < 8 && length(best) > 0; ++iteration) {
      best = best * (1 / length(best));
      error = std::min(error, mean_angle(best, directions));
      Vec3d next{};
      for (const auto& [n, weight] : directions) {
        const double angle = std::atan2(length(cross(best, n)), dot(best, n));
        next += n * (weight / std::max(angle, 1e-4));
      }
      best = next;
    }
    min_error_sum += error;
    matched_error_sum += own_error;
  }
  return matched_error_sum > 0 ? min_error_sum / matched_error_sum : 1;
}

}  // namespace kiln
