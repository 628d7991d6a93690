// The closest-point kernels against the brute-force oracle, and their variants against each other.
#include "accel/closest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "accel/closest_scene.h"
#include "kiln/render.h"
#include "reference/closest.h"
#include "shared/match.h"
#include "support/ray_scene.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

using Point = std::array<double, 3>;

Scene scene_of(const Mesh& mesh, float scale) {
  Scene scene{mesh.positions, mesh.triangles};
  for (Vec3& p : scene.positions) p = {p.x * scale, p.y * scale, p.z * scale};
  return scene;
}

/// Triangles of which the first edge is about 0.5 long, the height 1e-1 to 1e-6 of that.
Scene sliver_soup(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.3f, 0.3f);
  std::uniform_real_distribution<float> exponent(-6, -1);
  std::uniform_real_distribution<float> share(-0.2f, 1.2f);
  Scene scene;
  while (scene.triangles.size() < count) {
    const Vec3 a{place(random), place(random), place(random)};
    const Vec3 d = random_unit(random);
    const Vec3 side = random_unit(random);
    const float h = 0.5f * std::pow(10.0f, exponent(random));
    const float s = 0.5f * share(random);
    scene.add(a, {a.x + 0.5f * d.x, a.y + 0.5f * d.y, a.z + 0.5f * d.z},
              {a.x + s * d.x + h * side.x, a.y + s * d.y + h * side.y, a.z + s * d.z + h * side.z});
  }
  return scene;
}

/// The bound that kernels/accel/nearest.clh promises: how far our distance to a triangle may be above the true one
/// (and by `rounding` below it).
struct Bound {
  double rounding = 0;
  double most = 0;
};
Bound bound_of(const Scene& scene, std::uint32_t triangle, const Point& p, double distance) {
  const reference::TriangleShape shape =
      reference::triangle_shape(scene.positions, scene.triangles[triangle]);
  double reach = shape.longest;
  for (std::uint32_t corner : scene.triangles[triangle]) {
    const Vec3& v = scene.positions[corner];
    reach = std::max(reach, std::hypot(v.x - p[0], v.y - p[1], v.z - p[2]));
  }
  const double ratio = shape.longest / shape.height;
  const double aside = std::min(shape.height / 2, 16 * kU * reach * ratio * ratio);
  return {8 * kU * reach, std::hypot(distance, aside) + 8 * kU * reach};
}

/// Each of our results must be a nearest triangle, but for the promised bound; its distance, weights and
/// side must be right.
void expect_agrees(const Scene& scene, const std::vector<Ray>& samples, const ClosestQuery& query,
                   const Cast& ours, std::size_t least_hits) {
  std::size_t hits = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vec3 q = samples[i].origin;
    const Vec3 n = samples[i].direction;
    const Point point{q.x, q.y, q.z};
    const Point direction{n.x, n.y, n.z};
    // A normal is off by 3 u L^2 a component, its product with the direction by 8 u L^2.
    reference::ClosestSearch search{query.max_distance, query.two_sided, 16 * kU};
    const reference::ClosestHit strict =
        reference::closest_point(scene.positions, scene.triangles, point, direction, search);
    const Bound bound =
        strict.found ? bound_of(scene, strict.triangle, point, strict.distance) : Bound{};
    if (strict.found && bound.most < query.max_distance) {
      ASSERT_TRUE(ours.hit(i)) << "sample " << i << " lost a point at " << strict.distance;
    }
    if (!ours.hit(i)) {
      ASSERT_EQ(ours.status[i], KILN_STATUS_MISS);
      continue;
    }
    ++hits;
    ASSERT_EQ(ours.status[i], KILN_STATUS_CLOSEST);
    ASSERT_LT(ours.triangle[i], scene.triangles.size());
    const Triangle& triangle = scene.triangles[ours.triangle[i]];
    const reference::TriangleShape shape = reference::triangle_shape(scene.positions, triangle);
    const double distance = reference::triangle_distance(scene.positions, triangle, point);
    const Bound own = bound_of(scene, ours.triangle[i], point, distance);
    if (!query.two_sided) {
      double facing = 0;
      for (std::size_t k = 0; k < 3; ++k) facing += shape.normal[k] * direction[k];
      ASSERT_GE(facing, -16 * kU * shape.longest * shape.longest) << "sample " << i;
    }
    const double found = std::abs(static_cast<double>(ours.distance[i]));
    ASSERT_LE(found, query.max_distance * (1 + 4 * kU));
    ASSERT_GE(found, distance - own.rounding) << "sample " << i;
    ASSERT_LE(found, own.most) << "sample " << i;
    if (strict.found) {
      ASSERT_LE(distance, bound.most + own.rounding) << "sample " << i << ": not the nearest";
    }
    // The point that the weights name is that far away, on that side.
    const double u = ours.u[i];
    const double v = ours.v[i];
    ASSERT_GE(u, 0);
    ASSERT_GE(v, 0);
    ASSERT_LE(u + v, 1 + 4 * kU);
    const Vec3& a = scene.positions[triangle[0]];
    const Vec3& b = scene.positions[triangle[1]];
    const Vec3& c = scene.positions[triangle[2]];
    const double w = 1 - u - v;
    const Point named{w * a.x + u * b.x + v * c.x - q.x, w * a.y + u * b.y + v * c.y - q.y,
                      w * a.z + u * b.z + v * c.z - q.z};
    ASSERT_NEAR(std::hypot(named[0], named[1], named[2]), found, 2 * own.rounding) << i;
    const double along = named[0] * n.x + named[1] * n.y + named[2] * n.z;
    if (std::abs(along) > 2 * own.rounding) {
      ASSERT_EQ(ours.distance[i] < 0, along < 0) << i;
    }
  }
  EXPECT_GE(hits, least_hits);
}

/// Samples that lie `far` from the origin.
std::vector<Ray> far_samples(std::size_t count, float far) {
  std::vector<Ray> samples = random_rays(count, 8);
  for (Ray& ray : samples) {
    ray.origin = {far * ray.direction.x, far * ray.direction.y, far * ray.direction.z};
  }
  return samples;
}

std::vector<ClosestQuery> all_queries() {
  return {{0.1f, false}, {0.1f, true}, {0.3f, false}, {0.3f, true}, {8, false}, {8, true}};
}

TEST(ClosestKernel, AgreesWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  const std::vector<Scene> scenes = {random_soup(700, 3, 0.15f), random_soup(900, 4, 0.02f),
                                     bumpy_sphere(16, 4, 0.02f), scene_of(torus(40, 20), 0.25f)};
  // The oracle looks at every triangle for each of them.
  const std::size_t share = std::getenv("KILN_SMALL_CASES") == nullptr ? 1 : 10;
  const std::vector<Ray> random = random_rays(350 / share, 5);
  const std::vector<Ray> coherent = coherent_rays(400 / share, 6, 0.05f);
  for (const Scene& scene : scenes) {
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu, Traversal::automatic}) {
      const ClosestFinder finder = finder_of(scene, traversal);
      for (const ClosestQuery& query : all_queries()) {
        const bool all = query.max_distance > 1;
        SCOPED_TRACE(query.max_distance);
        expect_agrees(scene, random, query, find(finder, random, query),
                      all ? random.size() : 10 / share);
        expect_agrees(scene, coherent, query, find(finder, coherent, query),
                      all ? coherent.size() : 10 / share);
      }
    }
  }
}

TEST(ClosestKernel, AgreesWithTheOracleOnSlivers) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = sliver_soup(400, 9);
  const std::vector<Ray> samples = random_rays(1000, 5, 0.4f);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu, Traversal::automatic}) {
    for (const bool two_sided : {false, true}) {
      const ClosestQuery query{4, two_sided};
      expect_agrees(scene, samples, query, find(finder_of(scene, traversal), samples, query), 1000);
    }
  }
}

TEST(ClosestKernel, AgreesWithTheOracleFromFarAway) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = bumpy_sphere(12, 4, 0.02f);
  for (const float far : {30.0f, 3e4f, 1e6f}) {
    const std::vector<Ray> samples = far_samples(300, far);
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu, Traversal::automatic}) {
      const ClosestFinder finder = finder_of(scene, traversal);
      const ClosestQuery query{1048576, true};
      expect_agrees(scene, samples, query, find(finder, samples, query), samples.size());
      const Cast none = find(finder, samples, {far / 2, true});
      for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_FALSE(none.hit(i));
    }
  }
}

TEST(ClosestKernel, VariantsAgreeToTheBit) {
  KILN_REQUIRE_DEVICE();
  const std::vector<Scene> scenes = {random_soup(2000, 7, 0.1f), bumpy_sphere(40, 8, 0.01f),
                                     bumpy_sphere(8, 8, 0.0f), sliver_soup(300, 2)};
  for (const Scene& scene : scenes) {
    const auto tree = tree_of(scene);
    const ClosestFinder cpu(context_of(*device()), tree, Traversal::cpu);
    const ClosestFinder gpu(context_of(*device()), tree, Traversal::gpu);
    EXPECT_NE(cpu.traversal(), Traversal::gpu);
    EXPECT_EQ(gpu.traversal(), Traversal::gpu);
    for (const auto& samples :
         {random_rays(5000, 9), coherent_rays(6400, 10, 0), coherent_rays(6400, 11, 0.02f)}) {
      for (const ClosestQuery& query : all_queries()) {
        SCOPED_TRACE(query.max_distance);
        const Cast a = find(cpu, samples, query);
        const Cast b = find(gpu, samples, query);
        ASSERT_EQ(a.triangle, b.triangle);
        EXPECT_TRUE(a == b);
      }
    }
    // From far away the boxes' distances and the triangles' differ by less than their rounding.
    for (const float far : {3.0f, 30.0f, 3e4f}) {
      const std::vector<Ray> samples = far_samples(3000, far);
      const Cast a = find(cpu, samples, {1048576, true});
      const Cast b = find(gpu, samples, {1048576, true});
      ASSERT_EQ(a.triangle, b.triangle) << far;
      EXPECT_TRUE(a == b) << far;
    }
  }
}

/// The answer is a function of the sample and the triangles: neither the tree nor the samples before
/// matter.
TEST(ClosestKernel, NeitherTriangleNorSampleOrderMatters) {
  KILN_REQUIRE_DEVICE();
  for (const Scene& scene : {random_soup(1500, 7, 0.2f), bumpy_sphere(30, 8, 0.005f)}) {
    Scene turned = scene;
    std::reverse(turned.triangles.begin(), turned.triangles.end());
    std::vector<Ray> samples = coherent_rays(4096, 11, 0.02f);
    std::vector<Ray> shuffled = samples;
    std::vector<std::size_t> order(samples.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), std::mt19937(5));
    for (std::size_t i = 0; i < order.size(); ++i) shuffled[i] = samples[order[i]];
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
      const ClosestQuery query{0.3f, false};
      const Cast straight = find(finder_of(scene, traversal), samples, query);
      const Cast reversed = find(finder_of(turned, traversal), samples, query);
      const Cast mixed = find(finder_of(scene, traversal), shuffled, query);
      for (std::size_t i = 0; i < samples.size(); ++i) {
        ASSERT_EQ(std::abs(straight.distance[i]), std::abs(reversed.distance[i])) << i;
      }
      for (std::size_t i = 0; i < order.size(); ++i) {
        ASSERT_EQ(mixed.triangle[i], straight.triangle[order[i]]) << i;
        ASSERT_EQ(mixed.distance[i], straight.distance[order[i]]) << i;
        ASSERT_EQ(mixed.u[i], straight.u[order[i]]) << i;
      }
      const std::vector<Ray> far = far_samples(2000, 1e3f);
      const Cast from_far = find(finder_of(scene, traversal), far, {1048576, true});
      const Cast from_far_reversed = find(finder_of(turned, traversal), far, {1048576, true});
      for (std::size_t i = 0; i < far.size(); ++i) {
        ASSERT_EQ(std::abs(from_far.distance[i]), std::abs(from_far_reversed.distance[i])) << i;
      }
    }
  }
}

}  // namespace
}  // namespace kiln::test
