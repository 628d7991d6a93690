// The ray kernels against the brute-force oracle, and their variants against each other: hits, sides,
// ties.
#include "accel/ray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "kiln/render.h"
#include "reference/ray.h"
#include "shared/match.h"
#include "support/ray_scene.h"

namespace kiln::test {
namespace {

/// Our result must lie between the oracle's with a little less and a little more than the triangles.
void expect_agrees(const Scene& scene, const std::vector<Ray>& rays, const RayQuery& query,
                   const Cast& ours) {
  // Positions and origins are below 2 in magnitude: a sheared coordinate is off by some 4 ulp of 2,
  // 5e-7; against edges of 0.02 and more that is a barycentric error below 1e-4. In depth the same
  // error is divided by the cosine between ray and triangle: slack and tolerance allow 1e-3 there.
  const double slack = 1e-4;
  std::size_t hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double sign = query.inward ? -1 : 1;
    const double offset = query.use_reach ? rays[i].reach : query.offset;
    const Vec3 p = rays[i].origin;
    const Vec3 n = rays[i].direction;
    const std::array<double, 3> origin{p.x + offset * n.x, p.y + offset * n.y, p.z + offset * n.z};
    const std::array<double, 3> direction{sign * n.x, sign * n.y, sign * n.z};
    reference::RaySearch search{.t_min = query.t_min,
                                .t_max = query.has_ray_limits ? rays[i].reach : query.t_max,
                                .greatest_first = query.outermost,
                                .nearest_outward_first = query.outward_first,
                                .keep = query.two_sided ? 0
                                        : query.inward  ? -1
                                                        : 1,
                                .slack = 0};
    search.slack = -slack;
    search.t_min += 1e-5;
    search.t_max -= 1e-5;
    const reference::RayHit strict =
        reference::cast_ray(scene.positions, scene.triangles, origin, direction, search);
    search.slack = slack;
    search.t_min = query.t_min - 1e-5;
    search.t_max += 2e-5;
    const reference::RayHit loose =
        reference::cast_ray(scene.positions, scene.triangles, origin, direction, search);
    const double t = sign * (static_cast<double>(ours.distance[i]) - offset);
    if (strict.found) {
      ASSERT_TRUE(ours.hit(i)) << "ray " << i << " lost a hit at " << strict.t;
    }
    if (!ours.hit(i)) continue;
    ++hits;
    ASSERT_TRUE(loose.found) << "ray " << i << " hit nothing at " << t;
    const auto rank = [&](double at) {
      return query.outermost ? -at : query.outward_first && at < 0 ? 1000 - at : at;
    };
    if (std::abs(t) > 1e-5) {
      EXPECT_GE(rank(t), rank(loose.t) - 1e-3) << "ray " << i;
      if (strict.found) {
        EXPECT_LE(rank(t), rank(strict.t) + 1e-3) << "ray " << i;
      }
    }
    // The point that the barycentrics name is the point on the ray.
    ASSERT_LT(ours.triangle[i], scene.triangles.size()) << "ray " << i;
    const Triangle& triangle = scene.triangles[ours.triangle[i]];
    const Vec3& a = scene.positions[triangle[0]];
    const Vec3& b = scene.positions[triangle[1]];
    const Vec3& c = scene.positions[triangle[2]];
    const float u = ours.u[i];
    const float v = ours.v[i];
    EXPECT_GE(u, 0.0f);
    EXPECT_GE(v, 0.0f);
    EXPECT_LE(u + v, 1.0f + 1e-6f);
    const float d = ours.distance[i];
    EXPECT_NEAR(a.x + u * (b.x - a.x) + v * (c.x - a.x), p.x + d * n.x, 2e-4f) << "ray " << i;
    EXPECT_NEAR(a.y + u * (b.y - a.y) + v * (c.y - a.y), p.y + d * n.y, 2e-4f) << "ray " << i;
    EXPECT_NEAR(a.z + u * (b.z - a.z) + v * (c.z - a.z), p.z + d * n.z, 2e-4f) << "ray " << i;
  }
  EXPECT_GT(hits, rays.size() / 50);
}

/// With those that any-hit rays do not have.
std::vector<RayCase> ray_queries() {
  std::vector<RayCase> cases = all_queries();
  cases.push_back({"outermost, limited",
                   {.t_min = -0.3f,
                    .t_max = 0.3f,
                    .two_sided = true,
                    .outermost = true,
                    .has_ray_limits = true}});
  return cases;
}

TEST(RayKernel, AgreesWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  const Scene soup = random_soup(700, 3, 0.15f);
  const Scene sphere = bumpy_sphere(16, 4, 0.02f);
  const std::vector<Ray> random = random_rays(800, 5);
  const std::vector<Ray> coherent = coherent_rays(800, 6, 0.05f);
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    for (const RayCase& entry : ray_queries()) {
      SCOPED_TRACE(entry.name);
      expect_agrees(soup, random, entry.query,
                    cast(caster_of(soup, traversal), random, entry.query));
      expect_agrees(sphere, coherent, entry.query,
                    cast(caster_of(sphere, traversal), coherent, entry.query));
    }
  }
}

TEST(RayKernel, VariantsAgreeToTheBit) {
  KILN_REQUIRE_DEVICE();
  std::vector<Scene> scenes;
  scenes.push_back(random_soup(2000, 7, 0.1f));
  scenes.push_back(bumpy_sphere(40, 8, 0.01f));
  scenes.push_back(bumpy_sphere(8, 8, 0.0f));
  for (const Scene& scene : scenes) {
    const RayCaster wide = caster_of(scene, Traversal::cpu);
    const RayCaster scalar = caster_of(scene, Traversal::gpu);
    EXPECT_NE(wide.traversal(), Traversal::gpu);
    EXPECT_EQ(scalar.traversal(), Traversal::gpu);
    for (const auto& rays :
         {random_rays(5000, 9), coherent_rays(6400, 10, 0), coherent_rays(6400, 11, 0.02f)}) {
      for (const RayCase& entry : ray_queries()) {
        SCOPED_TRACE(entry.name);
        const Cast a = cast(wide, rays, entry.query);
        const Cast b = cast(scalar, rays, entry.query);
        ASSERT_EQ(a.triangle, b.triangle);
        EXPECT_TRUE(a == b);
        RayQuery any = entry.query;
        any.any_hit = true;
        const Cast ended = cast(wide, rays, any);
        for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(ended.hit(i), a.hit(i)) << i;
        if (entry.query.has_ray_limits) continue;
        const std::vector<std::uint8_t> hit_a = occluded(wide, rays, entry.query);
        const std::vector<std::uint8_t> hit_b = occluded(scalar, rays, entry.query);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          ASSERT_EQ(hit_a[i] != 0, a.hit(i)) << i;
          ASSERT_EQ(hit_b[i] != 0, a.hit(i)) << i;
        }
      }
    }
  }
}

TEST(RayKernel, RaysThatMayEndAtAnyHitDoSo) {
  KILN_REQUIRE_DEVICE();
  const Scene soup = random_soup(2000, 7, 0.1f);
  const RayCaster caster = caster_of(soup, Traversal::cpu);
  const std::vector<Ray> rays = random_rays(5000, 9);
  const RayQuery nearest{.t_min = 0, .t_max = 2, .two_sided = true};
  RayQuery any = nearest;
  any.any_hit = true;
  EXPECT_NE(cast(caster, rays, any).triangle, cast(caster, rays, nearest).triangle)
      << "no ray ended before its nearest hit, so none was shortened";
}

/// Rays from outside at every vertex, at points of every edge, and at random points: from every side a
/// closed surface must stop each.
TEST(RayKernel, ClosedSurfacesDoNotLeak) {
  KILN_REQUIRE_DEVICE();
  for (const Scene& scene : {bumpy_sphere(24, 1, 0.0f), bumpy_sphere(24, 2, 0.01f)}) {
    std::vector<Ray> rays;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> share(0, 1);
    const auto aim = [&](Vec3 target) {
      // From inside: the origin is near the centre, so that the surface is all around it.
      const Vec3 from{0.1f * (share(random) - 0.5f), 0.1f * (share(random) - 0.5f),
                      0.1f * (share(random) - 0.5f)};
      rays.push_back({from, unit({target.x - from.x, target.y - from.y, target.z - from.z})});
      rays.push_back({{0, 0, 0}, unit(target)});
      // From far outside towards the target, which the ray may reach or meet something before.
      const Vec3 far{target.x * 5 + from.x, target.y * 5 + from.y, target.z * 5 + from.z};
      rays.push_back({far, unit({target.x - far.x, target.y - far.y, target.z - far.z})});
    };
    for (int repeat = 0; repeat < 8; ++repeat) {
      for (const Triangle& triangle : scene.triangles) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const Vec3& a = scene.positions[triangle[corner]];
          const Vec3& b = scene.positions[triangle[(corner + 1) % 3]];
          aim(a);
          const float s = share(random);
          aim({a.x + s * (b.x - a.x), a.y + s * (b.y - a.y), a.z + s * (b.z - a.z)});
          aim({0.5f * (a.x + b.x), 0.5f * (a.y + b.y), 0.5f * (a.z + b.z)});
        }
      }
    }
    const RayQuery query{.t_min = 0, .t_max = 10, .two_sided = true};
    for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
      const Cast result = cast(caster_of(scene, traversal), rays, query);
      std::size_t leaks = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) leaks += result.hit(i) ? 0u : 1u;
      EXPECT_EQ(leaks, 0u) << "of " << rays.size();
    }
  }
}

TEST(RayKernel, TiesGoToTheSmallerTriangle) {
  KILN_REQUIRE_DEVICE();
  Scene scene;
  for (int i = 0; i < 40; ++i) scene.add({-1, -1, 0.25f}, {1, -1, 0.25f}, {0, 1, 0.25f});
  std::vector<Ray> rays = random_rays(100, 3, 0.1f);
  for (Ray& ray : rays) {
    ray.origin.z = 0;
    ray.direction = {0, 0, 1};
  }
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const Cast result = cast(caster_of(scene, traversal), rays, {.t_min = 0, .t_max = 1});
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(result.triangle[i], 0u);
  }
}

/// True if a triangle in a plane z = const, of either winding, holds a point by far more than rounding; `sure` becomes
/// false where it is near its border.
bool holds(const Scene& scene, std::uint32_t triangle, double x, double y, bool& sure) {
  double least = 1e9, most = -1e9;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &p = scene.positions[scene.triangles[triangle][k]],
               &q = scene.positions[scene.triangles[triangle][(k + 1) % 3]];
    const double side = (double{q.x} - p.x) * (y - p.y) - (double{q.y} - p.y) * (x - p.x);
    least = std::min(least, side);
    most = std::max(most, side);
  }
  const bool in = least > 0 || most < 0;
  if (std::min(std::abs(least), std::abs(most)) < 1e-5) sure = false;
  return in;
}

// Coplanar triangles of all sizes, each of which the tree may meet first: of those that a ray hits at one t, the lowest
// is found, by brute force over all of them. Outward, inward and for the outermost; variants that agree with each other
// could all be wrong.
TEST(RayKernel, TiesGoToTheLowestOfAllCoplanarTriangles) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(12);
  // On a grid, so that all products of the triangle test are exact, and t is the same to the bit.
  std::uniform_int_distribution<int> step(-32, 31), grid(-4, 4), sides(1, 4);
  const auto place = [&](std::mt19937& from) {
    return static_cast<float>(2 * step(from) + 1) / 128;
  };
  Scene scene;
  for (int i = 0; i < 600; ++i) {
    const auto eighths = [](int n) { return static_cast<float>(n) / 8; };
    const float x = eighths(grid(random)), y = eighths(grid(random));
    const float w = eighths(sides(random)), h = eighths(sides(random));
    const float z = i % 2 == 0 ? 0.25F : -0.25F;  // exact, as is t: powers of two
    const Vec3 corners[] = {{x - w, y - h, z}, {x + w, y - h, z}, {x, y + h, z}};
    scene.add(corners[0], corners[i % 3 == 0 ? 1 : 2], corners[i % 3 == 0 ? 2 : 1]);
  }
  std::vector<Ray> rays(2000);
  for (Ray& ray : rays) ray = {{place(random), place(random), 0}, {0, 0, 1}, 0.05F};
  const RayCase cases[] = {
      {"outward", {.t_min = 0, .t_max = 1, .two_sided = true}},
      {"inward", {.t_min = -1, .t_max = -0.125F, .two_sided = true}},
      {"outermost", {.t_min = -1, .t_max = 1, .two_sided = true, .outermost = true}},
  };
  for (const RayCase& entry : cases) {
    const std::uint32_t parity = entry.query.t_min < 0 && !entry.query.outermost ? 1 : 0;
    std::vector<std::uint32_t> expected;
    std::size_t ties = 0;
    for (const Ray& ray : rays) {
      std::uint32_t lowest = KILN_NO_TRIANGLE, hits = 0;
      bool sure = true;
      for (std::uint32_t t = parity; t < scene.triangles.size(); t += 2) {
        if (!holds(scene, t, ray.origin.x, ray.origin.y, sure)) continue;
        lowest = std::min(lowest, t);
        ++hits;
      }
      // Behind nothing outward, the outermost is an inward one.
      expected.push_back(sure && hits != 0 ? lowest : KILN_NO_TRIANGLE);
      ties += sure && hits > 1 ? 1 : 0;
    }
    EXPECT_GT(ties, 1000U) << entry.name;
    for (const Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
      const Cast result = cast(caster_of(scene, traversal), rays, entry.query);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (expected[i] == KILN_NO_TRIANGLE) continue;
        ASSERT_EQ(result.triangle[i], expected[i]) << entry.name << ", ray " << i;
      }
    }
  }
}

TEST(RayKernel, FacingStatusAndDistance) {
  KILN_REQUIRE_DEVICE();
  const Scene scene = slab();
  struct Row {
    const char* name;
    Vec3 origin, direction;
    RayQuery query;
    std::uint32_t triangle;
    float distance;
    std::uint8_t status;
  };
  const float inf_free = 1.0f;
  const std::uint32_t none = 0xFFFFFFFFu;
  const Row rows[] = {
      {"up to the top", {0, 0, 0}, {0, 0, 1}, {.t_max = inf_free}, 0, 0.25f, KILN_STATUS_OUTWARD},
      {"down to the bottom", {0, 0, 0}, {0, 0, -1}, {.t_max = 1}, 1, 0.25f, KILN_STATUS_OUTWARD},
      {"up from below skips the bottom",
       {0, 0, -0.5f},
       {0, 0, 1},
       {.t_max = 1},
       0,
       0.75f,
       KILN_STATUS_OUTWARD},
      {"unless both sides count",
       {0, 0, -0.5f},
       {0, 0, 1},
       {.t_max = 1, .two_sided = true},
       1,
       0.25f,
       KILN_STATUS_OUTWARD},
      {"too short", {0, 0, 0}, {0, 0, 1}, {.t_max = 0.2f}, none, 0, KILN_STATUS_MISS},
      {"starts behind",
       {0, 0, 0},
       {0, 0, 1},
       {.t_min = 0.3f, .t_max = 1},
       none,
       0,
       KILN_STATUS_MISS},
      {"ends on it", {0, 0, 0}, {0, 0, 1}, {.t_max = 0.25f}, 0, 0.25f, KILN_STATUS_OUTWARD},
      {"inward part",
       {0, 0, 0.5f},
       {0, 0, 1},
       {.t_min = -0.3f, .t_max = 1, .outward_first = true},
       0,
       -0.25f,
       KILN_STATUS_INWARD},
      {"outward part wins though farther",
       {0, 0, 0.15f},
       {0, 0, 1},
       {.t_min = -0.5f, .t_max = 1, .outward_first = true, .two_sided = true},
       0,
       0.1f,
       KILN_STATUS_OUTWARD},
      {"smallest t",
       {0, 0, 0.2f},
       {0, 0, 1},
       {.t_min = -0.5f, .t_max = 1, .two_sided = true},
       1,
       -0.45f,
       KILN_STATUS_INWARD},
      {"cage",
       {0, 0, 0.2f},
       {0, 0, 1},
       {.t_max = 0.3f, .offset = 0.15f, .inward = true},
       0,
       0.05f,
       KILN_STATUS_CAGE},
      {"cage skips faces that look away",
       {0, 0, -0.3f},
       {0, 0, 1},
       {.t_max = 0.3f, .offset = 0.1f, .inward = true},
       none,
       0,
       KILN_STATUS_MISS},
      {"cage, two-sided",
       {0, 0, -0.3f},
       {0, 0, 1},
       {.t_max = 0.3f, .offset = 0.1f, .inward = true, .two_sided = true},
       1,
       0.05f,
       KILN_STATUS_CAGE},
      {"on the surface",
       {0, 0, 0.25f},
       {0, 0, 1},
       {.t_min = -0.1f, .t_max = 0.1f, .outward_first = true},
       0,
       0,
       KILN_STATUS_OUTWARD},
  };
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(scene, traversal);
    for (const Row& row : rows) {
      SCOPED_TRACE(row.name);
      const Cast result = cast(caster, {{row.origin, row.direction}}, row.query);
      EXPECT_EQ(result.triangle[0], row.triangle);
      EXPECT_NEAR(result.distance[0], row.distance, 1e-6f);
      EXPECT_EQ(result.status[0], row.status);
    }
  }
}

TEST(RayKernel, FacingAgreesWithTheNormalInEveryDirection) {
  KILN_REQUIRE_DEVICE();
  const Scene sphere = bumpy_sphere(12, 1, 0.0f);
  std::mt19937 random(5);
  std::vector<Ray> rays(3000);
  for (Ray& ray : rays) ray = {{0, 0, 0}, random_unit(random)};
  for (Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
    const RayCaster caster = caster_of(sphere, traversal);
    const Cast out = cast(caster, rays, {.t_min = 0, .t_max = 1});
    const Cast back = cast(caster, rays, {.t_min = -1, .t_max = -0.01f});
    const Cast cage = cast(caster, rays, {.t_max = 1, .offset = 1, .inward = true});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_TRUE(out.hit(i)) << i;
      EXPECT_FALSE(back.hit(i)) << i;  // that side's faces look the other way
      EXPECT_TRUE(cage.hit(i)) << i;
      EXPECT_NEAR(cage.distance[i], out.distance[i], 1e-5f) << i;
    }
  }
}

}  // namespace
}  // namespace kiln::test
