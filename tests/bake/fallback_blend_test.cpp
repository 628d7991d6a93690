// Blending normals where a match gives way to its fallback.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kWidth = 200;
constexpr std::uint32_t kHeight = 40;
constexpr std::uint32_t kReach = 6;

/// A sheet over the left half, and beside it a wall that rays run along but nearest points find.
Mesh sheet_and_wall() {
  Mesh mesh;
  mesh.name = "sheet and wall";
  mesh.positions = {{-1, -1, 0.045F},   {0, -1, 0.045F},      {0, 1, 0.045F},
                    {-1, 1, 0.045F},    {0.0095F, -1, -0.2F}, {0.0105F, -1, 0.2F},
                    {0.0105F, 1, 0.2F}, {0.0095F, 1, -0.2F}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  return mesh;
}

/// The left half of the map reaches from -0.5 to 0, the right one to 0.05.
Mesh ground() {
  Mesh mesh = test::plane(2, 2);
  for (Vec3& p : mesh.positions) p.x *= p.x > 0 ? 0.1F : 1.0F;
  return mesh;
}

BakeOptions blend_options(std::uint32_t width, std::uint32_t samples, std::uint32_t reach) {
  BakeOptions options;
  options.width = width;
  options.height = kHeight;
  options.samples = samples;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.raw = true;
  options.encoding.gutter = 0;
  options.match.max_distance = Length::absolute(0.05);
  options.match.fallback = {MatchMethod::closest};
  options.match.fallback_blend = reach;
  return options;
}

TEST(FallbackBlend, LeavesNoStep) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), sheet_and_wall());
  const Mesh low = ground();
  const BakeResult plain = bake(source, low, blend_options(kWidth, 1, 0));
  const BakeResult blended = bake(source, low, blend_options(kWidth, 1, kReach));
  EXPECT_FALSE(plain.report.transitions_blended);
  EXPECT_EQ(plain.report.missed, 0U);
  ASSERT_TRUE(blended.report.transitions && blended.report.transitions_blended);
  EXPECT_EQ(blended.report.transitions->mean_degrees, plain.report.transitions->mean_degrees);
  EXPECT_EQ(blended.report.transitions->sides, blended.report.transitions_blended->sides);
  EXPECT_GT(blended.report.transitions->mean_degrees, 25);
  EXPECT_LT(blended.report.transitions_blended->mean_degrees,
            blended.report.transitions->mean_degrees / 50);
  EXPECT_EQ(blended.report.blended_texels % kHeight, 0U);
  EXPECT_GE(blended.report.blended_texels, kReach * kHeight);
  EXPECT_LE(blended.report.blended_texels, (kReach + 2) * kHeight);

  const Image& before = plain.maps[0].image;
  const Image& after = blended.maps[0].image;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      const float* a = &before.pixels[3 * (std::size_t{y} * kWidth + x)];
      const float* b = &after.pixels[3 * (std::size_t{y} * kWidth + x)];
      const bool inside = x < kWidth / 2 && x + kReach >= kWidth / 2;
      if (!inside) {
        // Also the column where rays hit the wall, since both matches find the same there.
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-6F) << x << ' ' << y;
        if (x < kWidth / 2) {
          EXPECT_TRUE(std::equal(a, a + 3, b)) << x << ' ' << y;
        }
        continue;
      }
      // Centres lie half a texel and more from the border; the normals are about +Z and -X.
      const double way = (kWidth / 2.0 - x - 0.5) / kReach;
      const double share = way * way * (3 - 2 * way);
      EXPECT_NEAR(std::atan2(-b[0], b[2]), std::atan2(1 - share, share), 0.01) << x << ' ' << y;
    }
  }
}

TEST(FallbackBlend, TexelsOfBothAreTheFallbacks) {
  KILN_REQUIRE_DEVICE();
  // The border runs through the middle of a column.
  constexpr std::uint32_t kOdd = kWidth - 1;
  const Source source(*test::device(), sheet_and_wall());
  const BakeResult plain = bake(source, ground(), blend_options(kOdd, 2, 0));
  const BakeResult blended = bake(source, ground(), blend_options(kOdd, 2, kReach));
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    const std::size_t row = std::size_t{y} * kOdd;
    const float* mixed = &plain.maps[0].image.pixels[3 * (row + kOdd / 2)];
    const float* taken = &blended.maps[0].image.pixels[3 * (row + kOdd / 2)];
    EXPECT_NEAR(std::atan2(-mixed[0], mixed[2]), std::numbers::pi / 4, 0.01);
    EXPECT_NEAR(std::atan2(-taken[0], taken[2]), std::numbers::pi / 2, 0.01);
    for (std::uint32_t x = 0; x < kOdd / 2 - kReach; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(plain.maps[0].image.pixels[3 * (row + x) + c],
                  blended.maps[0].image.pixels[3 * (row + x) + c]);
      }
    }
  }
}

/// Samples that no match finds are no border: beside them nothing is blended, on whichever side of the others they lie.
TEST(FallbackBlend, WhatNoMatchFindsIsNoBorder) {
  KILN_REQUIRE_DEVICE();
  for (const float side : {-1.0F, 1.0F}) {
    Mesh sheet = sheet_and_wall();
    sheet.triangles.resize(2);  // without the wall
    for (Vec3& p : sheet.positions) p = {side * p.x, side * p.y, p.z};
    const Source source(*test::device(), sheet);
    BakeOptions options = blend_options(kWidth, 1, kReach);
    // Points within 0.001 of the sheet's end are found by distance: less than half a texel.
    options.match.max_distance = Length::absolute(0.04501);
    const BakeResult blended = bake(source, test::plane(2, 2), options);
    options.match.fallback_blend = 0;
    const BakeResult plain = bake(source, test::plane(2, 2), options);
    EXPECT_EQ(2 * plain.report.missed, plain.report.samples);
    EXPECT_EQ(blended.report.missed, plain.report.missed);
    EXPECT_EQ(blended.report.blended_texels, 0U);
    // Sides to what is missed are counted, a column of them.
    ASSERT_TRUE(plain.report.transitions);
    EXPECT_EQ(plain.report.transitions->sides, kHeight);
    EXPECT_EQ(blended.maps[0].image.pixels, plain.maps[0].image.pixels);
  }
}

/// The ground in two charts of half the map each, cut along x = 0, and so where the border is.
Mesh cut_ground() {
  Mesh mesh = ground();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bool right = true;
    for (const std::uint32_t v : mesh.triangles[t]) right = right && mesh.positions[v].x >= 0;
    for (std::uint32_t& uv : mesh.uv_triangles[t]) {
      Vec2 place = mesh.uvs[uv];
      place.x = right ? place.x : place.x * 0.9F;
      uv = static_cast<std::uint32_t>(mesh.uvs.size());
      mesh.uvs.push_back(place);
    }
  }
  return mesh;
}

TEST(FallbackBlend, GoesOverSeams) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), sheet_and_wall());
  const BakeResult blended = bake(source, cut_ground(), blend_options(kWidth, 1, kReach));
  // The last column of the left chart is next to the right chart's first one.
  constexpr std::uint32_t kLast = kWidth * 45 / 100 - 1;
  for (std::uint32_t y = 2; y < kHeight - 2; ++y) {
    const float* last = &blended.maps[0].image.pixels[3 * (std::size_t{y} * kWidth + kLast)];
    EXPECT_GT(std::atan2(-last[0], last[2]), 1.5) << y;
  }
}

TEST(FallbackBlend, NeedsAFallback) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), sheet_and_wall());
  BakeOptions options = blend_options(kWidth, 1, 257);
  EXPECT_THROW(bake(source, ground(), options), Error);
  options.match.fallback_blend = 4;
  options.match.fallback.clear();
  EXPECT_THROW(bake(source, ground(), options), Error);
}

}  // namespace
}  // namespace kiln
