#include "support/hard_scene.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "accel/ray.h"
#include "kiln/measure.h"
#include "mesh/weld.h"
#include "shared/match.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

constexpr std::uint32_t kDirections = 512;
constexpr float kRayLength = 4;  // ray length beyond any scene of about unit size
constexpr float kMinHitDistance =
    1e-4F;  // minimum distance of hits, to exclude the low poly's own face

/// Makes a ray from each sample in one direction.
cl::Array<float> towards(cl::Context& context, const AssessedSamples& samples, const Vec3& w) {
  const std::size_t count = samples.size();
  std::vector<float> planes(7 * count, 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3& p = samples.position[i];
    const float values[6] = {p.x, p.y, p.z, w.x, w.y, w.z};
    for (std::size_t k = 0; k < 6; ++k) planes[k * count + i] = values[k];
  }
  return {context, std::span<const float>(planes)};
}

}  // namespace

std::vector<std::uint32_t> parts_of(const Mesh& mesh) {
  const std::vector<std::uint32_t> welded = weld_vertices(mesh.positions);
  std::vector<std::uint32_t> root(mesh.positions.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const std::uint32_t a = find(welded[triangle[0]]), b = find(welded[corner]);
      root[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::uint32_t> parts;
  for (const Triangle& triangle : mesh.triangles) parts.push_back(find(welded[triangle[0]]));
  return parts;
}

HardBake::HardBake(const Source& source, const Mesh& low, BakeOptions options) {
  options.report.keep_match = true;
  baked = bake(source, low, options);
  samples = assessed_samples(impl_of(source), low, *baked.match);
}

VisibleParts::VisibleParts(const Source& source, const Mesh& high, const Mesh& low,
                           const HardBake& bake, float reach)
    : parts_(parts_of(high)), sum_(bake.samples.size()), by_part_(bake.samples.size()) {
  cl::Context& context = context_of(*device());
  const AssessedSamples& samples = bake.samples;
  const RayCaster light(context, impl_of(source).frame.to_frame(low), low.triangles);
  const auto count = static_cast<std::uint32_t>(samples.size());
  DeviceCorrespondence shown(context, count);
  cl::Array<std::uint8_t> hidden(context, count);
  for (const Vec3& w : spread_views(kDirections)) {
    const cl::Array<float> points = towards(context, samples, w);
    light.occluded(points, count, count,
                   {.t_min = kMinHitDistance, .t_max = kRayLength, .two_sided = true}, hidden);
    RayQuery from_outside{
        .t_min = 0, .t_max = kRayLength + reach, .offset = kRayLength, .inward = true};
    impl_of(source).rays().intersect(points, count, count, from_outside, shown);
    std::vector<std::uint8_t> blocked(count);
    std::vector<std::uint32_t> triangle(count);
    std::vector<float> distance(count);
    hidden.read(context, blocked);
    shown.triangle.read(context, triangle);
    shown.distance.read(context, distance);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3& n = samples.normal[i];
      const double cosine = double{n.x} * w.x + double{n.y} * w.y + double{n.z} * w.z;
      if (cosine <= 0 || blocked[i] != 0 || triangle[i] == KILN_NO_TRIANGLE) continue;
      if (distance[i] > reach) continue;
      sum_[i] += cosine;
      by_part_[i][parts_[triangle[i]]] += cosine;
    }
  }
}

double VisibleParts::share(std::size_t i, std::uint32_t triangle) const {
  if (triangle == KILN_NO_TRIANGLE) return 0;
  const auto found = by_part_[i].find(parts_[triangle]);
  return found == by_part_[i].end() ? 0 : found->second / sum_[i];
}

}  // namespace kiln::test
