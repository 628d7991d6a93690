// Matching by UVs: the two conditions, and samples that have no point.
#include <gtest/gtest.h>

#include "kiln/bake.h"
#include "match/uv_scene.h"
#include "mesh/kernels_shared.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::bent_plane;
using test::by_uv;
using test::random_layout;
using test::trusting;

bool has_warning(const BakeReport& report, const std::string& code) {
  for (const Warning& warning : report.warnings) {
    if (warning.code == code) return true;
  }
  return false;
}

TEST(Uv, SamplesBeyondTheDenseLayoutAreMissesAndFallBack) {
  KILN_REQUIRE_DEVICE();
  Mesh dense = bent_plane(40, 0.01);
  dense.triangles.resize(dense.triangles.size() / 2);
  dense.uv_triangles.resize(dense.triangles.size());
  const Source source(*test::device(), dense);
  BakeOptions options = by_uv(64);
  const BakeResult alone = bake(source, test::plane(1, 1), options);
  EXPECT_GT(alone.report.missed, 1000U);
  EXPECT_EQ(alone.report.missed + alone.report.by_uv, alone.report.samples);
  EXPECT_TRUE(has_warning(alone.report, "many-misses"));
  options.match.fallback = {MatchMethod::closest};
  options.match.max_distance = Length::absolute(2);
  const BakeResult helped = bake(source, test::plane(1, 1), options);
  EXPECT_EQ(helped.report.by_uv, alone.report.by_uv);
  EXPECT_EQ(helped.report.closest, alone.report.missed);
  EXPECT_TRUE(helped.report.uv);
}

TEST(Uv, WarnsOfOverlapAndRefusesMuch) {
  KILN_REQUIRE_DEVICE();
  Mesh dense = bent_plane(20, 0.01);
  const BakeResult clean = bake(Source(*test::device(), dense), test::plane(1, 1), by_uv(128));
  EXPECT_EQ(clean.report.uv->overlapping, 0U);
  EXPECT_FALSE(has_warning(clean.report, "uv-source-overlap"));
  EXPECT_FALSE(has_warning(clean.report, "uv-disagreement"));

  // One cell's first triangle is drawn once more at the end: 1/800 of the square is covered twice.
  dense.triangles.push_back(dense.triangles[130]);
  dense.uv_triangles.push_back(dense.uv_triangles[130]);
  const Source source(*test::device(), dense);
  BakeOptions options = by_uv(128);
  const BakeResult little = bake(source, test::plane(1, 1), options);
  EXPECT_TRUE(has_warning(little.report, "uv-source-overlap"));
  EXPECT_NEAR(static_cast<double>(little.report.uv->overlapping) / (128 * 128), 1.0 / 800, 5e-4);
  EXPECT_EQ(little.report.uv->overlap.lower, 130U);
  EXPECT_EQ(little.report.uv->overlap.upper, 800U);
  EXPECT_EQ(little.match->triangle, clean.match->triangle);  // the lowest wins

  options.match.uv.max_overlap = 1e-4;
  try {
    bake(source, test::plane(1, 1), options);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(std::string(error.what()).find("triangles 130 and 800"), std::string::npos);
  }
  EXPECT_NO_THROW(bake(source, test::plane(1, 1), trusting(options)));
}

TEST(Uv, WarnsOfDisagreementAndRefusesMuch) {
  KILN_REQUIRE_DEVICE();
  const auto shifted = [](float by) {
    Mesh dense = bent_plane(20, 0.001);
    for (Vec2& uv : dense.uvs) uv.x += by;
    return Source(*test::device(), dense);
  };
  const Mesh low = test::plane(1, 1);
  BakeOptions options = by_uv(64);
  // A shift of s in UV is s in space, of a diagonal of sqrt(2).
  const BakeResult some = bake(shifted(0.04F), low, options);
  EXPECT_TRUE(has_warning(some.report, "uv-disagreement"));
  EXPECT_NEAR(some.report.uv->mean_distance, 0.04, 1e-3);
  EXPECT_NEAR(some.report.uv->p95_distance, 0.04, 1e-3);
  EXPECT_FALSE(has_warning(bake(shifted(0.01F), low, options).report, "uv-disagreement"));
  const Source much = shifted(0.1F);
  EXPECT_THROW(bake(much, low, options), Error);
  EXPECT_NO_THROW(bake(much, low, trusting(options)));
  options.match.uv.max_distance = -1;
  EXPECT_THROW(bake(much, low, options), Error);
}

TEST(Uv, OutsideAndWithoutAreaAreCounted) {
  KILN_REQUIRE_DEVICE();
  Mesh dense = bent_plane(10, 0.01);
  dense.uvs.push_back({std::nanf(""), 0});
  dense.uv_triangles[7][1] = static_cast<std::uint32_t>(dense.uvs.size() - 1);
  dense.uv_triangles[8] = {0, 0, 1};
  const BakeResult baked = bake(Source(*test::device(), dense), test::plane(1, 1), by_uv(40));
  EXPECT_EQ(baked.report.uv->without_area, 2U);
  EXPECT_TRUE(has_warning(baked.report, "uv-source-degenerate"));
  EXPECT_EQ(baked.report.missed, 16U);  // two halves of a 4 x 4 cell

  // Far triangles are clipped; what lies in the square is as it was.
  const Mesh far = random_layout(200, 3, 5, true);
  const BakeResult clipped =
      bake(Source(*test::device(), far), test::plane(1, 1), trusting(by_uv(40)));
  EXPECT_TRUE(has_warning(clipped.report, "uv-source-outside"));
  EXPECT_GT(clipped.report.uv->outside, 100U);
  std::uint64_t checked = 0;
  for (std::size_t y = 0; y < 40; ++y) {
    for (std::size_t x = 0; x < 40; ++x) {
      const std::uint32_t t = clipped.match->triangle[y * 40 + x];
      if (t == KILN_NO_TRIANGLE) continue;
      const float u = clipped.match->u[y * 40 + x];
      const float v = clipped.match->v[y * 40 + x];
      const Triangle& c = far.uv_triangles[t];
      // UVs up to 9 apart, clipped in double precision, mixed in single.
      ASSERT_NEAR(far.uvs[c[0]].x * (1 - u - v) + far.uvs[c[1]].x * u + far.uvs[c[2]].x * v,
                  (x + 0.5) / 40, 1e-4);
      ASSERT_NEAR(far.uvs[c[0]].y * (1 - u - v) + far.uvs[c[1]].y * u + far.uvs[c[2]].y * v,
                  1 - (y + 0.5) / 40, 1e-4);
      ++checked;
    }
  }
  EXPECT_GT(checked, 400U);
}

TEST(Uv, RefusesAMeshWithoutUvs) {
  KILN_REQUIRE_DEVICE();
  Mesh dense = bent_plane(4, 0.01);
  dense.uvs.clear();
  dense.uv_triangles.clear();
  try {
    bake(Source(*test::device(), dense), test::plane(1, 1), by_uv(16));
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
  }
  dense = bent_plane(4, 0.01);
  dense.uv_triangles[3][1] = 9999;
  EXPECT_THROW(bake(Source(*test::device(), dense), test::plane(1, 1), by_uv(16)), Error);
}

}  // namespace
}  // namespace kiln
