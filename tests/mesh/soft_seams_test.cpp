// UV seams and hard edges.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "kiln/normals.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A prism of `sides` quads around +Z, each a chart of its own, with the smooth normals of a cylinder.
Mesh prism(int sides, bool hard) {
  Mesh mesh;
  mesh.name = "prism";
  for (int i = 0; i < sides; ++i) {
    const auto at = [&](int k) { return 2 * std::numbers::pi * k / sides; };
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k < 4; ++k) {
      const double angle = at(k == 1 || k == 2 ? i + 1 : i % sides);
      // The last side's end is the first one's begin, to the bit.
      const double place = at((k == 1 || k == 2 ? i + 1 : i) % sides);
      mesh.positions.push_back({static_cast<float>(std::cos(place)),
                                static_cast<float>(std::sin(place)), k < 2 ? 0.0F : 1.0F});
      const double normal = hard ? at(i) + std::numbers::pi / sides : angle;
      mesh.normals.push_back(
          {static_cast<float>(std::cos(normal)), static_cast<float>(std::sin(normal)), 0});
      mesh.uvs.push_back(
          {(static_cast<float>(i) + (k == 1 || k == 2 ? 0.8F : 0.1F)) / static_cast<float>(sides),
           k < 2 ? 0.1F : 0.9F});
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  mesh.uv_triangles = mesh.normal_triangles = mesh.triangles;
  return mesh;
}

TEST(SoftSeams, AreSeamsWhoseNormalsDoNotPart) {
  const SoftSeams soft = soft_seams(prism(6, false));
  EXPECT_EQ(soft.edges, 6U);
  EXPECT_EQ(soft.seams, 6U);
  EXPECT_EQ(soft.between_flats, 6U);
  EXPECT_NEAR(soft.length, 6, 1e-6);
  EXPECT_NEAR(soft.example_degrees, 60, 1e-4);
  EXPECT_NEAR(soft.example.z, 0.5, 1e-6);
  EXPECT_NEAR(std::hypot(soft.example.x, soft.example.y), 1, 1e-6);
  EXPECT_EQ(soft_seams(prism(6, true)).edges, 0U);
  EXPECT_EQ(soft_seams(prism(6, true)).seams, 6U);
  EXPECT_EQ(soft_seams(prism(24, false)).edges, 0U);  // 15 degrees
  EXPECT_EQ(soft_seams(prism(24, false), 10).edges, 24U);
  EXPECT_THROW(soft_seams(prism(6, false), -1), Error);
  Mesh bare = prism(6, false);
  bare.uvs.clear();
  bare.uv_triangles.clear();
  EXPECT_EQ(soft_seams(bare).seams, 0U);
  EXPECT_THROW(split_at_seams(bare), Error);
}

/// An edge whose UVs part at one of its ends alone is a seam, whichever end it is.
TEST(SoftSeams, MayPartUvsAtOneEndAlone) {
  for (const std::uint32_t moved : {0U, 1U}) {
    Mesh roof;
    roof.positions = {{0, 0, 0}, {0, 2, 0}, {-1, 1, -1}, {1, 1, -1}};
    roof.triangles = {{0, 1, 2}, {1, 0, 3}};
    roof.uvs = {{0.4F, 0.1F}, {0.4F, 0.9F}, {0.1F, 0.5F}, {0.9F, 0.5F}, {0.6F, 0.5F}};
    roof.uv_triangles = roof.triangles;
    EXPECT_EQ(soft_seams(roof).seams, 0U);
    roof.uv_triangles[1][moved] = 4;
    const SoftSeams soft = soft_seams(roof);
    EXPECT_EQ(soft.seams, 1U) << moved;
    EXPECT_EQ(soft.edges, 1U) << moved;
    EXPECT_NEAR(soft.length, 2, 1e-6) << moved;
    EXPECT_NEAR(soft.example_degrees, 90, 1e-4) << moved;
  }
}

TEST(SoftSeams, LieBetweenFlatsOrOnCurvedSurfaces) {
  Mesh bent = prism(6, false);
  const std::size_t right = 4 * 3 + 2,
                    left = 4 * 4 + 3;  // the corner that sides 3 and 4 share: both get a fold
  ASSERT_EQ(bent.positions[right].x, bent.positions[left].x);
  for (const std::size_t corner : {right, left}) {
    bent.positions[corner] = {bent.positions[corner].x * 1.3F, bent.positions[corner].y * 1.3F, 1};
  }
  const SoftSeams soft = soft_seams(bent);
  EXPECT_EQ(soft.edges, 6U);
  EXPECT_EQ(soft.between_flats, 3U);  // around sides 0 and 1
  EXPECT_NEAR(soft.example_degrees, 60, 1e-4);
  EXPECT_GT(soft.example.x, 0);
}

TEST(SoftSeams, AreSplitIntoTheFacesOwnNormals) {
  for (const bool given : {true, false}) {
    Mesh mesh = prism(6, false);
    mesh.tangents.assign(3 * mesh.triangles.size(), Tangent{{0, 0, 1}, 1});
    if (!given) {
      mesh.normals.clear();
      mesh.normal_triangles.clear();
    }
    const Mesh split = split_at_seams(mesh), wanted = prism(6, true);
    EXPECT_TRUE(split.tangents.empty());
    for (std::size_t t = 0; t < split.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& n = split.normals[split.normal_triangles[t][k]];
        const Vec3& m = wanted.normals[wanted.normal_triangles[t][k]];
        EXPECT_NEAR(n.x, m.x, 1e-6);
        EXPECT_NEAR(n.y, m.y, 1e-6);
        EXPECT_NEAR(n.z, 0, 1e-6);
      }
    }
    EXPECT_EQ(soft_seams(split).edges, 0U);
    EXPECT_EQ(split.positions, mesh.positions);
  }
}

/// If nothing is soft, not one normal changes; and inside charts none does.
TEST(SoftSeams, LeaveAllElseAsItIs) {
  const Mesh cube = prism(4, true);
  const Mesh same = split_at_seams(cube);
  EXPECT_EQ(same.normals, cube.normals);
  EXPECT_EQ(same.normal_triangles, cube.normal_triangles);
  // A sphere with a seam along one line and around each pole: normals away from it stay to the bit.
  const Mesh sphere = test::BumpySphere::light(24, 12);
  const Mesh split = split_at_seams(sphere);
  std::size_t changed = 0, kept = 0;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++(split.normals[split.normal_triangles[t][k]] ==
                 sphere.normals[sphere.normal_triangles[t][k]]
             ? kept
             : changed);
    }
  }
  EXPECT_GT(changed, 0U);
  EXPECT_GT(kept, 3 * changed);
}

}  // namespace
}  // namespace kiln
