// Charts end at long creases between flats, and nowhere else for them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kiln/lowpoly.h"

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

/// Whether both rectangles have the same UVs where they meet.
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
  mesh.positions[0].z = 0.1F;  // The first rectangle bends along its diagonal.
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

}  // namespace
}  // namespace kiln
