// Charts end at long creases between flats and at long chains of creases, and nowhere else for them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kiln/unwrap.h"

namespace kiln {
namespace {

/// Two rectangles that meet at a side of length 4, turned by an angle, and a sheet of 200 small triangles apart.
Mesh folded(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const auto x = static_cast<float>(std::cos(angle)), z = static_cast<float>(std::sin(angle));
  Mesh mesh;
  mesh.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 4, 0}, {-1, 4, 0}, {x, 0, z}, {x, 4, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int j = 0; j <= 10; ++j) {
    for (int i = 0; i <= 10; ++i) {
      mesh.positions.push_back(
          {10 + 0.1F * static_cast<float>(i), 0.1F * static_cast<float>(j), 0});
    }
  }
  for (std::uint32_t j = 0; j < 10; ++j) {
    for (std::uint32_t i = 0; i < 10; ++i) {
      const std::uint32_t a = first + 11 * j + i;
      mesh.triangles.push_back({a, a + 1, a + 12});
      mesh.triangles.push_back({a, a + 12, a + 11});
    }
  }
  return mesh;
}

/// True if both rectangles have the same UVs where they meet.
bool is_whole(const Mesh& mesh) {
  const Mesh laid = unwrap(mesh, {.method = UnwrapMethod::charts, .size = 256, .border_texels = 2});
  return laid.uv_triangles[0][1] == laid.uv_triangles[3][0] &&
         laid.uv_triangles[0][2] == laid.uv_triangles[3][2];
}

TEST(ChartCreases, FlatsArePartedWhereTheyTurnSharply) {
  EXPECT_FALSE(is_whole(folded(90)));
  EXPECT_FALSE(is_whole(folded(-75)));
  EXPECT_TRUE(is_whole(folded(45)));
}

TEST(ChartCreases, WhatBendsBesideIsNoCrease) {
  Mesh mesh = folded(90);
  mesh.positions[0].z = 0.5F;  // The first rectangle bends along its diagonal, by 27 degrees.
  EXPECT_TRUE(is_whole(mesh));
}

TEST(ChartCreases, ShortOnesStay) {
  Mesh mesh = folded(90);
  for (std::size_t v = 6; v < mesh.positions.size(); ++v) {  // All triangles are of like size now.
    mesh.positions[v].x = 10 + 20 * (mesh.positions[v].x - 10);
    mesh.positions[v].y *= 20;
  }
  EXPECT_TRUE(is_whole(mesh));
}

/// A can: a side of `slices` quads, cut into `rings`, and two caps with a vertex in the middle.
Mesh can(std::uint32_t slices, std::uint32_t rings, float height) {
  Mesh mesh;
  for (std::uint32_t j = 0; j <= rings; ++j) {
    for (std::uint32_t i = 0; i < slices; ++i) {
      const double angle = 2 * std::numbers::pi * i / slices;
      mesh.positions.push_back({static_cast<float>(std::cos(angle)),
                                static_cast<float>(std::sin(angle)),
                                height * static_cast<float>(j) / static_cast<float>(rings)});
    }
  }
  for (std::uint32_t j = 0; j < rings; ++j) {
    for (std::uint32_t i = 0; i < slices; ++i) {
      const std::uint32_t a = j * slices + i, b = j * slices + (i + 1) % slices;
      mesh.triangles.push_back({a, b, b + slices});
      mesh.triangles.push_back({a, b + slices, a + slices});
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back({0, 0, 0});
  mesh.positions.push_back({0, 0, height});
  const std::uint32_t last = rings * slices;
  for (std::uint32_t i = 0; i < slices; ++i) {
    const std::uint32_t k = (i + 1) % slices;
    mesh.triangles.push_back({bottom, k, i});
    mesh.triangles.push_back({bottom + 1, last + i, last + k});
  }
  return mesh;
}

/// Number of edges between the side and its caps that are no seams.
int whole_rims(const Mesh& mesh, std::uint32_t slices, std::uint32_t rings) {
  const Mesh laid = unwrap(mesh, {.method = UnwrapMethod::charts, .size = 256, .border_texels = 2});
  const std::uint32_t caps = 2 * slices * rings;
  int whole = 0;
  for (std::uint32_t i = 0; i < slices; ++i) {
    const Triangle &below = laid.uv_triangles[2 * i], &cap = laid.uv_triangles[caps + 2 * i];
    whole += below[0] == cap[2] && below[1] == cap[1] ? 1 : 0;
    const Triangle& above = laid.uv_triangles[2 * (slices * (rings - 1) + i) + 1];
    const Triangle& lid = laid.uv_triangles[caps + 2 * i + 1];
    whole += above[2] == lid[1] && above[1] == lid[2] ? 1 : 0;
  }
  return whole;
}

TEST(ChartCreases, RimsOfCapsAreSeamsAllRound) {
  EXPECT_EQ(whole_rims(can(32, 4, 2), 32, 4), 0);
  EXPECT_EQ(whole_rims(can(100, 2, 0.5F), 100, 2), 0);
}

TEST(ChartCreases, RimsThatTurnLittleAreNone) {
  Mesh cone = can(32, 4, 2);
  for (Vec3& p : cone.positions) {  // Caps become cones that go on at 45 degrees.
    if (p.x == 0 && p.y == 0) p.z += p.z > 1 ? 1.0F : -1.0F;
  }
  EXPECT_GT(whole_rims(cone, 32, 4), 0);
}

}  // namespace
}  // namespace kiln
