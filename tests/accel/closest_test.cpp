// The closest-point kernels against the brute-force oracle, their variants against each other, and the
// edges.
#include "accel/closest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "kiln/error.h"
#include "reference/closest.h"
#include "shared/match.h"
#include "support/ray_scene.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

using Point = std::array<double, 3>;
constexpr double kU = 0x1p-24;  // half a unit in the last place of 1

std::shared_ptr<const Tree> tree_of(const Scene& scene) {
  return std::make_shared<const Tree>(context_of(*device()), scene.positions, scene.triangles);
}

ClosestFinder finder_of(const Scene& scene, Traversal traversal) {
  return ClosestFinder(context_of(*device()), tree_of(scene), traversal);
}

Cast find(const ClosestFinder& finder, const std::vector<Ray>& samples, const ClosestQuery& query) {
  return match_of(samples, [&](const cl::Array<float>& points, std::uint32_t count,
                               std::uint32_t capacity, Correspondence& result) {
    finder.find(points, count, capacity, query, result);
  });
}

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

/// What kernels/lib/nearest.clh promises: how far our distance to a triangle may be above the true one
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
  const std::vector<Ray> random = random_rays(700, 5);
  const std::vector<Ray> coherent = coherent_rays(800, 6, 0.05f);
  for (const Scene& scene : scenes) {
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
      const ClosestFinder finder = finder_of(scene, traversal);
      for (const ClosestQuery& query : all_queries()) {
        const bool all = query.max_distance > 1;
        SCOPED_TRACE(query.max_distance);
        expect_agrees(scene, random, query, find(finder, random, query), all ? 700 : 10);
        expect_agrees(scene, coherent, query, find(finder, coherent, query), all ? 800 : 10);
      }
    }
  }
}

TEST(ClosestKernel, AgreesWithTheOracleOnSlivers) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = sliver_soup(400, 9);
  const std::vector<Ray> samples = random_rays(1000, 5, 0.4f);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
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
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
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

TEST(ClosestKernel, PointsOfTheSurfaceAreTheirOwnNearest) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = bumpy_sphere(20, 3, 0.01f);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> share(0, 1);
  std::vector<Ray> samples;
  std::vector<bool> exact;
  for (const Triangle& triangle : scene.triangles) {
    const Vec3& a = scene.positions[triangle[0]];
    const Vec3& b = scene.positions[triangle[1]];
    const Vec3& c = scene.positions[triangle[2]];
    const auto add = [&](float u, float v) {
      const float w = 1 - u - v;
      samples.push_back(
          {{w * a.x + u * b.x + v * c.x, w * a.y + u * b.y + v * c.y, w * a.z + u * b.z + v * c.z},
           unit(a)});
      exact.push_back(u == 1 || (u == 0 && (v == 0 || v == 1)));
    };
    add(0, 0);
    add(1, 0);
    add(0, 1);
    add(0.5f, 0);
    add(0, share(random));
    const float s = share(random);
    add(s, 1 - s);
    add(0.5f * share(random), 0.5f * share(random));
  }
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(scene, traversal), samples, {0.1f, false});
    for (std::size_t i = 0; i < samples.size(); ++i) {
      ASSERT_TRUE(result.hit(i));
      // The sample is off by its own rounding, 3 u of 0.5; vectors are shorter than 0.2.
      ASSERT_LE(std::abs(result.distance[i]), exact[i] ? 0 : 4 * kU) << i;
      if (!exact[i]) continue;
      // A corner goes to the lowest of its triangles.
      std::uint32_t lowest = 0;
      const auto touches = [&](const Triangle& triangle) {
        return std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t corner) {
          const Vec3& v = scene.positions[corner];
          const Vec3& q = samples[i].origin;
          return v.x == q.x && v.y == q.y && v.z == q.z;
        });
      };
      while (!touches(scene.triangles[lowest])) ++lowest;
      ASSERT_EQ(result.triangle[i], lowest);
    }
  }
}

TEST(ClosestKernel, TiesGoToTheLowestTriangle) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  for (int i = 0; i < 40; ++i) scene.add({-1, -1, 0.25f}, {1, -1, 0.25f}, {0, 1, 0.25f});
  // Over corners and edges, too.
  std::vector<Ray> samples = random_rays(500, 3, 2);
  for (Ray& ray : samples) ray.direction = {0, 0, 1};
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(scene, traversal), samples, {8, false});
    for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(result.triangle[i], 0u);
  }
  // A fan around a corner: beyond it, all its triangles are equally near.
  Scene fan;
  for (int i = 0; i < 24; ++i) {
    const float phi = static_cast<float>(i % 12) * 0.5f;
    fan.add({0, 0, 0.4f}, {0.3f * std::cos(phi), 0.3f * std::sin(phi), 0},
            {0.3f * std::cos(phi + 0.5f), 0.3f * std::sin(phi + 0.5f), 0});
    // The corner at each place.
    std::rotate(fan.triangles.back().begin(), fan.triangles.back().begin() + i % 3,
                fan.triangles.back().end());
  }
  std::vector<Ray> above = random_rays(300, 4, 0.05f);
  for (Ray& ray : above) {
    ray.origin.z += 0.6f;
    ray.direction = {0, 0, 1};
  }
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(fan, traversal), above, {8, true});
    for (std::size_t i = 0; i < above.size(); ++i) EXPECT_EQ(result.triangle[i], 0u);
  }
}

TEST(ClosestKernel, FacingStatusAndDistance) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = slab();
  struct Row {
    const char* name;
    Vec3 origin, direction;
    ClosestQuery query;
    std::uint32_t triangle;
    float distance;
  };
  const std::uint32_t none = 0xFFFFFFFFu;
  const Vec3 up{0, 0, 1};
  const Vec3 down{0, 0, -1};
  const Row rows[] = {
      {"the top from below it", {0, 0, 0.125f}, up, {1, false}, 0, 0.125f},
      {"the top from above it", {0, 0, 0.5f}, up, {1, false}, 0, -0.25f},
      {"the bottom from above it", {0, 0, 0.125f}, down, {1, false}, 1, 0.375f},
      {"the bottom from below it", {0, 0, -0.5f}, down, {1, false}, 1, -0.25f},
      {"the nearer one is turned away", {0, 0, -0.125f}, up, {1, false}, 0, 0.375f},
      {"unless both sides count", {0, 0, -0.125f}, up, {1, true}, 1, -0.125f},
      {"seen edge on", {0, 0, 0.125f}, {1, 0, 0}, {1, false}, 0, 0.125f},
      {"ends on it", {0, 0, 0.5f}, up, {0.25f, false}, 0, -0.25f},
      {"too far", {0, 0, 0.5f}, up, {0.2499f, false}, none, 0},
      {"the turned one is near, the other far", {0, 0, -0.25f}, up, {0.4f, false}, none, 0},
      {"on it", {0, 0, 0.25f}, up, {0, false}, 0, 0},
      {"beside it", {0, 1.5f, 0.25f}, up, {1, false}, 0, 0.5f},
  };
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const ClosestFinder finder = finder_of(scene, traversal);
    for (const Row& row : rows) {
      SCOPED_TRACE(row.name);
      const Cast result = find(finder, {{row.origin, row.direction}}, row.query);
      EXPECT_EQ(result.triangle[0], row.triangle);
      EXPECT_EQ(result.distance[0], row.distance);
      EXPECT_EQ(result.status[0], row.triangle == none ? KILN_STATUS_MISS : KILN_STATUS_CLOSEST);
    }
  }
}

TEST(ClosestKernel, CountsAroundTheGroupsAndNone) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = random_soup(300, 3, 0.2f);
  const ClosestQuery query{1, true};
  const std::vector<Ray> samples = coherent_rays(8200, 8, 0.1f);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const ClosestFinder finder = finder_of(scene, traversal);
    const Cast all = find(finder, samples, query);
    for (std::size_t count :
         {0u, 1u, 7u, 8u, 15u, 16u, 17u, 63u, 65u, 255u, 256u, 257u, 4095u, 4096u, 4097u, 8191u}) {
      const std::vector<Ray> some(samples.begin(),
                                  samples.begin() + static_cast<std::ptrdiff_t>(count));
      const Cast part = find(finder, some, query);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(part.triangle[i], all.triangle[i]) << count;
        ASSERT_EQ(part.distance[i], all.distance[i]) << count;
      }
    }
  }
}

TEST(ClosestKernel, SamplesThatAreNoneMiss) {
  KILN_REQUIRE_DEVICE();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const Ray good{{0, 0, 0}, {0, 0, 1}};
  std::vector<Ray> samples = {
      good,
      {{nan, 0, 0}, {0, 0, 1}},
      {{0, infinity, 0}, {0, 0, 1}},
      {{0, 0, 0}, {0, 0, 0}},
      {{0, 0, 0}, {0, nan, 1}},
      {{0, 0, 0}, {infinity, 0, 0}},
      {{0, 0, -1e30f}, {0, 0, 1}},
      good,
  };
  const std::size_t bad = samples.size();
  // Groups with and without a bad sample.
  samples.resize(100, good);
  samples[70] = samples[1];
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(slab(), traversal), samples, {10, true});
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const bool expected = i == 0 || (i + 1 >= bad && i != 70);
      EXPECT_EQ(result.hit(i), expected) << i;
      EXPECT_EQ(result.status[i], expected ? KILN_STATUS_CLOSEST : KILN_STATUS_MISS) << i;
      EXPECT_EQ(result.distance[i], expected ? 0.25f : 0.0f);
      if (!expected) {
        EXPECT_EQ(result.u[i], 0.0f);
        EXPECT_EQ(result.v[i], 0.0f);
      }
    }
  }
}

TEST(ClosestKernel, BadTrianglesAreNeverFound) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  scene.add({-1, -1, 0.1f}, {1, -1, 0.1f}, {0, std::nanf(""), 0.1f});
  scene.add({-1, -1, 0.2f}, {1, -1, 0.2f}, {1, -1, 0.2f});
  scene.add({-1, -1, 0.3f}, {1, -1, 0.3f}, {0, 1, 0.3f});
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(scene, traversal), {{{0, 0, 0}, {0, 0, 1}}}, {1, true});
    EXPECT_EQ(result.triangle[0], 2u);
    const Cast empty = find(finder_of({}, traversal), random_rays(100, 1), {1, true});
    for (std::uint8_t status : empty.status) EXPECT_EQ(status, KILN_STATUS_MISS);
  }
}

/// Triangles so small that squares of their edges vanish, and all lying in one point.
TEST(ClosestKernel, VanishingTrianglesGiveFiniteAnswers) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  for (const float size : {1e-7f, 1e-12f, 1e-18f, 1e-22f, 1e-30f}) {
    scene.add({0, 0, 0}, {size, 0, 0}, {0, size, 0});
  }
  const std::vector<Ray> samples = random_rays(300, 4);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = find(finder_of(scene, traversal), samples, {4, true});
    for (std::size_t i = 0; i < samples.size(); ++i) {
      ASSERT_TRUE(result.hit(i));
      const Vec3 q = samples[i].origin;
      ASSERT_NEAR(std::abs(result.distance[i]), std::hypot(q.x, q.y, q.z), 1e-6);
      ASSERT_GE(result.u[i], 0);
      ASSERT_GE(result.v[i], 0);
      ASSERT_LE(result.u[i] + result.v[i], 1.000001f);
    }
  }
}

TEST(ClosestKernel, AskingForNonsenseIsAnError) {
  KILN_REQUIRE_DEVICE();
  const ClosestFinder finder = finder_of(slab(), Traversal::automatic);
  for (const float distance : {-1.0f, std::numeric_limits<float>::quiet_NaN(),
                               std::numeric_limits<float>::infinity(), 2e6f}) {
    EXPECT_THROW(find(finder, random_rays(10, 1), {distance, false}), Error) << distance;
  }
}

}  // namespace
}  // namespace kiln::test
