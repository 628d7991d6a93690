// Outermost rays: which of several faces, the mark of several, and the limit; the oracle's cases are in
// ray_test.cpp.
#include <gtest/gtest.h>

#include <vector>

#include "accel/ray.h"
#include "kiln/render.h"
#include "shared/match.h"
#include "shared/ray.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

constexpr std::uint8_t kSeveral = KILN_RAY_SEVERAL;

/// Triangles that look up, at these heights.
Scene stack_of(const std::vector<float>& heights) {
  Scene scene;
  for (const float z : heights) scene.add({-1, -1, z}, {1, -1, z}, {0, 1, z});
  return scene;
}

struct Row {
  const char* name;
  std::vector<float> heights;
  float t_min, t_max;
  std::uint32_t triangle;
  std::uint8_t status;
};

TEST(OutermostRay, TakesTheGreatestAndMarksSeveral) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  const std::vector<Row> rows = {
      {"one outward", {0.1F}, -1, 1, 0, KILN_STATUS_OUTWARD},
      {"one at 0", {0}, -1, 1, 0, KILN_STATUS_OUTWARD},
      {"one inward", {-0.1F}, -1, 1, 0, KILN_STATUS_INWARD},
      {"the nearest inward", {-0.3F, -0.1F, -0.2F}, -1, 1, 1, KILN_STATUS_INWARD},
      {"inward and outward are not several", {-0.1F, 0.1F}, -1, 1, 1, KILN_STATUS_OUTWARD},
      {"at 0 and above", {0, 0.1F}, -1, 1, 1, KILN_STATUS_OUTWARD | kSeveral},
      {"above and at 0", {0.1F, 0}, -1, 1, 0, KILN_STATUS_OUTWARD | kSeveral},
      {"three", {0.1F, 0.3F, 0.2F}, -1, 1, 1, KILN_STATUS_OUTWARD | kSeveral},
      {"one place twice is one", {0.1F, 0.1F}, -1, 1, 0, KILN_STATUS_OUTWARD},
      {"beyond the reach", {0.1F, 0.5F}, -1, 0.4F, 0, KILN_STATUS_OUTWARD},
      {"none", {0.5F, -0.5F}, -0.4F, 0.4F, kNone, KILN_STATUS_MISS},
  };
  for (const Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    for (const Row& row : rows) {
      SCOPED_TRACE(row.name);
      const Scene scene = stack_of(row.heights);
      const RayQuery query{.t_min = row.t_min, .t_max = row.t_max, .outermost = true};
      // A whole beam, and one ray beside it.
      const std::vector<Ray> rays(65, Ray{{0, 0, 0}, {0, 0, 1}});
      const Cast result = cast(caster_of(scene, traversal), rays, query);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(result.triangle[i], row.triangle);
        ASSERT_EQ(result.status[i], row.status);
      }
    }
  }
}

TEST(OutermostRay, EndsAtItsLimit) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = stack_of({0, 0.1F, 0.2F, 0.3F});
  const RayQuery query{.t_min = -1, .t_max = 0.25F, .outermost = true, .has_ray_limits = true};
  std::vector<Ray> rays;
  for (int i = 0; i < 65; ++i) {
    rays.push_back({{0, 0, 0}, {0, 0, 1}, 0.05F + 0.1F * static_cast<float>(i % 5)});
  }
  for (const Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = cast(caster_of(scene, traversal), rays, query);
    // Limits of 0.05, 0.15, 0.25, 0.35 and 0.45, none above 0.25.
    const std::uint32_t expected[5] = {0, 1, 2, 2, 2};
    for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(result.triangle[i], expected[i % 5]);
  }
}

/// The mark must not depend on the order in which a tree is walked: against counting, by rays that start
/// behind each hit.
TEST(OutermostRay, MarksSeveralExactly) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = random_soup(1500, 21, 0.15F);
  const std::vector<Ray> rays = random_rays(3000, 22);
  const float reach = 0.5F;
  for (const Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(scene, traversal);
    const Cast outer = cast(caster, rays, {.t_min = -reach, .t_max = reach, .outermost = true});
    const Cast first = cast(caster, rays, {.t_min = 0, .t_max = reach});
    std::size_t several = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const bool two = first.hit(i) && first.distance[i] != outer.distance[i];
      ASSERT_EQ((outer.status[i] & kSeveral) != 0, two) << i;
      several += two ? 1 : 0;
    }
    EXPECT_GT(several, rays.size() / 10);
  }
}

}  // namespace
}  // namespace kiln::test
