// The any-hit kernels against the brute-force oracle, their variants against each other, the edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "accel/ray.h"
#include "kiln/render.h"
#include "reference/ray.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

/// Rays as ambient occlusion casts them: `per_point` from each of neighbouring points of the mesh,
/// in all directions.
std::vector<Ray> ambient_rays(const Scene& scene, std::size_t count, std::size_t per_point,
                              unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> share(0, 0.5f);
  std::vector<Ray> rays(count);
  Vec3 from{};
  for (std::size_t i = 0; i < count; ++i) {
    if (i % per_point == 0) {
      const Triangle& triangle = scene.triangles[i * scene.triangles.size() / count];
      const Vec3& a = scene.positions[triangle[0]];
      const Vec3& b = scene.positions[triangle[1]];
      const Vec3& c = scene.positions[triangle[2]];
      const float u = share(random);
      const float v = share(random);
      from = {a.x + u * (b.x - a.x) + v * (c.x - a.x), a.y + u * (b.y - a.y) + v * (c.y - a.y),
              a.z + u * (b.z - a.z) + v * (c.z - a.z)};
    }
    rays[i] = {from, random_unit(random), 0.02f};
  }
  return rays;
}

/// Rays that sit on what the traversals decide by: along axes, with zeros of both signs and tiny
/// components, equal components, within planes of boxes, from far away; and some that are no rays.
std::vector<Ray> awkward_rays(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const float components[] = {0.0f,   -0.0f,   1.0f,   -1.0f,  1e-20f, -1e-20f, 1e-7f, -1e-7f,
                              0.577f, -0.577f, 1e-40f, -1e-9f, 2.0f,   -2.0f,   0.3f,  -0.3f};
  const float places[] = {0.0f, -0.0f, 0.25f, -0.25f, 0.4f, -0.4f, 0.0625f, 1e-30f, 3.0f, -100.0f};
  const float bad[] = {nan, infinity, -infinity, 1e30f, 2.1e6f};
  const auto pick = [&](const auto& from) { return from[random() % std::size(from)]; };
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    ray = {{pick(places), pick(places), pick(places)},
           {pick(components), pick(components), pick(components)},
           pick(places)};
    if (random() % 16 == 0) ray.origin.y = pick(bad);
    if (random() % 16 == 0) ray.direction.x = pick(bad);
    if (random() % 16 == 0) ray.direction = {0, -0.0f, 1e-7f};
  }
  return rays;
}

/// Rays at the mesh from 1 to 10^5 away, where rounding of t is large against the mesh.
std::vector<Ray> distant_rays(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.4f, 0.4f);
  std::uniform_real_distribution<float> exponent(0, 5);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const Vec3 n = random_unit(random);
    const float away = std::pow(10.0f, exponent(random));
    ray = {{place(random) - away * n.x, place(random) - away * n.y, place(random) - away * n.z}, n};
  }
  return rays;
}

/// Obstacles of each ray, by the oracle: 1 something, 0 nothing, 2 too close to tell.
std::vector<int> oracle_occlusion(const Scene& scene, const std::vector<Ray>& rays,
                                  const RayQuery& query) {
  std::vector<int> result;
  for (const Ray& ray : rays) {
    const double sign = query.inward ? -1 : 1;
    const double offset = query.use_reach ? ray.reach : query.offset;
    const Vec3 p = ray.origin;
    const Vec3 n = ray.direction;
    const auto found = [&](double slack) {
      reference::RaySearch search{.t_min = query.t_min - 0.1 * slack,
                                  .t_max = query.t_max + 0.1 * slack,
                                  .nearest_outward_first = false,
                                  .keep = query.two_sided ? 0
                                          : query.inward  ? -1
                                                          : 1,
                                  .slack = slack};
      return reference::cast_ray(scene.positions, scene.triangles,
                                 {p.x + offset * n.x, p.y + offset * n.y, p.z + offset * n.z},
                                 {sign * n.x, sign * n.y, sign * n.z}, search)
          .found;
    };
    const bool strict = found(-1e-4);
    result.push_back(strict == found(1e-4) ? (strict ? 1 : 0) : 2);
  }
  return result;
}

TEST(OcclusionKernel, AgreesWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  const Scene soup = random_soup(500, 13, 0.12f);
  const Scene sphere = bumpy_sphere(14, 14, 0.03f);
  const RayQuery ambient{.t_min = 1e-2f, .t_max = 0.3f, .two_sided = true};
  for (const Scene* scene : {&soup, &sphere}) {
    for (const auto& rays : {random_rays(800, 15), ambient_rays(*scene, 1200, 16, 16)}) {
      std::vector<RayCase> cases = all_queries();
      cases.push_back({"ambient", ambient});
      for (const RayCase& entry : cases) {
        SCOPED_TRACE(entry.name);
        const std::vector<int> expected = oracle_occlusion(*scene, rays, entry.query);
        for (Traversal traversal : {Traversal::cpu, Traversal::cpu_single, Traversal::gpu}) {
          const std::vector<std::uint8_t> hit =
              occluded(caster_of(*scene, traversal), rays, entry.query);
          std::array<std::size_t, 2> seen{};
          for (std::size_t i = 0; i < rays.size(); ++i) {
            ASSERT_LE(hit[i], 1);
            if (expected[i] == 2) continue;
            ASSERT_EQ(hit[i], expected[i]) << i;
            ++seen[hit[i]];
          }
          EXPECT_GT(seen[1], rays.size() / 50);
          // Rays that start on the mesh are too close to tell where t = 0 counts.
          EXPECT_GT(seen[0] + seen[1], rays.size() / 4);
        }
      }
    }
  }
}

TEST(OcclusionKernel, VariantsAgreeToTheBit) {
  KILN_REQUIRE_DEVICE();
  std::vector<Scene> scenes;
  scenes.push_back(random_soup(3000, 7, 0.1f));
  scenes.push_back(random_soup(300, 8, 0.8f));
  scenes.push_back(bumpy_sphere(40, 8, 0.01f));
  scenes.push_back({});
  // A grid on z = 0 whose corners are where awkward rays start.
  Scene grid;
  for (int y = -4; y < 4; ++y) {
    for (int x = -4; x < 4; ++x) {
      const auto at = [](int column, int row) {
        return Vec3{static_cast<float>(column) / 16, static_cast<float>(row) / 16, 0};
      };
      grid.add(at(x, y), at(x + 1, y), at(x + 1, y + 1));
      grid.add(at(x, y), at(x + 1, y + 1), at(x, y + 1));
    }
  }
  scenes.push_back(grid);
  std::vector<RayCase> cases = all_queries();
  cases.push_back({"a point", {.t_min = 0, .t_max = 0, .two_sided = true}});
  cases.push_back({"behind", {.t_min = -3, .t_max = -1e-3f, .two_sided = true}});
  cases.push_back({"very far", {.t_min = -1e6f, .t_max = 1e6f, .two_sided = true}});
  cases.push_back({"ambient", {.t_min = 1e-4f, .t_max = 2, .two_sided = true}});
  for (const Scene& scene : scenes) {
    const RayCaster stream = caster_of(scene, Traversal::cpu);
    const RayCaster single = caster_of(scene, Traversal::cpu_single);
    const RayCaster scalar = caster_of(scene, Traversal::gpu);
    std::vector<std::vector<Ray>> sets{awkward_rays(5000, 1), random_rays(3000, 2, 3.0f),
                                       distant_rays(20000, 4)};
    if (!scene.triangles.empty()) sets.push_back(ambient_rays(scene, 5000, 8, 3));
    for (const std::vector<Ray>& rays : sets) {
      for (const RayCase& entry : cases) {
        SCOPED_TRACE(entry.name);
        const std::vector<std::uint8_t> hit = occluded(stream, rays, entry.query);
        ASSERT_EQ(hit, occluded(single, rays, entry.query));
        ASSERT_EQ(hit, occluded(scalar, rays, entry.query));
        const Cast closest = cast(stream, rays, entry.query);
        for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(hit[i] != 0, closest.hit(i)) << i;
      }
    }
  }
}

/// A ray's answer does not depend on its company: prefixes of awkward lengths, and reversed order.
TEST(OcclusionKernel, CountsAroundTheVectorTheStreamAndTheBlock) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = random_soup(400, 3, 0.2f);
  const RayQuery query{.t_min = 0, .t_max = 0.3f, .use_reach = true, .two_sided = true};
  std::vector<Ray> rays = ambient_rays(scene, 6200, 4, 8);
  const std::vector<Ray> awkward = awkward_rays(6200, 9);
  for (std::size_t i = 0; i < rays.size(); i += 3) rays[i] = awkward[i];
  for (Traversal traversal : {Traversal::cpu, Traversal::cpu_single, Traversal::gpu}) {
    const RayCaster caster = caster_of(scene, traversal);
    const std::vector<std::uint8_t> all = occluded(caster, rays, query);
    for (std::size_t count :
         {0u,    1u,    2u,    3u,    4u,    5u,    15u,   16u,   17u,   63u,   64u,   65u,  127u,
          1023u, 1024u, 1025u, 1039u, 1041u, 2047u, 2049u, 3000u, 4095u, 4097u, 6143u, 6145u}) {
      const auto end = static_cast<std::ptrdiff_t>(count);
      const std::vector<std::uint8_t> part =
          occluded(caster, std::vector<Ray>(rays.begin(), rays.begin() + end), query);
      EXPECT_EQ(part, std::vector<std::uint8_t>(all.begin(), all.begin() + end)) << count;
    }
    std::vector<std::uint8_t> reversed =
        occluded(caster, std::vector<Ray>(rays.rbegin(), rays.rend()), query);
    EXPECT_EQ(std::vector<std::uint8_t>(reversed.rbegin(), reversed.rend()), all);
  }
}

TEST(OcclusionKernel, SamplesThatAreNoRaysAreNotOccluded) {
  KILN_REQUIRE_DEVICE();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const Ray good{{0, 0, 0}, {0, 0, 1}};
  const std::vector<Ray> bad = {
      {{nan, 0, 0}, {0, 0, 1}},   {{0, infinity, 0}, {0, 0, 1}}, {{0, 0, 0}, {0, 0, 0}},
      {{0, 0, 0}, {0, nan, 1}},   {{0, 0, 0}, {infinity, 0, 0}}, {{0, 0, -1e30f}, {0, 0, 1}},
      {{0, 0, 0}, {0, 0, 1e-7f}}, {{0, 0, 0}, {0, 0, 2.1f}},     {{0, 0, 0}, {0, 0, 1}, nan},
  };
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < 700; ++i) rays.push_back(i % 3 == 0 ? good : bad[i % bad.size()]);
  const RayQuery query{.t_min = 0, .t_max = 10, .use_reach = true, .two_sided = true};
  for (Traversal traversal : {Traversal::cpu, Traversal::cpu_single, Traversal::gpu}) {
    const std::vector<std::uint8_t> hit = occluded(caster_of(slab(), traversal), rays, query);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(hit[i], i % 3 == 0 ? 1 : 0) << i;
  }
}

/// Triangles in size from 1 to 2^-40 about one point make the deepest tree there is; all rays
/// through the point visit all of it.
TEST(OcclusionKernel, DeepTrees) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  float size = 0.4f;
  for (int i = 0; i < 40; ++i, size *= 0.5f) {
    for (int k = 0; k < 24; ++k) {
      const float at = size * (1 + static_cast<float>(k) / 24);
      scene.add({at, 0, 0}, {0, at, 0}, {0, 0, at});
      scene.add({-at, 0, 0}, {0, -at, 0}, {0, 0, -at});
    }
  }
  std::mt19937 random(3);
  std::vector<Ray> rays(1500);
  for (Ray& ray : rays) {
    const Vec3 n = random_unit(random);
    ray = {{-0.9f * n.x, -0.9f * n.y, -0.9f * n.z}, n};
  }
  for (const RayQuery& query :
       {RayQuery{.t_min = 0, .t_max = 2, .two_sided = true}, RayQuery{.t_min = 0, .t_max = 2},
        RayQuery{.t_min = 0.9f, .t_max = 0.9f, .two_sided = true}}) {
    const std::vector<std::uint8_t> hit = occluded(caster_of(scene, Traversal::cpu), rays, query);
    EXPECT_EQ(hit, occluded(caster_of(scene, Traversal::gpu), rays, query));
    // Six octants of eight are empty.
    EXPECT_GT(std::count(hit.begin(), hit.end(), 0), 500);
    if (query.t_min == 0) {
      EXPECT_GT(std::count(hit.begin(), hit.end(), 1), 100);
    }
  }
}

TEST(OcclusionKernel, MoreRaysThanOneLaunch) {
  KILN_REQUIRE_DEVICE();
  std::vector<Ray> rays((1u << 20) + 77);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i] = {{0, 0, i % 2 == 0 ? 0.0f : 0.3f}, {0, 0, 1}};
  }
  const std::vector<std::uint8_t> hit = occluded(caster_of(slab()), rays, {.t_min = 0, .t_max = 1});
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(hit[i], i % 2 == 0 ? 1 : 0) << i;
}

}  // namespace
}  // namespace kiln::test
