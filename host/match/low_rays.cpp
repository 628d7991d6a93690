#include "match/low_rays.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "accel/closest.h"
#include "match/host_correspondence.h"

namespace kiln {
namespace {

// The low poly's own face, and those beside it, are met at 0.
constexpr float kOwnFace = 8 * KILN_BVH_EPSILON;

}  // namespace

LowRays::LowRays(cl::Context& context, const LowSurface& surface) {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.usable[t] == 0) continue;
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (const LowSurface::Corner& corner : surface.triangles[t]) {
      positions.push_back(corner.position);
    }
    triangles.push_back({first, first + 1, first + 2});
    const Vec3d a(positions[first]);
    normals_.push_back(cross(Vec3d(positions[first + 1]) - a, Vec3d(positions[first + 2]) - a));
  }
  tree_ = std::make_shared<Tree>(context, positions, triangles);
  rays_.emplace(context, tree_);
}

std::vector<float> LowRays::limits(cl::Context& context, const TexelBand& samples,
                                   float farthest) const {
  const std::uint32_t count = samples.sample_count;
  RayQuery query;
  query.t_min = kOwnFace;
  query.t_max = std::max(farthest, kOwnFace);
  query.two_sided = true;
  DeviceCorrespondence met(context, samples.capacity);
  rays_->intersect(samples.points, count, samples.capacity, query, met);
  const HostCorrespondence found(context, met, count);
  std::vector<float> points(std::size_t{7} * samples.capacity);
  samples.points.read(context, points);
  std::vector<float> limit(count, farthest);
  const std::size_t plane = samples.capacity;
  for (std::size_t i = 0; i < count; ++i) {
    if (found.triangle[i] == KILN_NO_TRIANGLE) continue;
    const Vec3d direction{points[3 * plane + i], points[4 * plane + i], points[5 * plane + i]};
    const bool leaves = dot(normals_[found.triangle[i]], direction) > 0;
    limit[i] = leaves ? 0 : found.distance[i];
  }
  return limit;
}

std::vector<float> LowRays::distances(cl::Context& context, const std::vector<float>& points,
                                      float farthest) const {
  const auto count = static_cast<std::uint32_t>(points.size() / 7);
  const cl::Array<float> device_points(context, std::span<const float>(points));
  DeviceCorrespondence met(context, count);
  ClosestFinder(context, tree_).find(device_points, count, count, {farthest, true}, met);
  const HostCorrespondence found(context, met, count);
  std::vector<float> distance(count, farthest);
  for (std::size_t i = 0; i < count; ++i) {
    if (found.triangle[i] != KILN_NO_TRIANGLE) distance[i] = std::abs(found.distance[i]);
  }
  return distance;
}

}  // namespace kiln
