// Plans: the error that is asked for is reached by the smallest map, or said to be out of reach.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/measure.h"
#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "plan/plan_scene.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using namespace test::plan_scene;

TEST(Plan, ReachesTheErrorWithTheSmallestMap) {
  KILN_REQUIRE_DEVICE();
  const Ripples pair;
  const Source source(*test::device(), pair.high);
  const Pictures pictures(pair.high, kPlanPixels);
  // Every size's own error first.
  std::vector<double> errors;
  std::vector<Image> maps;
  const std::vector<std::uint32_t> sizes = {128, 256, 512};
  for (const std::uint32_t size : sizes) {
    maps.push_back(bake(source, pair.low, plan_options(0, size).bake).maps[0].image);
    errors.push_back(pictures.error(pair.low, maps.back()));
  }
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    ASSERT_GT(errors[i], 1.1 * errors[i + 1]);
    const double between = (errors[i] + errors[i + 1]) / 2;
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(between));
    EXPECT_TRUE(planned.reached);
    EXPECT_EQ(planned.wanted, between);
    EXPECT_EQ(planned.chosen.width, sizes[i + 1]);
    EXPECT_EQ(planned.chosen.method, MatchMethod::ray);
    EXPECT_NEAR(planned.chosen.error.mean_degrees, errors[i + 1], 0.005 * errors[i + 1]);
    // The result is what the method bakes at this size.
    ASSERT_EQ(planned.result.maps.size(), 1U);
    EXPECT_EQ(planned.result.maps[0].image.pixels, maps[i + 1].pixels);
    // One small map, the one that is chosen, and at most one between them; and no other way is looked at.
    EXPECT_LE(planned.trials.size(), 3U);
    EXPECT_EQ(planned.limits.size(), 1U);
  }
}

TEST(Plan, WithoutAnErrorTakesWhatLargerMapsWouldNotImprove) {
  KILN_REQUIRE_DEVICE();
  const Ripples pair;
  const Source source(*test::device(), pair.high);
  const Pictures pictures(pair.high, kPlanPixels);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 2048));
  ASSERT_TRUE(planned.reached);
  EXPECT_EQ(planned.wanted, planned.chosen.error.mean_degrees);
  ASSERT_LT(planned.chosen.width, 2048U);
  ASSERT_GT(planned.chosen.width, 128U);
  const auto error = [&](std::uint32_t size) {
    const BakeResult baked = bake(source, pair.low, plan_options(0, size).bake);
    return pictures.error(pair.low, baked.maps[0].image);
  };
  const double largest = error(2048);
  EXPECT_LT(planned.chosen.error.mean_degrees, 1.06 * largest);
  EXPECT_GT(error(planned.chosen.width / 2), 1.04 * largest);
  // An endless map's error was known without baking one.
  ASSERT_EQ(planned.limits.size(), 1U);
  EXPECT_NEAR(planned.limits[0].error.mean_degrees, largest, 0.02 * largest);
}

TEST(Plan, MeasuresWhatOthersMeasure) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 256));
  const Image& map = planned.result.maps[0].image;
  for (const auto& [pixels, tolerance] : {std::pair{kPlanPixels, 0.002}, std::pair{512U, 0.03}}) {
    const Pictures pictures(pair.high, pixels);
    const double mean = pictures.error(pair.low, map);
    EXPECT_NEAR(planned.chosen.error.mean_degrees, mean, tolerance * mean) << pixels;
    const double plain = pictures.without_map(pair.low, map);
    EXPECT_NEAR(planned.without_map.mean_degrees, plain, tolerance * plain) << pixels;
  }
}

TEST(Plan, MeasuresTheSameWithoutAHierarchy) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const BakeResult baked = bake(source, pair.low, plan_options(0, 256).bake);
  const NormalProbe rays(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, false);
  const NormalProbe drawn(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, true);
  const Image& map = baked.maps[0].image;
  const NormalError a = rays.with_map(map, {});
  const NormalError b = drawn.with_map(map, {});
  EXPECT_GT(a.pixels, 10000U);
  EXPECT_NEAR(static_cast<double>(a.pixels), static_cast<double>(b.pixels), 0.002 * a.pixels);
  EXPECT_NEAR(a.mean_degrees, b.mean_degrees, 0.002 * a.mean_degrees);
}

TEST(Plan, MeasuresAnOpenMeshTheSameWithoutAHierarchy) {
  KILN_REQUIRE_DEVICE();
  // From below, drawing would show the steepest places alone, and those turned away.
  Mesh high = test::plane(200, 200);
  high.normals.clear();
  high.normal_triangles.clear();
  for (Vec3& p : high.positions) p.z = 0.02F * std::sin(60 * p.x) * std::cos(50 * p.y);
  const Source source(*test::device(), high);
  const Mesh low = test::plane(2, 2);
  const Image map = bake(source, low, plan_options(0, 512).bake).maps[0].image;
  const NormalProbe rays(impl_of(source), low, nullptr, Pictures::views(), kPlanPixels, false);
  const NormalProbe drawn(impl_of(source), low, nullptr, Pictures::views(), kPlanPixels, true);
  const NormalError a = rays.with_map(map, {});
  const NormalError b = drawn.with_map(map, {});
  EXPECT_NEAR(static_cast<double>(b.pixels), 0.5 * static_cast<double>(a.pixels), 0.05 * a.pixels);
  EXPECT_NEAR(a.mean_degrees, b.mean_degrees, 0.05 * a.mean_degrees);
}

TEST(Plan, KnowsWhatNoMapCanShow) {
  KILN_REQUIRE_DEVICE();
  // Waves on a plane: from the side, other parts of them are behind each place. Flat, nothing is.
  const auto least_of = [](double height) {
    Mesh high = test::plane(200, 200);
    high.normals.clear();
    high.normal_triangles.clear();
    for (Vec3& p : high.positions) p.z = static_cast<float>(height * std::sin(60 * p.x));
    const Source source(*test::device(), high);
    const NormalProbe probe(impl_of(source), test::plane(2, 2), nullptr, Pictures::views(),
                            kPlanPixels, false);
    EXPECT_GT(probe.places(), 1000U);
    // As a share of another error the least is the same, but for what grazing directions, of which it takes
    // none, add to each.
    std::shared_ptr<const VisibilityField> field;
    NormalProbe::InfiniteMap limit = probe.infinite_map(plan_options(0).bake, field);
    const double least = limit.error.mean_degrees * probe.min_error_share(limit);
    EXPECT_LT(least, limit.error.mean_degrees);
    for (std::size_t i = 0; i < limit.normals.size(); ++i) limit.normals[i] = i % 3 == 2 ? 1 : 0;
    const double plain = probe.error_with_normals(limit.normals).mean_degrees;
    EXPECT_NEAR(plain, probe.without_map().mean_degrees, 1e-3 * plain);
    EXPECT_NEAR(plain * probe.min_error_share(limit), least, 0.2 * least);
    return least;
  };
  // By the height for slopes, and again for how far pictures shift.
  const double low = least_of(0.001), high = least_of(0.002);
  EXPECT_GT(low, 0.01);
  EXPECT_GT(high, 3 * low);
  EXPECT_LT(high, 5 * low);
}

TEST(Plan, SaysWhatIsOutOfReach) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  // Below what any map can show: there is no need to look at other ways.
  PlanOptions options = plan_options(1e-4, 512);
  const PlannedBake hopeless = bake_planned(source, pair.low, options);
  EXPECT_FALSE(hopeless.reached);
  EXPECT_EQ(hopeless.wanted, 1e-4);
  EXPECT_EQ(looked_at(hopeless), std::vector{MatchMethod::ray});
  EXPECT_GT(hopeless.least, 0);
  EXPECT_LE(hopeless.least, hopeless.limits[0].error.mean_degrees);
  // The result is the best that it found, within what a larger map must gain.
  for (const PlanTrial& trial : hopeless.trials) {
    EXPECT_LE(hopeless.chosen.error.mean_degrees, trial.error.mean_degrees / 0.98);
  }

  // Rays that are too short miss, which a better match would not: the others are looked at, views too.
  options.max_error = 1.1 * hopeless.chosen.error.mean_degrees;
  EXPECT_TRUE(bake_planned(source, pair.low, options).reached);
  options.bake.match.max_distance = Length::share(0.0005);
  const PlannedBake short_rays = bake_planned(source, pair.low, options);
  EXPECT_FALSE(short_rays.reached);
  EXPECT_GT(short_rays.limits.front().missed, 0.01);
  const std::vector<MatchMethod> all = {MatchMethod::ray, MatchMethod::hybrid,
                                        MatchMethod::visibility, MatchMethod::closest,
                                        MatchMethod::views};
  EXPECT_EQ(looked_at(short_rays), all);
}

TEST(Plan, LooksAtViewsLastAndOnlyWhereTheyMayHelp) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Source source(*test::device(), load_mesh(*test::shared_data("bunny_high.ply")));
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const PlannedBake hopeless = bake_planned(source, low, plan_options(0.1, 2048));
  EXPECT_EQ(looked_at(hopeless), std::vector{MatchMethod::ray});
  const double least = hopeless.least, by_rays = hopeless.limits[0].error.mean_degrees;
  ASSERT_LT(least * 1.05, by_rays);
  // Between the two another way might reach it. None does.
  const PlannedBake planned = bake_planned(source, low, plan_options(least * 1.02, 2048));
  EXPECT_FALSE(planned.reached);
  const std::vector<MatchMethod> expected = {MatchMethod::ray, MatchMethod::hybrid,
                                             MatchMethod::visibility, MatchMethod::closest};
  EXPECT_EQ(looked_at(planned), expected);
  for (const PlanLimit& limit : planned.limits) EXPECT_GT(limit.error.mean_degrees, least);
}

TEST(Plan, EncodingsChangeNothingInWhatIsMeasured) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0, 256);
  const double plain = bake_planned(source, pair.low, options).chosen.error.mean_degrees;
  options.bake.encoding.flip_y = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.encoding.raw = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.encoding.two_component = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 0.02);
  options.bake.encoding.raw = options.bake.encoding.two_component = options.bake.encoding.flip_y =
      false;
  options.bake.encoding.space = NormalMapSpace::object;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain,
              0.2 * plain);
}

TEST(Plan, KeepsTheShapeOfTheMapAndTheCage) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(1e-4, 256);
  options.bake.width = 512;
  options.bake.match.cage = Length::share(0.05);
  const PlannedBake planned = bake_planned(source, pair.low, options);
  for (const PlanTrial& trial : planned.trials) {
    EXPECT_EQ(trial.width, 2 * trial.height);
    EXPECT_EQ(trial.method, MatchMethod::ray);
  }
}

TEST(Plan, RefusesAndCancels) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  EXPECT_THROW(bake_planned(source, pair.low, plan_options(-1)), Error);
  EXPECT_THROW(bake_planned(source, pair.low, plan_options(std::nan(""))), Error);
  PlanOptions options = plan_options(1);
  options.bake.maps = {MapKind::mask};
  EXPECT_THROW(bake_planned(source, pair.low, options), Error);
  options = plan_options(1);
  options.bake.progress = [](double, std::string_view) { return false; };
  EXPECT_TRUE(bake_planned(source, pair.low, options).result.cancelled);
}

/// A cage's mesh is for rays, as a distance is: no other way is looked at.
TEST(Plan, ACageMeshIsForRays) {
  KILN_REQUIRE_DEVICE();
  Pair pair;
  pair.low = test::BumpySphere::light(24, 12);
  const Source source(*test::device(), pair.high);
  Mesh cage = pair.low;
  for (Vec3& p : cage.positions) p = {1.2F * p.x, 1.2F * p.y, 1.2F * p.z};
  PlanOptions options = plan_options(1e-4, 128);
  options.bake.match.cage_mesh = &cage;
  const PlannedBake planned = bake_planned(source, pair.low, options);
  EXPECT_FALSE(planned.reached);
  EXPECT_EQ(looked_at(planned), std::vector{MatchMethod::ray});
  // A little below what rays reach another way might do.
  options.max_error = 0.98 * planned.chosen.error.mean_degrees;
  EXPECT_EQ(looked_at(bake_planned(source, pair.low, options)), std::vector{MatchMethod::ray});
  for (const PlanTrial& trial : planned.trials) EXPECT_EQ(trial.method, MatchMethod::ray);
  EXPECT_EQ(planned.result.report.cage,
            planned.result.report.samples - planned.result.report.missed);
}

/// Without an error that is asked for, what finds nothing is given up for the next way that finds something.
TEST(Plan, WithoutAnErrorTakesTheFirstThatFindsAnything) {
  KILN_REQUIRE_DEVICE();
  Mesh raised = test::plane(8, 8);
  for (Vec3& p : raised.positions) p.z = 0.3F;
  raised.uvs.clear();
  raised.uv_triangles.clear();
  Mesh inward = test::plane(2, 2);
  inward.normals = {{1, 0, 0}};  // rays run along the plane
  PlanOptions options = plan_options(0, 128);
  options.bake.match.max_distance = Length::absolute(0.5);
  const PlannedBake planned = bake_planned(Source(*test::device(), raised), inward, options);
  EXPECT_NE(planned.chosen.method, MatchMethod::ray);
  EXPECT_LT(planned.chosen.missed, 1);
  EXPECT_EQ(planned.wanted, planned.chosen.error.mean_degrees);
  EXPECT_TRUE(planned.reached);
  // Where nothing finds anything, that is not said to be reached.
  options.bake.match.max_distance = Length::absolute(1e-3);
  const PlannedBake nothing = bake_planned(Source(*test::device(), raised), inward, options);
  EXPECT_FALSE(nothing.reached);
  EXPECT_EQ(nothing.chosen.missed, 1);
}

/// Two components alone are measured as the whole normal that they stand for.
TEST(Plan, TwoComponentsAreMeasuredAsWholeNormals) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0, 128);
  const PlannedBake plain = bake_planned(source, pair.low, options);
  options.bake.encoding.two_component = true;
  const PlannedBake two = bake_planned(source, pair.low, options);
  EXPECT_NEAR(two.chosen.error.mean_degrees, plain.chosen.error.mean_degrees, 0.02);
  const std::vector<float>& pixels = two.result.maps[0].image.pixels;
  const std::uint32_t channels = two.result.maps[0].image.channels;
  for (std::size_t i = 2; channels == 3 && i < pixels.size(); i += 3) ASSERT_EQ(pixels[i], 0);
}

}  // namespace
}  // namespace kiln
