// Hard-surface scenes: closed dense parts with unit normals, light ones with UVs that fit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "hard_scenes.h"

namespace kiln::sample {
namespace {

using Place = std::tuple<float, float, float>;

/// Every side of a triangle has its like the other way round, by places.
bool is_closed(const Mesh& mesh) {
  std::map<std::pair<Place, Place>, int> sides;
  const auto place = [&](std::uint32_t i) {
    const Vec3& p = mesh.positions[i];
    return Place(p.x + 0.0F, p.y + 0.0F, p.z + 0.0F);
  };
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Place a = place(t[k]), b = place(t[(k + 1) % 3]);
      if (a == b) continue;
      ++sides[{a, b}];
      --sides[{b, a}];
    }
  }
  return std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second == 0; });
}

double facing(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
  const double ux = q.x - p.x, uy = q.y - p.y, uz = q.z - p.z;
  const double vx = r.x - p.x, vy = r.y - p.y, vz = r.z - p.z;
  const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const double size = std::sqrt(nx * nx + ny * ny + nz * nz);
  if (size < 1e-12) return 1;
  double least = 1;
  for (const std::uint32_t corner : mesh.normal_triangles[t]) {
    const Vec3& n = mesh.normals[corner];
    least = std::min(least, (nx * n.x + ny * n.y + nz * n.z) / size);
  }
  return least;
}

TEST(HardScene, IsClosedAndFacesOutward) {
  for (const std::string_view name : hard_scene_names()) {
    SCOPED_TRACE(name);
    const HardScene scene = hard_scene(name);
    const bool sheet = name == "leaf";
    EXPECT_EQ(is_closed(scene.high), !sheet);
    EXPECT_EQ(is_closed(scene.low), !sheet);
    for (const Mesh* mesh : {&scene.high, &scene.low}) {
      ASSERT_EQ(mesh->normal_triangles.size(), mesh->triangles.size());
      for (const Vec3& n : mesh->normals) {
        ASSERT_NEAR(double{n.x} * n.x + double{n.y} * n.y + double{n.z} * n.z, 1, 1e-5);
      }
      // A cylinder of 12 sides leans 15 degrees from its normals, a rounding less.
      for (std::size_t t = 0; t < mesh->triangles.size(); ++t)
        ASSERT_GT(facing(*mesh, t), 0.9) << t;
    }
  }
}

TEST(HardScene, HasUvsThatFit) {
  for (const std::string_view name : hard_scene_names()) {
    SCOPED_TRACE(name);
    const Mesh low = hard_scene(name).low;
    double area = 0;
    for (const Triangle& t : low.uv_triangles) {
      const Vec2 &a = low.uvs[t[0]], &b = low.uvs[t[1]], &c = low.uvs[t[2]];
      for (const Vec2& uv : {a, b, c}) {
        ASSERT_GE(std::min(uv.x, uv.y), 0.0F);
        ASSERT_LE(std::max(uv.x, uv.y), 1.0F);
      }
      const double twice =
          (double{b.x} - a.x) * (double{c.y} - a.y) - (double{c.x} - a.x) * (double{b.y} - a.y);
      EXPECT_GT(twice, 0);  // not mirrored
      area += twice / 2;
    }
    EXPECT_GT(area, 0.3);
    EXPECT_LT(area, 1.0);
  }
}

TEST(HardScene, HasTheStampsItNames) {
  EXPECT_EQ(hard_scene("cube").raised_discs.size(), 18U);
  EXPECT_EQ(hard_scene("assembly").raised_discs.size(), 10U);
  EXPECT_THROW(hard_scene("teapot"), std::invalid_argument);
}

}  // namespace
}  // namespace kiln::sample
