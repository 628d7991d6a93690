// Why samples have their points or none, on planes where each reason is known by construction.
#include "kiln/reasons.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A plane of four unit strips, from x = 0: its triangles in order of x.
Mesh four_strips() {
  Mesh mesh = test::plane(4, 1, 4, 1);
  float least = 1e9F;
  for (const Vec3& p : mesh.positions) least = std::min(least, p.x);
  for (Vec3& p : mesh.positions) p.x -= least;
  return mesh;
}

/// The high poly over the four strips: at height 0.01, turned over, at height 0.5, and not there.
Mesh dense() {
  const Mesh whole = four_strips();
  Mesh mesh;
  mesh.name = "dense";
  for (const Triangle& triangle : whole.triangles) {
    float middle = 0;
    for (const std::uint32_t corner : triangle) middle += whole.positions[corner].x / 3;
    const int strip = static_cast<int>(middle);
    if (strip == 3) continue;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const std::uint32_t corner : triangle) {
      Vec3 p = whole.positions[corner];
      p.z = strip == 2 ? 0.5F : 0.01F;
      mesh.positions.push_back(p);
    }
    mesh.triangles.push_back(strip == 1 ? Triangle{first, first + 2, first + 1}
                                        : Triangle{first, first + 1, first + 2});
  }
  return mesh;
}

BakeOptions options_of() {
  BakeOptions options;
  options.width = 32;
  options.height = 8;
  options.match.max_distance = Length::absolute(0.1);
  options.report.keep_match = true;
  return options;
}

const ReasonCount* count_of(const Reasons& reasons, Reason reason) {
  const auto found = std::find_if(reasons.counts.begin(), reasons.counts.end(),
                                  [&](const ReasonCount& c) { return c.reason == reason; });
  return found == reasons.counts.end() ? nullptr : &*found;
}

TEST(Reasons, AreThoseOfEachStrip) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = four_strips(), high = dense();
  const Source source(*test::device(), high);
  const BakeOptions options = options_of();
  const BakeResult result = bake(source, low, options);
  const Reasons reasons = explain(*result.match, source, low, options);
  const Reason wanted[4] = {Reason::found, Reason::back_face, Reason::far, Reason::nothing};
  ASSERT_EQ(reasons.texels.size(), 32U * 8U);
  for (std::size_t i = 0; i < reasons.texels.size(); ++i) {
    // Texels are eight a strip, and their middles lie on no border.
    EXPECT_EQ(reasons.texels[i], wanted[i % 32 / 8]) << i;
  }
  ASSERT_EQ(reasons.counts.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    const ReasonCount* count = count_of(reasons, wanted[k]);
    ASSERT_NE(count, nullptr);
    EXPECT_EQ(count->samples, 64U);
    EXPECT_EQ(count->column / 8, k);
    EXPECT_NEAR(count->position[0], (count->column + 0.5) / 8, 1e-5);
  }
  EXPECT_NEAR(count_of(reasons, Reason::far)->distance, 0.5, 1e-5);
}

/// A texel of several samples has the gravest of their reasons, whether its sample lies on the left or on the right.
TEST(Reasons, OfSeveralSamplesTheGravestCounts) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = dense();
  const Source source(*test::device(), high);
  BakeOptions options = options_of();
  options.width = 30;  // the strips' borders run through texels
  options.samples = 4;
  for (const bool mirrored : {false, true}) {
    Mesh low = four_strips();
    std::vector<Reason> of_strip = {Reason::found, Reason::back_face, Reason::far, Reason::nothing};
    if (mirrored) {
      for (Vec2& uv : low.uvs) uv.x = 1 - uv.x;
      std::reverse(of_strip.begin(), of_strip.end());
    }
    const Reasons reasons = explain(*bake(source, low, options).match, source, low, options);
    ASSERT_EQ(reasons.texels.size(), 30U * 8U);
    std::size_t mixed = 0;
    for (std::size_t i = 0; i < reasons.texels.size(); ++i) {
      Reason wanted = Reason::empty, least = Reason::nothing;
      for (std::size_t s = 0; s < 4; ++s) {
        const std::size_t sample = 4 * (i % 30) + s;  // of 120 in a row, 30 a strip
        wanted = std::max(wanted, of_strip[sample / 30]);
        least = std::min(least, of_strip[sample / 30]);
      }
      EXPECT_EQ(reasons.texels[i], wanted) << i;
      mixed += wanted != least ? 1 : 0;
    }
    EXPECT_EQ(mixed, 2U * 8);  // borders at samples 30 and 90; that at 60 lies between texels
    for (const Reason reason : of_strip) {
      const ReasonCount* count = count_of(reasons, reason);
      ASSERT_NE(count, nullptr);
      EXPECT_EQ(count->samples, 30U * 32);
    }
  }
}

/// Half of the low poly is paired with what lies elsewhere.
TEST(Reasons, NameOtherParts) {
  KILN_REQUIRE_DEVICE();
  Mesh low = test::plane(2, 1), high = low;
  for (Vec3& p : high.positions) p.z += 0.01F;
  Parts parts;
  parts.count = 2;
  parts.names = {"a", "b"};
  parts.low = {0, 0, 1, 1};
  parts.high = {0, 0, 0, 0};
  const Source source(*test::device(), high);
  BakeOptions options = options_of();
  options.match.parts = &parts;
  const BakeResult result = bake(source, low, options);
  const Reasons reasons = explain(*result.match, source, low, options);
  ASSERT_NE(count_of(reasons, Reason::other_part), nullptr);
  EXPECT_EQ(count_of(reasons, Reason::other_part)->samples, result.report.missed);
  EXPECT_EQ(result.report.missed, 128U);
}

/// A low poly whose directions point through its own back.
TEST(Reasons, NameFolds) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(1, 1);
  Mesh low = high;
  for (Vec3& normal : low.normals) normal = {0, 0, -1};
  const Source source(*test::device(), high);
  const BakeOptions options = options_of();
  const BakeResult result = bake(source, low, options);
  const Reasons reasons = explain(*result.match, source, low, options);
  ASSERT_EQ(reasons.counts.size(), 1U);
  EXPECT_EQ(reasons.counts[0].reason, Reason::folded);
}

TEST(Reasons, AreOfRaysAlone) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(1, 1);
  const Source source(*test::device(), plane);
  BakeOptions options = options_of();
  const BakeResult result = bake(source, plane, options);
  EXPECT_NO_THROW(explain(*result.match, source, plane, options));
  options.match.method = MatchMethod::closest;
  EXPECT_THROW(explain(*result.match, source, plane, options), Error);
  options = options_of();
  options.width = 16;
  EXPECT_THROW(explain(*result.match, source, plane, options), Error);
  EXPECT_THROW(explain(*result.match, source, test::plane(2, 2), options_of()), Error);
}

}  // namespace
}  // namespace kiln
