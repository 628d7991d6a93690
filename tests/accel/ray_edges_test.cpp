// The ray kernels at the edges: counts, rays that are none, bad triangles, box planes.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "accel/ray.h"
#include "kiln/error.h"
#include "kiln/render.h"
#include "shared/match.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

TEST(RayKernel, CountsAroundTheWorkGroupAndNone) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = random_soup(300, 3, 0.2f);
  const RayQuery query{.t_min = 0, .t_max = 1, .two_sided = true};
  const std::vector<Ray> rays = random_rays(4200, 8);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(scene, traversal);
    const Cast all = cast(caster, rays, query);
    for (std::size_t count : {0u, 1u, 7u, 8u, 9u, 63u, 64u, 65u, 127u, 255u, 257u, 4095u, 4097u}) {
      const std::vector<Ray> some(rays.begin(), rays.begin() + static_cast<std::ptrdiff_t>(count));
      const Cast part = cast(caster, some, query);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(part.triangle[i], all.triangle[i]) << count;
        ASSERT_EQ(part.distance[i], all.distance[i]) << count;
      }
    }
  }
}

TEST(RayKernel, SamplesThatAreNoRaysMiss) {
  KILN_REQUIRE_DEVICE();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const Ray good{{0, 0, 0}, {0, 0, 1}};
  const std::vector<Ray> rays = {
      good,
      {{nan, 0, 0}, {0, 0, 1}},
      {{0, infinity, 0}, {0, 0, 1}},
      {{0, 0, 0}, {0, 0, 0}},
      {{0, 0, 0}, {0, nan, 1}},
      {{0, 0, 0}, {infinity, 0, 0}},
      {{0, 0, -1e30f}, {0, 0, 1}},
      {{0, 0, 0}, {0, 0, 3}},  // too long
      good,
  };
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result =
        cast(caster_of(slab(), traversal), rays, {.t_min = 0, .t_max = 10, .two_sided = true});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const bool expected = i == 0 || i + 1 == rays.size();
      EXPECT_EQ(result.hit(i), expected) << i;
      EXPECT_EQ(result.status[i], expected ? KILN_STATUS_OUTWARD : KILN_STATUS_MISS) << i;
      if (!expected) {
        EXPECT_EQ(result.distance[i], 0.0f);
        EXPECT_EQ(result.u[i], 0.0f);
        EXPECT_EQ(result.v[i], 0.0f);
      }
    }
  }
}

TEST(RayKernel, BadTrianglesAreCountedAndNeverHit) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  scene.add({-1, -1, 0.1f}, {1, -1, 0.1f}, {0, std::nanf(""), 0.1f});
  scene.add({-1, -1, 0.2f}, {1, -1, 0.2f}, {1, -1, 0.2f});
  scene.add({-1, -1, 0.3f}, {1, -1, 0.3f}, {0, 1, 0.3f});
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(scene, traversal);
    EXPECT_EQ(caster.stats().triangles, 1u);
    EXPECT_EQ(caster.stats().skipped, 2u);
    EXPECT_GT(caster.stats().bytes, 0u);
    const Cast result = cast(caster, {{{0, 0, 0}, {0, 0, 1}}}, {.t_min = 0, .t_max = 1});
    EXPECT_EQ(result.triangle[0], 2u);
  }
}

TEST(RayKernel, EmptyMeshIsAllMisses) {
  KILN_REQUIRE_DEVICE();
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result =
        cast(caster_of({}, traversal), random_rays(100, 1), {.t_min = 0, .t_max = 1});
    for (std::uint8_t status : result.status) EXPECT_EQ(status, KILN_STATUS_MISS);
  }
}

TEST(RayKernel, RaysWithinBoxPlanesAndAlongAxes) {
  KILN_REQUIRE_DEVICE();
  // A flat grid: all its boxes are flat, and rays run within their planes and across them.
  Scene grid;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const auto at = [](int column, int row) {
        return Vec3{static_cast<float>(column) / 16 - 0.5f, static_cast<float>(row) / 16 - 0.5f, 0};
      };
      grid.add(at(x, y), at(x + 1, y), at(x + 1, y + 1));
      grid.add(at(x, y), at(x + 1, y + 1), at(x, y + 1));
    }
  }
  std::vector<Ray> across;
  std::vector<Ray> within;
  for (int y = 0; y <= 64; ++y) {
    for (int x = 0; x <= 64; ++x) {
      const Vec3 p{static_cast<float>(x) / 64 - 0.5f, static_cast<float>(y) / 64 - 0.5f, 0};
      across.push_back({{p.x, p.y, -0.25f}, {0, 0, 1}});
      within.push_back({p, {1, 0, 0}});
      within.push_back({p, {0, -1, 0}});
    }
  }
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(grid, traversal);
    const Cast hits = cast(caster, across, {.t_min = 0, .t_max = 1});
    for (std::size_t i = 0; i < across.size(); ++i) {
      EXPECT_TRUE(hits.hit(i)) << i;
      EXPECT_EQ(hits.distance[i], 0.25f) << i;
    }
    // A face seen exactly edge on has no area to hit.
    const Cast none = cast(caster, within, {.t_min = -1, .t_max = 1, .two_sided = true});
    for (std::size_t i = 0; i < within.size(); ++i) EXPECT_FALSE(none.hit(i)) << i;
  }
}

TEST(RayKernel, MoreRaysThanOneLaunch) {
  KILN_REQUIRE_DEVICE();
  std::vector<Ray> rays((1u << 20) + 77);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i] = {{0, 0, i % 2 == 0 ? 0.0f : 0.3f}, {0, 0, 1}};
  }
  const Cast result = cast(caster_of(slab()), rays, {.t_min = 0, .t_max = 1});
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(result.hit(i), i % 2 == 0) << i;
}

TEST(RayKernel, QueryOutOfRangeIsAUsageError) {
  KILN_REQUIRE_DEVICE();
  const RayCaster caster = caster_of(slab());
  for (const RayQuery& query : {RayQuery{.t_min = 1, .t_max = 0}, RayQuery{.t_max = std::nanf("")},
                                RayQuery{.t_max = std::numeric_limits<float>::infinity()}}) {
    try {
      cast(caster, {{{0, 0, 0}, {0, 0, 1}}}, query);
      FAIL() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
    }
  }
}

}  // namespace
}  // namespace kiln::test
