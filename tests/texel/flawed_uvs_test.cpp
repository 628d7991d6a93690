// Texels of UVs with flaws: far away, without area, overlapping; sizes out of range.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "reference/texel.h"
#include "support/environment.h"
#include "texel/texel_samples.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::kNothing;
using test::Map;
using test::ReferenceSample;
using test::ReferenceTriangle;
using test::sample_all;
using test::surface_of;
using test::warned;

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

/// Flaws are counted by several tasks: the example is the first of all.
TEST(Texel, TheFirstFlawOfManyTrianglesIsTheExample) {
  KILN_REQUIRE_DEVICE();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<ReferenceTriangle> triangles(50000, {{{0.1F, 0.1F}, {0.11F, 0.1F}, {0.1F, 0.11F}}});
  for (const std::size_t t : {1007U, 20007U, 40007U}) {
    triangles[t] = {{{0.5F, 0.5F}, {0.5F, 0.5F}, {0.5F, 0.5F}}};
    triangles[t + 1] = {{{nan, 0.1F}, {0.5F, 0.5F}, {0.7F, 0.1F}}};
  }
  LowSurface surface = surface_of(triangles);
  for (const std::size_t t : {18009U, 20009U, 40009U}) surface.usable[t] = 0;
  const Map map = sample_all(surface, {16, 16, 1, 1U << 22});
  for (const auto& [code, example] : {std::pair<std::string, std::string>{"uv-degenerate", "1007"},
                                      {"uv-missing", "1008"},
                                      {"low-degenerate", "18009"}}) {
    EXPECT_EQ(warned(map.report, code), 3U);
    bool found = false;
    for (const Warning& warning : map.report.warnings) {
      const std::string text = warning.message.text();
      found = found || (warning.code == code &&
                        text.find("example triangle " + example) != std::string::npos);
    }
    EXPECT_TRUE(found) << code;
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
  EXPECT_EQ(warned(map.report, "uv-degenerate"), 2U);
  EXPECT_EQ(warned(map.report, "uv-missing"), 2U);
  EXPECT_EQ(warned(map.report, "low-degenerate"), 1U);
  EXPECT_EQ(warned(map.report, "uv-overlap"), 0U);
  const std::vector<ReferenceSample> expected = test::reference_samples({triangles[0]}, 64, 64, 1);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(map.triangle[i], expected[i].triangle == 0 ? 0U : kNothing);
  }
  // The first of each kind is the example.
  const std::pair<std::string, std::string> examples[] = {
      {"uv-degenerate", "example triangle 1 with"},
      {"uv-missing", "example triangle 3:"},
      {"low-degenerate", "example triangle 5:"}};
  for (const auto& [code, example] : examples) {
    for (const Warning& warning : map.report.warnings) {
      if (warning.code != code) continue;
      EXPECT_NE(warning.message.text().find(example), std::string::npos) << warning.message.text();
    }
  }
}

TEST(Texel, OverlapNamesAPairAndATexel) {
  KILN_REQUIRE_DEVICE();
  const std::vector<ReferenceTriangle> triangles = {{{{0.0F, 0.0F}, {0.2F, 0.0F}, {0.0F, 0.2F}}},
                                                    {{{0.5F, 0.5F}, {1.0F, 0.5F}, {1.0F, 1.0F}}},
                                                    {{{0.75F, 0.5F}, {1.0F, 0.5F}, {1.0F, 0.75F}}}};
  const Map map = sample_all(surface_of(triangles), {32, 32, 1, 1U << 22});
  ASSERT_EQ(map.report.warnings.size(), 1U);
  const std::string& text = map.report.warnings[0].message.text();
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
