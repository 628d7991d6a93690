// The texel kernels against brute force, sample by sample.
#include "reference/texel.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <random>

#include "support/environment.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::ReferenceSample;
using test::ReferenceTriangle;

constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

/// Positions that have nothing to do with the UVs, so that interpolation is seen to use weights.
LowSurface surface_of(const std::vector<ReferenceTriangle>& triangles) {
  LowSurface surface;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(-0.5F, 0.5F);
  for (const ReferenceTriangle& triangle : triangles) {
    std::array<LowSurface::Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k].position = {unit(random), unit(random), unit(random)};
      corners[k].direction = {unit(random), unit(random), 1 + unit(random)};
      corners[k].uv = {triangle[k].u, triangle[k].v};
    }
    surface.triangles.push_back(corners);
    surface.usable.push_back(1);
  }
  return surface;
}

/// A band's samples put back in their places on the map.
struct Map {
  explicit Map(const TexelOptions& o)
      : options(o),
        columns(std::size_t{o.width} * o.samples),
        rows(std::size_t{o.height} * o.samples),
        triangle(columns * rows, kNothing),
        barycentric(columns * rows),
        point(columns * rows) {}
  TexelOptions options;
  std::size_t columns, rows;
  std::vector<std::uint32_t> triangle;
  std::vector<std::array<float, 2>> barycentric;
  std::vector<std::array<float, 7>> point;
  TexelReport report;
};

void put_band(const TexelBand& band, Map& map) {
  cl::Context& context = context_of(*test::device());
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  const std::vector<std::uint32_t> first = band.texel_first.download(context);
  const std::vector<std::uint32_t> slot = band.sample_slot.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<float> barycentric = band.barycentric.download(context);
  const std::vector<float> points = band.points.download(context);
  ASSERT_LE(band.sample_count, band.capacity);
  ASSERT_GE(first.size(), band.texel_count + std::size_t{1});
  EXPECT_EQ(first[band.texel_count], band.sample_count);
  if (band.texel_count != 0) {
    EXPECT_EQ(first[0], 0U);
  }
  const std::uint32_t n = map.options.samples;
  for (std::size_t t = 0; t < band.texel_count; ++t) {
    ASSERT_LT(first[t], first[t + 1]) << "a texel without samples";
    ASSERT_LE(first[t + 1] - first[t], n * n);
    const std::size_t row = band.first_row + index[t] / map.options.width;
    const std::size_t column = index[t] % map.options.width;
    ASSERT_LT(row, std::size_t{band.first_row} + band.row_count);
    for (std::size_t s = first[t]; s < first[t + 1]; ++s) {
      ASSERT_LT(slot[s], n * n);
      if (s > first[t]) {
        ASSERT_GT(slot[s], slot[s - 1]) << "slots in a texel must ascend";
      }
      const std::size_t place = (row * n + slot[s] / n) * map.columns + column * n + slot[s] % n;
      ASSERT_EQ(map.triangle[place], kNothing) << "a sample was written twice";
      map.triangle[place] = triangle[s];
      for (std::size_t k = 0; k < 2; ++k) {
        map.barycentric[place][k] = barycentric[k * band.capacity + s];
      }
      for (std::size_t k = 0; k < 7; ++k) map.point[place][k] = points[k * band.capacity + s];
    }
  }
}

Map sample_all(const LowSurface& surface, const TexelOptions& options) {
  TexelSampler sampler(context_of(*test::device()), surface, options);
  Map map(options);
  std::uint32_t next_row = 0;
  TexelBand band;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    band = sampler.sample(b, std::move(band));
    EXPECT_EQ(band.first_row, next_row);
    next_row += band.row_count;
    put_band(band, map);
  }
  EXPECT_EQ(next_row, options.height);
  map.report = sampler.report();
  return map;
}

std::uint64_t warned(const TexelReport& report, const std::string& code) {
  for (const Warning& warning : report.warnings) {
    if (warning.code == code) return warning.count;
  }
  return 0;
}

/// Compares everything. Weights: 31-bit fraction, and one rounding each of conversion, reciprocal,
/// product, and of 1 - u - v: 2^-31 + 4 * 2^-24. Points: that error times the sides (up to 2 units),
/// and three roundings of values below 2.
void expect_like_reference(const std::vector<ReferenceTriangle>& triangles,
                           const TexelOptions& options) {
  const LowSurface surface = surface_of(triangles);
  const Map map = sample_all(surface, options);
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

ReferenceTriangle random_triangle(std::mt19937& random, float spread) {
  std::uniform_real_distribution<float> anywhere(-0.1F, 1.1F);
  std::uniform_real_distribution<float> near(-spread, spread);
  const float u = anywhere(random);
  const float v = anywhere(random);
  const auto corner = [&] {
    return test::ReferenceUv{std::clamp(u + near(random), -1.0F, 2.0F),
                             std::clamp(v + near(random), -1.0F, 2.0F)};
  };
  return {corner(), corner(), corner()};
}

/// A grid of squares over the unit square with jittered inner points, two triangles each, some mirrored.
std::vector<ReferenceTriangle> tiling(std::uint32_t side, std::mt19937& random) {
  std::uniform_real_distribution<float> jitter(-0.24F, 0.24F);
  std::vector<test::ReferenceUv> points;
  const auto n = static_cast<float>(side);
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      const float dx = x == 0 || x == side ? 0 : jitter(random) / n;
      const float dy = y == 0 || y == side ? 0 : jitter(random) / n;
      points.push_back({static_cast<float>(x) / n + dx, static_cast<float>(y) / n + dy});
    }
  }
  std::vector<ReferenceTriangle> triangles;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::size_t a = std::size_t{y} * (side + 1) + x;
      const std::size_t corners[4] = {a, a + 1, a + side + 2, a + side + 1};
      // With jitter below a quarter of a cell both triangles keep their winding.
      triangles.push_back({points[corners[0]], points[corners[1]], points[corners[2]]});
      triangles.push_back({points[corners[0]], points[corners[2]], points[corners[3]]});
      if (random() % 2 == 0) std::swap(triangles.back()[0], triangles.back()[1]);
    }
  }
  return triangles;
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

TEST(Texel, SmallBandsGiveTheSameMap) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(5);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 60; ++i) triangles.push_back(random_triangle(random, 0.3F));
  const LowSurface surface = surface_of(triangles);
  for (std::uint32_t samples : {1U, 2U, 3U, 8U}) {
    const Map whole = sample_all(surface, {130, 97, samples, 1U << 22});
    for (std::uint32_t bound : {1U, 2000U, 20000U}) {
      const Map cut = sample_all(surface, {130, 97, samples, bound});
      EXPECT_EQ(whole.triangle, cut.triangle);
      EXPECT_EQ(whole.barycentric, cut.barycentric);
      EXPECT_EQ(whole.point, cut.point);
      EXPECT_EQ(whole.report.texels, cut.report.texels);
      EXPECT_EQ(whole.report.overlapping_samples, cut.report.overlapping_samples);
      ASSERT_EQ(whole.report.warnings.size(), cut.report.warnings.size());
      for (std::size_t i = 0; i < whole.report.warnings.size(); ++i) {
        EXPECT_EQ(whole.report.warnings[i].message, cut.report.warnings[i].message);
      }
    }
  }
}

TEST(Texel, NeighboursAreCloseInMemory) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(6);
  TexelSampler sampler(context_of(*test::device()), surface_of(tiling(4, random)),
                       {128, 128, 1, 1U << 22});
  const TexelBand band = sampler.sample(0);
  ASSERT_EQ(band.sample_count, 128U * 128U);
  const std::vector<std::uint32_t> index = band.texel_index.download(context_of(*test::device()));
  for (std::size_t run : {8U, 64U}) {
    for (std::size_t i = 0; i + run <= band.texel_count; i += run) {
      std::uint32_t low_x = 1000, high_x = 0, low_y = 1000, high_y = 0;
      for (std::size_t k = i; k < i + run; ++k) {
        low_x = std::min(low_x, index[k] % 128);
        high_x = std::max(high_x, index[k] % 128);
        low_y = std::min(low_y, index[k] / 128);
        high_y = std::max(high_y, index[k] / 128);
      }
      EXPECT_EQ(high_x - low_x, run == 8 ? 3U : 7U);
      EXPECT_EQ(high_y - low_y, run == 8 ? 1U : 7U);
    }
  }
}

TEST(Texel, NothingBeyondTheCountIsWritten) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  std::mt19937 random(8);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 20; ++i) triangles.push_back(random_triangle(random, 0.1F));
  TexelSampler sampler(context, surface_of(triangles), {61, 43, 2, 1U << 22});
  ASSERT_EQ(sampler.band_count(), 1U);
  constexpr std::uint32_t kRoom = 20000;
  constexpr std::uint32_t kCanary = 0xABCD1234U;
  constexpr float kFloatCanary = -123456.0F;
  TexelBand large;
  large.texel_index = cl::Array<std::uint32_t>(context, kRoom);
  large.texel_first = cl::Array<std::uint32_t>(context, kRoom);
  large.sample_slot = cl::Array<std::uint32_t>(context, kRoom);
  large.triangle = cl::Array<std::uint32_t>(context, kRoom);
  large.barycentric = cl::Array<float>(context, 2 * kRoom);
  large.points = cl::Array<float>(context, 7 * kRoom);
  for (auto* array :
       {&large.texel_index, &large.texel_first, &large.sample_slot, &large.triangle}) {
    context.fill(*array, kCanary);
  }
  context.fill(large.barycentric, kFloatCanary);
  context.fill(large.points, kFloatCanary);
  const TexelBand band = sampler.sample(0, std::move(large));
  ASSERT_EQ(band.capacity, kRoom);
  ASSERT_GT(band.sample_count, 100U);
  ASSERT_LT(band.sample_count, kRoom);
  const auto check = [&](const auto& values, std::size_t plane, std::size_t count, auto canary) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(values[i] == canary, i % plane >= count) << i;
    }
  };
  check(band.texel_index.download(context), kRoom, band.texel_count, kCanary);
  check(band.texel_first.download(context), kRoom, band.texel_count + 1, kCanary);
  check(band.sample_slot.download(context), kRoom, band.sample_count, kCanary);
  check(band.triangle.download(context), kRoom, band.sample_count, kCanary);
  check(band.barycentric.download(context), kRoom, band.sample_count, kFloatCanary);
  check(band.points.download(context), kRoom, band.sample_count, kFloatCanary);
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

TEST(Texel, FarAwayUvsAreClippedAndCounted) {
  KILN_REQUIRE_DEVICE();
  // A triangle far larger than the unit square, and its neighbour across the diagonal.
  const std::vector<ReferenceTriangle> triangles = {{{{-1000, -1000}, {1001, -1000}, {1001, 1001}}},
                                                    {{{-1000, -1000}, {1001, 1001}, {-1000, 1001}}},
                                                    {{{5, 5}, {6, 5}, {5, 6}}}};
  const LowSurface surface = surface_of(triangles);
  for (std::uint32_t samples : {1U, 2U}) {
    const Map map = sample_all(surface, {64, 48, samples, 1U << 22});
    EXPECT_EQ(map.report.samples, map.triangle.size()) << "a gap along a clipped edge";
    EXPECT_EQ(map.report.overlapping_samples, 0U);
    EXPECT_EQ(warned(map.report, "uv-outside"), 3U);
    for (std::size_t i = 0; i < map.triangle.size(); ++i) {
      const double u =
          (static_cast<double>(i % map.columns) + 0.5) / static_cast<double>(map.columns);
      const double v =
          1 - (static_cast<double>(i / map.columns) + 0.5) / static_cast<double>(map.rows);
      const bool lower = map.triangle[i] == 0;
      if (std::abs(u - v) > 1e-6) {
        ASSERT_EQ(lower, u > v);
      }
      // From the corners: p = corner 0 + (1/2001) of the way per unit.
      const double first = lower ? (u - v) / 2001 : (u + 1000) / 2001;
      const double second = lower ? (v + 1000) / 2001 : (v - u) / 2001;
      // Corners of pieces are snapped to 2^-28 of the map, and their weights rounded to floats.
      ASSERT_NEAR(map.barycentric[i][0], first, 1e-6);
      ASSERT_NEAR(map.barycentric[i][1], second, 1e-6);
    }
  }
}

TEST(Texel, ImperfectTrianglesAreSkippedAndCounted) {
  KILN_REQUIRE_DEVICE();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<ReferenceTriangle> triangles = {
      {{{0.1F, 0.1F}, {0.9F, 0.1F}, {0.1F, 0.9F}}},
      {{{0.5F, 0.5F}, {0.5F, 0.5F}, {0.5F, 0.5F}}},      // a point
      {{{0.1F, 0.1F}, {0.5F, 0.5F}, {0.75F, 0.75F}}},    // a line
      {{{nan, 0.1F}, {0.5F, 0.5F}, {0.7F, 0.1F}}},       //
      {{{infinity, 0.1F}, {0.5F, 0.5F}, {0.7F, 0.1F}}},  //
      {{{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}}}};     // unusable in space
  LowSurface surface = surface_of(triangles);
  surface.usable[5] = 0;
  const Map map = sample_all(surface, {64, 64, 1, 1U << 22});
  EXPECT_EQ(warned(map.report, "uv-degenerate"), 4U);
  EXPECT_EQ(warned(map.report, "low-degenerate"), 1U);
  EXPECT_EQ(warned(map.report, "uv-overlap"), 0U);
  const std::vector<ReferenceSample> expected = test::reference_samples({triangles[0]}, 64, 64, 1);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(map.triangle[i], expected[i].triangle == 0 ? 0U : kNothing);
  }
  for (const Warning& warning : map.report.warnings) {
    EXPECT_NE(warning.message.find("triangle "), std::string::npos) << warning.message;
  }
}

TEST(Texel, OverlapNamesAPairAndATexel) {
  KILN_REQUIRE_DEVICE();
  const std::vector<ReferenceTriangle> triangles = {{{{0.0F, 0.0F}, {0.2F, 0.0F}, {0.0F, 0.2F}}},
                                                    {{{0.5F, 0.5F}, {1.0F, 0.5F}, {1.0F, 1.0F}}},
                                                    {{{0.75F, 0.5F}, {1.0F, 0.5F}, {1.0F, 0.75F}}}};
  const Map map = sample_all(surface_of(triangles), {32, 32, 1, 1U << 22});
  ASSERT_EQ(map.report.warnings.size(), 1U);
  const std::string& text = map.report.warnings[0].message;
  EXPECT_NE(text.find("triangles 1 and 2"), std::string::npos) << text;
  EXPECT_EQ(map.report.warnings[0].count, map.report.overlapping_samples);
}

TEST(Texel, WithoutADirectionTheFaceNormalIsUsed) {
  KILN_REQUIRE_DEVICE();
  LowSurface surface = surface_of({{{{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}}}});
  auto& corners = surface.triangles[0];
  corners[0].position = {0, 0, 0};
  corners[1].position = {0, 0.5F, 0};
  corners[2].position = {0, 0, 0.25F};
  for (LowSurface::Corner& corner : corners) corner.direction = {0, 0, 0};
  const Map map = sample_all(surface, {33, 33, 1, 1U << 22});
  for (std::size_t i = 0; i < map.triangle.size(); ++i) {
    if (map.triangle[i] == kNothing) continue;
    ASSERT_EQ(map.point[i][3], 1.0F);
    ASSERT_EQ(map.point[i][4], 0.0F);
    ASSERT_EQ(map.point[i][5], 0.0F);
    ASSERT_EQ(map.point[i][6], 0.0F);
  }
}

TEST(Texel, BandsInAnyOrderCountOnce) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(11);
  TexelSampler sampler(context_of(*test::device()), surface_of(tiling(3, random)),
                       {64, 64, 1, 600});
  ASSERT_GT(sampler.band_count(), 4U);
  for (std::uint32_t b = sampler.band_count(); b-- > 0;) sampler.sample(b);
  sampler.sample(2);
  EXPECT_EQ(sampler.report().samples, 64U * 64U);
}

TEST(Texel, SizesAreChecked) {
  KILN_REQUIRE_DEVICE();
  const LowSurface surface = surface_of({{{{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}}}});
  for (const TexelOptions& bad : {TexelOptions{0, 4, 1, 1}, TexelOptions{4, 16385, 1, 1},
                                  TexelOptions{4, 4, 0, 1}, TexelOptions{4, 4, 17, 1}}) {
    try {
      TexelSampler sampler(context_of(*test::device()), surface, bad);
      FAIL() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
    }
  }
}

}  // namespace
}  // namespace kiln
