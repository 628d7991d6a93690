// The closest-point kernels at the edges: ties, sides, counts, bad samples and bad triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "accel/closest.h"
#include "accel/closest_scene.h"
#include "kiln/error.h"
#include "kiln/render.h"
#include "shared/match.h"
#include "support/ray_scene.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

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
