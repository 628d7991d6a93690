// Generates meshes and rays for tests of ray kernels, and casts the rays.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "accel/ray.h"
#include "kiln/render.h"
#include "support/environment.h"

namespace kiln::test {

struct Scene {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  void add(Vec3 a, Vec3 b, Vec3 c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

struct Ray {
  Vec3 origin;
  Vec3 direction;
  float reach = 0;
};

inline Vec3 unit(Vec3 v) {
  const float length = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  return {v.x / length, v.y / length, v.z / length};
}

inline Vec3 random_unit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return unit({normal(random), normal(random), normal(random)});
}

/// Makes random triangles of about `size` in the unit cube around the origin.
inline Scene random_soup(std::size_t count, unsigned seed, float size) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.4f, 0.4f);
  std::uniform_real_distribution<float> step(-size, size);
  Scene scene;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    scene.add(a, {a.x + step(random), a.y + step(random), a.z + step(random)},
              {a.x + step(random), a.y + step(random), a.z + step(random)});
  }
  return scene;
}

/// Makes a closed sphere of radius about 0.4 with `rows` x 2 `rows` quads. Its vertices are displaced by up to `bumps`,
/// and faces wind outward.
inline Scene bumpy_sphere(int rows, unsigned seed, float bumps) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> bump(-bumps, bumps);
  Scene scene;
  const int columns = 2 * rows;
  const float pi = 3.14159265f;
  scene.positions.push_back({0, 0, 0.4f});
  for (int row = 1; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float theta = pi * static_cast<float>(row) / static_cast<float>(rows);
      const float phi = 2 * pi * static_cast<float>(column) / static_cast<float>(columns);
      const float r = 0.4f + bump(random);
      scene.positions.push_back({r * std::sin(theta) * std::cos(phi),
                                 r * std::sin(theta) * std::sin(phi), r * std::cos(theta)});
    }
  }
  scene.positions.push_back({0, 0, -0.4f});
  const auto at = [&](int row, int column) {
    return static_cast<std::uint32_t>(1 + (row - 1) * columns + column % columns);
  };
  const auto last = static_cast<std::uint32_t>(scene.positions.size() - 1);
  for (int column = 0; column < columns; ++column) {
    scene.triangles.push_back({0, at(1, column), at(1, column + 1)});
    for (int row = 1; row + 1 < rows; ++row) {
      scene.triangles.push_back({at(row, column), at(row + 1, column), at(row + 1, column + 1)});
      scene.triangles.push_back({at(row, column), at(row + 1, column + 1), at(row, column + 1)});
    }
    scene.triangles.push_back({at(rows - 1, column), last, at(rows - 1, column + 1)});
  }
  return scene;
}

/// Makes rays in all directions from a cube of half size `spread`.
inline std::vector<Ray> random_rays(std::size_t count, unsigned seed, float spread = 0.5f) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-spread, spread);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    ray = {{place(random), place(random), place(random)}, random_unit(random), 0.05f};
  }
  return rays;
}

/// Makes neighbouring rays in rows of 8, as the sampler orders them: along the normals of a sphere, with some noise.
inline std::vector<Ray> coherent_rays(std::size_t count, unsigned seed, float noise) {
  const float pi = 3.14159265f;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> jitter(-noise, noise);
  std::vector<Ray> rays(count);
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count) / 64)));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t block = i / 64;
    const std::size_t x = block % side * 8 + i % 8;
    const std::size_t y = block / side * 8 + i % 64 / 8;
    const float phi = 2 * pi * static_cast<float>(x) / static_cast<float>(8 * side);
    const float theta = pi * (static_cast<float>(y) + 0.5f) / static_cast<float>(8 * side);
    const Vec3 n =
        unit({std::sin(theta) * std::cos(phi) + jitter(random),
              std::sin(theta) * std::sin(phi) + jitter(random), std::cos(theta) + jitter(random)});
    rays[i] = {{0.4f * n.x, 0.4f * n.y, 0.4f * n.z}, n, 0.05f};
  }
  return rays;
}

/// Makes a face at z = 0.25 that points up, and one at z = -0.25 that points down, like the two sides of a solid.
inline Scene slab() {
  Scene scene;
  scene.add({-1, -1, 0.25f}, {1, -1, 0.25f}, {0, 1, 0.25f});
  scene.add({-1, -1, -0.25f}, {0, 1, -0.25f}, {1, -1, -0.25f});
  return scene;
}

struct RayCase {
  const char* name;
  RayQuery query;
};

inline std::vector<RayCase> all_queries() {
  return {
      {"outward", {.t_min = 0, .t_max = 0.4f}},
      {"outward two-sided", {.t_min = 0, .t_max = 0.4f, .two_sided = true}},
      {"both ways, smallest t", {.t_min = -0.3f, .t_max = 0.4f}},
      {"outward first", {.t_min = -0.3f, .t_max = 0.2f, .outward_first = true}},
      {"outward first, two-sided",
       {.t_min = -0.3f, .t_max = 0.3f, .outward_first = true, .two_sided = true}},
      {"outermost", {.t_min = -0.3f, .t_max = 0.2f, .outermost = true}},
      {"outermost, two-sided",
       {.t_min = -0.3f, .t_max = 0.3f, .two_sided = true, .outermost = true}},
      {"cage", {.t_min = 0, .t_max = 0.1f, .offset = 0.05f, .inward = true}},
      {"cage mesh", {.t_min = 0, .t_max = 0.1f, .use_reach = true, .inward = true}},
      {"far", {.t_min = 0, .t_max = 4.0f, .two_sided = true}},
  };
}

inline RayCaster caster_of(const Scene& scene, Traversal traversal = Traversal::cpu) {
  return RayCaster(context_of(*device()), scene.positions, scene.triangles, traversal);
}

/// The hits of a cast in host memory.
struct Cast {
  std::vector<std::uint32_t> triangle;
  std::vector<float> u, v, distance;
  std::vector<std::uint8_t> status;
  bool hit(std::size_t i) const { return triangle[i] != 0xFFFFFFFFu; }
  friend bool operator==(const Cast&, const Cast&) = default;
};

/// Converts rays to planes as in TexelBand, with `padding` further elements per plane that are not samples.
inline std::vector<float> planes_of(const std::vector<Ray>& rays, std::size_t capacity) {
  std::vector<float> planes(7 * capacity, 7.0f);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const std::array<float, 7> values{ray.origin.x,    ray.origin.y,    ray.origin.z,
                                      ray.direction.x, ray.direction.y, ray.direction.z,
                                      ray.reach};
    for (std::size_t plane = 0; plane < 7; ++plane) planes[plane * capacity + i] = values[plane];
  }
  return planes;
}

/// Runs match(points, count, capacity, result) on the rays, and checks canaries around the results.
template <typename Run>
Cast match_of(const std::vector<Ray>& rays, const Run& match) {
  cl::Context& context = context_of(*device());
  const auto count = static_cast<std::uint32_t>(rays.size());
  const std::uint32_t capacity = count + 5;
  const std::vector<float> planes = planes_of(rays, capacity);
  const cl::Array<float> points(context, std::span<const float>(planes));
  DeviceCorrespondence result(context, capacity + 3);
  // Elements beyond the samples are canaries, which must stay unchanged.
  context.fill(result.triangle, std::uint32_t{0xABABABABu});
  context.fill(result.barycentric, -77.0f);
  context.fill(result.distance, -77.0f);
  context.fill(result.status, std::uint8_t{0xAB});
  match(points, count, capacity, result);
  Cast out;
  out.triangle = result.triangle.download(context);
  const std::vector<float> barycentric = result.barycentric.download(context);
  out.distance = result.distance.download(context);
  out.status = result.status.download(context);
  out.u.assign(barycentric.begin(), barycentric.begin() + result.capacity);
  out.v.assign(barycentric.begin() + result.capacity, barycentric.end());
  for (std::size_t i = count; i < result.capacity; ++i) {
    EXPECT_EQ(out.triangle[i], 0xABABABABu) << i;
    EXPECT_EQ(out.u[i], -77.0f) << i;
    EXPECT_EQ(out.v[i], -77.0f) << i;
    EXPECT_EQ(out.distance[i], -77.0f) << i;
    EXPECT_EQ(out.status[i], 0xAB) << i;
  }
  out.triangle.resize(count);
  out.u.resize(count);
  out.v.resize(count);
  out.distance.resize(count);
  out.status.resize(count);
  return out;
}

/// Casts rays as those of dense texels, and expects the same bits as for sparse texels, which CPUs trace otherwise.
inline Cast cast(const RayCaster& caster, const std::vector<Ray>& rays, const RayQuery& query) {
  std::vector<Cast> casts;
  for (const double triangles_per_ray : {0.0, 2.0}) {
    RayQuery dense = query;
    dense.triangles_per_ray = triangles_per_ray;
    casts.push_back(match_of(rays, [&](const cl::Array<float>& points, std::uint32_t count,
                                       std::uint32_t capacity, DeviceCorrespondence& result) {
      caster.intersect(points, count, capacity, dense, result);
    }));
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(casts[0].hit(i), casts[1].hit(i)) << "triangles_per_ray changes ray " << i;
  }
  EXPECT_TRUE(query.any_hit || casts[0] == casts[1]) << "triangles_per_ray changes results";
  return casts[0];
}

inline std::vector<std::uint8_t> occluded(const RayCaster& caster, const std::vector<Ray>& rays,
                                          const RayQuery& query) {
  cl::Context& context = context_of(*device());
  const auto count = static_cast<std::uint32_t>(rays.size());
  const std::vector<float> planes = planes_of(rays, count);
  const cl::Array<float> points(context, std::span<const float>(planes));
  cl::Array<std::uint8_t> hit(context, count + 4);
  context.fill(hit, std::uint8_t{0xAB});
  caster.occluded(points, count, count, query, hit);
  std::vector<std::uint8_t> out = hit.download(context);
  for (std::size_t i = count; i < out.size(); ++i) EXPECT_EQ(out[i], 0xAB) << i;
  out.resize(count);
  return out;
}

}  // namespace kiln::test
