// The texel kernels against brute force, sample by sample.
#include "reference/texel.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <random>

#include "support/environment.h"
#include "texel/texel_samples.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::kNothing;
using test::Map;
using test::random_triangle;
using test::ReferenceSample;
using test::ReferenceTriangle;
using test::sample_all;
using test::surface_of;
using test::tiling;
using test::warned;

/// Compares everything. Weights: 31-bit fraction, and one rounding each of conversion, reciprocal,
/// product, and of 1 - u - v: 2^-31 + 4 * 2^-24. Points: that error times the sides (up to 2 units),
/// and three roundings of values below 2.
void expect_like_reference(const std::vector<ReferenceTriangle>& triangles,
                           const TexelOptions& options) {
  const LowSurface surface = surface_of(triangles);
  TexelOptions centres = options;
  centres.small_charts = false;
  const Map map = sample_all(surface, centres);
  const std::vector<ReferenceSample> expected =
      test::reference_samples(triangles, static_cast<int>(options.width),
                              static_cast<int>(options.height), static_cast<int>(options.samples));
  ASSERT_EQ(expected.size(), map.triangle.size());
  constexpr double kWeight = 5.0 / (1 << 24);
  constexpr double kPoint = 24.0 / (1 << 24);
  std::uint64_t covered = 0;
  std::uint64_t overlapping = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::uint32_t triangle =
        expected[i].triangle < 0 ? kNothing : static_cast<std::uint32_t>(expected[i].triangle);
    ASSERT_EQ(map.triangle[i], triangle)
        << "sample row " << i / map.columns << ", column " << i % map.columns;
    covered += expected[i].covering > 0 ? 1 : 0;
    overlapping += expected[i].covering > 1 ? 1 : 0;
    if (triangle == kNothing) continue;
    const auto [u, v] = map.barycentric[i];
    ASSERT_NEAR(u, expected[i].u, kWeight);
    ASSERT_NEAR(v, expected[i].v, kWeight);
    ASSERT_GE(u, 0);
    ASSERT_GE(v, 0);
    ASSERT_GE(1.0F - u - v, 0) << u << " " << v;
    const double weights[3] = {1 - expected[i].u - expected[i].v, expected[i].u, expected[i].v};
    double position[3] = {};
    double direction[3] = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const LowSurface::Corner& corner = surface.triangles[triangle][k];
      const float p[3] = {corner.position.x, corner.position.y, corner.position.z};
      const float d[3] = {corner.direction.x, corner.direction.y, corner.direction.z};
      for (std::size_t c = 0; c < 3; ++c) {
        position[c] += weights[k] * p[c];
        direction[c] += weights[k] * d[c];
      }
    }
    const double reach = std::hypot(direction[0], direction[1], direction[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_NEAR(map.point[i][c], position[c], kPoint);
      ASSERT_NEAR(map.point[i][3 + c], direction[c] / reach, 2 * kPoint / reach);
    }
    ASSERT_NEAR(map.point[i][6], reach, 2 * kPoint);
  }
  EXPECT_EQ(map.report.samples, covered);
  EXPECT_EQ(map.report.overlapping_samples, overlapping);
  EXPECT_EQ(warned(map.report, "uv-overlap"), overlapping);
}

struct Size {
  std::uint32_t width, height, samples;
};
constexpr Size kSizes[] = {{1, 1, 1},   {1, 1, 16},  {7, 3, 1},     {7, 3, 2},
                           {7, 3, 3},   {7, 3, 4},   {64, 64, 1},   {65, 33, 1},
                           {65, 33, 2}, {65, 33, 3}, {17, 9, 4},    {9, 5, 5},
                           {9, 5, 9},   {5, 4, 16},  {1000, 10, 1}, {10, 300, 1}};

TEST(Texel, RandomTrianglesMatchBruteForce) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(1);
  for (const Size& size : kSizes) {
    for (float spread : {0.01F, 0.2F, 1.5F}) {
      SCOPED_TRACE(testing::Message() << size.width << "x" << size.height
                                      << ", N = " << size.samples << ", spread " << spread);
      std::vector<ReferenceTriangle> triangles;
      for (int i = 0; i < 40; ++i) triangles.push_back(random_triangle(random, spread));
      expect_like_reference(triangles, {size.width, size.height, size.samples, 1U << 22});
      if (HasFatalFailure()) return;
    }
  }
}

TEST(Texel, CornersOnTheGridMatchBruteForce) {
  KILN_REQUIRE_DEVICE();
  // Corners on multiples of half a sample: edges and corners go through sample centres.
  EXPECT_TRUE(rc::check([] {
    const auto samples = *rc::gen::inRange<std::uint32_t>(1, 5);
    std::vector<ReferenceTriangle> triangles(*rc::gen::inRange<std::size_t>(1, 12));
    for (ReferenceTriangle& triangle : triangles) {
      for (test::ReferenceUv& uv : triangle) {
        uv = {static_cast<float>(*rc::gen::inRange(-4, 68)) / 64.0F,
              static_cast<float>(*rc::gen::inRange(-4, 68)) / 64.0F};
      }
    }
    expect_like_reference(triangles, {32, 32, samples, 1U << 22});
    RC_ASSERT(!testing::Test::HasFatalFailure());
  }));
}

TEST(Texel, ATiledSquareIsCoveredExactlyOnce) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(3);
  for (const Size& size : kSizes) {
    for (std::uint32_t side : {1U, 5U, 40U}) {
      const LowSurface surface = surface_of(tiling(side, random));
      const Map map = sample_all(surface, {size.width, size.height, size.samples, 1U << 22});
      EXPECT_EQ(map.report.samples, map.triangle.size()) << size.width << " " << side;
      EXPECT_EQ(map.report.texels, std::uint64_t{size.width} * size.height);
      EXPECT_EQ(map.report.overlapping_samples, 0U);
      EXPECT_EQ(warned(map.report, "uv-outside"), 0U);
    }
  }
}

TEST(Texel, TilingMatchesBruteForce) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(4);
  expect_like_reference(tiling(9, random), {64, 64, 1, 1U << 22});
  expect_like_reference(tiling(40, random), {31, 77, 2, 1U << 22});
}

TEST(Texel, WideAndTallMaps) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(9);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 10; ++i) triangles.push_back(random_triangle(random, 1.0F));
  expect_like_reference(triangles, {16384, 1, 1, 1U << 22});
  expect_like_reference(triangles, {1, 16384, 1, 1U << 12});
  expect_like_reference(triangles, {16384, 1, 4, 1U << 22});
  expect_like_reference(triangles, {2, 1, 16, 1U << 22});
}

TEST(Texel, ManyTrianglesInOneBlock) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(10);
  expect_like_reference(tiling(60, random), {9, 9, 3, 1U << 22});
}

}  // namespace
}  // namespace kiln
