#include "match/low_rays.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "accel/closest.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

// Minimum distance of a hit: nearer ones are the sample's own face or an adjacent one.
constexpr float kMinHitDistance = 8 * KILN_BVH_EPSILON;

}  // namespace

LowRays::LowRays(cl::Context& context, const LowSurface& surface)
    : low_(LowTree::of_surface(context, surface)), rays_(context, low_->tree) {
  std::vector<float> normals;
  normals.reserve(3 * low_->normals.size());
  for (const Vec3d& normal : low_->normals) {
    const auto [x, y, z] = to_float(normal);
    normals.insert(normals.end(), {x, y, z});
  }
  triangle_normals_ = cl::Array<float>(context, std::span<const float>(normals));
}

void LowRays::write_search_limits(cl::Context& context, const TexelBand& samples, float farthest,
                                  const cl::Array<float>& limits, std::uint32_t first) const {
  RayQuery query;
  query.t_min = kMinHitDistance;
  query.t_max = std::max(farthest, kMinHitDistance);
  query.two_sided = true;
  const std::uint32_t count = samples.sample_count;
  DeviceCorrespondence hits(context, samples.capacity);
  rays_.intersect(samples.points, count, samples.capacity, query, hits);
  context.launch(context.kernel("match", "kiln_match_write_limits"), count, kLocal, count,
                 samples.capacity, farthest, first, triangle_normals_, samples.points,
                 hits.triangle, hits.distance, limits);
}

std::vector<float> LowRays::distances(cl::Context& context, const std::vector<float>& points,
                                      float farthest) const {
  const auto count = static_cast<std::uint32_t>(points.size() / 7);
  const cl::Array<float> device_points(context, std::span<const float>(points));
  DeviceCorrespondence hits(context, count);
  ClosestFinder(context, low_->tree).find(device_points, count, count, {farthest, true}, hits);
  const HostCorrespondence found(context, hits, count);
  std::vector<float> distance(count, farthest);
  for (std::size_t i = 0; i < count; ++i) {
    if (found.triangle[i] != KILN_NO_TRIANGLE) distance[i] = std::abs(found.distance[i]);
  }
  return distance;
}

}  // namespace kiln
