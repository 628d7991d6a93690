// Plans where layouts agree, or seem to.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "plan/plan_scene.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using namespace test::plan_scene;

/// Waves on a plane, and a plane under them with the same layout but for a shift.
struct Waves {
  Mesh high = test::plane(200, 200);
  Mesh low = test::plane(2, 2);

  explicit Waves(float shift = 0, float lift = 0) {
    high.normals.clear();
    high.normal_triangles.clear();
    for (Vec3& p : high.positions) p.z = 0.002F * std::sin(60 * p.x) * std::cos(50 * p.y) + lift;
    for (Vec2& uv : high.uvs) uv.x += shift;
  }
};

TEST(Plan, TakesUvsBeforeAllElseWhereLayoutsAgree) {
  KILN_REQUIRE_DEVICE();
  Ripples pair;
  pair.bend(pair.high = test::uv_sphere(384, 192));
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0);
  options.bake.match.method = MatchMethod::uv;
  const Pictures pictures(pair.high, kPlanPixels);
  const auto error = [&](std::uint32_t size) {
    options.bake.width = options.bake.height = size;
    return pictures.error(pair.low, bake(source, pair.low, options.bake).maps[0].image);
  };
  const double small = error(128), larger = error(256), largest = error(2048);
  ASSERT_GT(small, 1.02 * larger);
  const PlannedBake planned =
      bake_planned(source, pair.low, plan_options((small + larger) / 2, 2048));
  EXPECT_TRUE(planned.reached);
  EXPECT_EQ(planned.chosen.method, MatchMethod::uv);
  EXPECT_EQ(planned.chosen.width, 256U);
  EXPECT_NEAR(planned.chosen.error.mean_degrees, larger, 0.005 * larger);
  EXPECT_EQ(planned.result.report.by_uv, planned.result.report.samples);
  // No other way is looked at, and what an endless map would reach was known without baking one.
  EXPECT_EQ(looked_at(planned), std::vector{MatchMethod::uv});
  EXPECT_NEAR(planned.limits[0].error.mean_degrees, largest, 0.02 * largest);
  EXPECT_EQ(planned.limits[0].missed, 0);

  // Out of reach: no way is better, and rays are only looked at.
  const PlannedBake hopeless = bake_planned(source, pair.low, plan_options(1e-4, 512));
  EXPECT_FALSE(hopeless.reached);
  EXPECT_EQ(hopeless.chosen.method, MatchMethod::uv);
  const std::vector<MatchMethod> both = {MatchMethod::uv, MatchMethod::ray};
  EXPECT_EQ(looked_at(hopeless), both);
  for (const PlanTrial& trial : hopeless.trials) EXPECT_EQ(trial.method, MatchMethod::uv);
  EXPECT_GT(hopeless.least, 0);
}

TEST(Plan, ATrialThatFindsNothingIsNeverTheResult) {
  KILN_REQUIRE_DEVICE();
  // Half of the low poly's layout lies beside the unit square; the dense one's lies beside the rest.
  Waves pair;
  for (Vec2& uv : pair.low.uvs) uv.x += 0.5F;
  for (Vec2& uv : pair.high.uvs) uv.x *= 0.4F;
  const Source source(*test::device(), pair.high);
  BakeOptions by_uv = plan_options(0, 128).bake;
  by_uv.match.method = MatchMethod::uv;
  const BakeReport nothing = bake(source, pair.low, by_uv).report;
  ASSERT_GT(nothing.samples, 0U);
  ASSERT_EQ(nothing.missed, nothing.samples) << "else this tests nothing";
  for (const double wanted : {0.0, 4.0, 60.0}) {
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(wanted, 256));
    EXPECT_NE(planned.chosen.method, MatchMethod::uv) << wanted;
    EXPECT_EQ(planned.result.report.missed, 0U);
    EXPECT_FALSE(planned.result.report.uv);
    if (wanted == 60) {
      EXPECT_TRUE(planned.reached);
    }
  }
  // Rays that end too early find nothing; nearest points have no such end.
  const Mesh far = test::plane(8, 8), low = test::plane(2, 2);
  Mesh raised = far;
  for (Vec3& p : raised.positions) p.z = 0.3F;
  raised.uvs.clear();
  raised.uv_triangles.clear();
  PlanOptions turned = plan_options(60, 128);
  turned.bake.match.max_distance = Length::absolute(0.5);
  Mesh inward = low;
  inward.normals = {{1, 0, 0}};  // rays run along the plane
  const PlannedBake planned = bake_planned(Source(*test::device(), raised), inward, turned);
  EXPECT_NE(planned.chosen.method, MatchMethod::ray);
  EXPECT_LT(planned.chosen.missed, 1);
  EXPECT_LT(planned.result.report.missed, planned.result.report.samples);
}

TEST(Plan, LeavesUvsOutWhereTheyDoNotFit) {
  KILN_REQUIRE_DEVICE();
  const auto expect_rays = [](const Waves& pair, const PlanOptions& options) {
    const Source source(*test::device(), pair.high);
    const PlannedBake planned = bake_planned(source, pair.low, options);
    EXPECT_TRUE(planned.reached);
    EXPECT_EQ(looked_at(planned), std::vector{MatchMethod::ray});
    for (const PlanTrial& trial : planned.trials) EXPECT_EQ(trial.method, MatchMethod::ray);
    for (const Warning& warning : planned.result.report.warnings) {
      EXPECT_EQ(warning.code.find("uv-"), std::string::npos) << warning.message.text();
    }
    EXPECT_FALSE(planned.result.report.uv);
  };
  const double reachable = 4;
  expect_rays(Waves(0.2F), plan_options(reachable, 256));
  expect_rays(Waves(0.2F), plan_options(0, 256));
  // The bound is the caller's.
  PlanOptions strict = plan_options(reachable, 256);
  strict.bake.match.uv.max_distance = 1e-4;
  expect_rays(Waves(), strict);
  // A cage is for rays.
  PlanOptions cage = plan_options(reachable, 256);
  cage.bake.match.cage = Length::share(0.05);
  expect_rays(Waves(), cage);
}

TEST(Plan, WithoutAnErrorTakesUvsUnlessRaysGetNearer) {
  KILN_REQUIRE_DEVICE();
  const auto chosen = [](const Waves& pair) {
    const Source source(*test::device(), pair.high);
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 512));
    EXPECT_TRUE(planned.reached);
    const std::vector<MatchMethod> both = {MatchMethod::uv, MatchMethod::ray};
    EXPECT_EQ(looked_at(planned), both);
    return planned.chosen.method;
  };
  EXPECT_EQ(chosen(Waves()), MatchMethod::uv);
  // Layouts that agree within the bound, but not well: a tenth of a wave.
  EXPECT_EQ(chosen(Waves(0.01F)), MatchMethod::ray);
  // Too far for rays.
  const Waves lifted(0, 0.04F);
  const Source source(*test::device(), lifted.high);
  PlanOptions options = plan_options(0, 512);
  options.bake.match.max_distance = Length::share(0.01);
  options.bake.match.uv.max_distance = 0.1;
  const PlannedBake planned = bake_planned(source, lifted.low, options);
  EXPECT_EQ(planned.chosen.method, MatchMethod::uv);
  EXPECT_EQ(planned.chosen.missed, 0);
  EXPECT_EQ(planned.limits.back().missed, 1);
}

/// Waves of which a strip lies too high for rays. Their layout is a tenth of a wave off, so that rays are nearer where
/// they find something; and seen aslant, what UVs find in the strip is hardly better than nothing.
struct Strip : Waves {
  Strip() : Waves(0.01F) {
    for (Vec3& p : high.positions) p.z += p.x > 0.3F ? 0.04F : 0;
    options.bake.match.max_distance = Length::share(0.01);
    options.bake.match.uv.max_distance = 0.1;
  }
  PlanOptions options = plan_options(0, 512);
};

/// `misses_more`: what misses a part of the surface is not taken for its mean error, though it be lower.
TEST(Plan, WhatFindsLessThanUvsIsNotNearer) {
  KILN_REQUIRE_DEVICE();
  const Strip strip;
  const Source source(*test::device(), strip.high);
  const PlannedBake planned = bake_planned(source, strip.low, strip.options);
  const std::vector<MatchMethod> both = {MatchMethod::uv, MatchMethod::ray};
  ASSERT_EQ(looked_at(planned), both);
  const PlanLimit &by_uv = planned.limits[0], &by_ray = planned.limits[1];
  ASSERT_LT(by_ray.error.mean_degrees, 0.9 * by_uv.error.mean_degrees) << "else this tests nothing";
  ASSERT_GT(by_ray.missed, 0.1);
  ASSERT_LT(by_ray.missed, 0.5);
  ASSERT_LT(by_uv.missed, 0.01);
  EXPECT_EQ(planned.chosen.method, MatchMethod::uv);
  EXPECT_LT(planned.chosen.missed, 0.02) << "at the border, which the layout's shift leaves bare";
}

TEST(Plan, KnowsWhatAFallbackAddsToUvs) {
  KILN_REQUIRE_DEVICE();
  Waves pair;
  for (Vec2& uv : pair.high.uvs) {
    if (uv.x > 0.5F) uv.x = NAN;
  }
  const Source source(*test::device(), pair.high);
  const NormalProbe probe(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, true);
  std::shared_ptr<const VisibilityField> field;
  BakeOptions options = plan_options(0).bake;
  const double by_rays = probe.infinite_map(options, field).error.mean_degrees;
  options.match.method = MatchMethod::uv;
  const NormalProbe::InfiniteMap half = probe.infinite_map(options, field);
  EXPECT_NEAR(half.missed, 0.5, 0.02);
  EXPECT_GT(half.error.mean_degrees, 1.2 * by_rays);
  for (const MatchMethod fallback : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views}) {
    options.match.fallback = {fallback};
    const NormalProbe::InfiniteMap whole = probe.infinite_map(options, field);
    EXPECT_LT(whole.missed, 0.01);
    EXPECT_NEAR(whole.error.mean_degrees, by_rays, 0.05 * by_rays);
  }
}

}  // namespace
}  // namespace kiln
