// Plans: the error that is asked for is reached by the smallest map, or said to be out of reach.
#include "kiln/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Pair {
  Mesh high = test::BumpySphere::dense(30000, true);
  Mesh low = test::BumpySphere::light(48, 24);
};

PlanOptions plan_options(double max_error, std::uint32_t size = 1024) {
  PlanOptions options;
  options.max_error = max_error;
  options.bake.width = options.bake.height = size;
  options.bake.max_distance = Length::share(0.05);
  return options;
}

TEST(Plan, ReachesTheErrorWithTheSmallestMap) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  // Every size's own error first.
  const PlannedBake level = bake_planned(source, pair.low, plan_options(0));
  ASSERT_GE(level.trials.size(), 2U);
  ASSERT_TRUE(level.reached);
  EXPECT_EQ(level.wanted, level.chosen.error.mean_degrees);
  for (std::size_t i = 1; i < level.trials.size(); ++i) {
    EXPECT_EQ(level.trials[i].width, 2 * level.trials[i - 1].width);
    EXPECT_LT(level.trials[i].error.mean_degrees, level.trials[i - 1].error.mean_degrees);
  }
  EXPECT_GT(level.without_map.mean_degrees, 5 * level.chosen.error.mean_degrees);

  const double between =
      (level.trials[0].error.mean_degrees + level.trials[1].error.mean_degrees) / 2;
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(between));
  EXPECT_TRUE(planned.reached);
  EXPECT_EQ(planned.chosen.width, level.trials[1].width);
  EXPECT_EQ(planned.chosen.method, MatchMethod::ray);
  EXPECT_LE(planned.chosen.error.mean_degrees, between);
  ASSERT_EQ(planned.result.maps.size(), 1U);
  EXPECT_EQ(planned.result.maps[0].image.width, planned.chosen.width);

  // The result is what the method bakes at this size.
  BakeOptions same = plan_options(0).bake;
  same.width = same.height = planned.chosen.width;
  EXPECT_EQ(planned.result.maps[0].image.pixels, bake(source, pair.low, same).maps[0].image.pixels);
}

TEST(Plan, MeasuresWhatOthersMeasure) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 512));
  std::vector<ViewAngles> views;
  for (const Vec3& toward : held_out_views(30, spread_views(12))) {
    views.push_back(view_angles(toward));
  }
  const NormalReference reference(Scene(*test::device(), pair.high), pair.high, views);
  const Scene scene(*test::device(), pair.low, {&planned.result.maps[0].image});
  const double mean = reference.compare(scene).mean_degrees;
  EXPECT_NEAR(planned.chosen.error.mean_degrees, mean, 0.1 * mean);
  const double plain = reference.compare(scene, true).mean_degrees;
  EXPECT_NEAR(planned.without_map.mean_degrees, plain, 0.1 * plain);
}

TEST(Plan, SaysWhatIsOutOfReachAndTriesTheOtherWays) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(1e-4, 256));
  EXPECT_FALSE(planned.reached);
  EXPECT_EQ(planned.wanted, 1e-4);
  std::vector<MatchMethod> tried;
  for (const PlanTrial& trial : planned.trials) tried.push_back(trial.method);
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::hybrid, MatchMethod::visibility,
                                   MatchMethod::closest, MatchMethod::views}) {
    EXPECT_NE(std::find(tried.begin(), tried.end(), method), tried.end());
  }
  // What it gives is the best that it found, within what a larger map must gain.
  for (const PlanTrial& trial : planned.trials) {
    EXPECT_LE(planned.chosen.error.mean_degrees, trial.error.mean_degrees / 0.98);
  }
}

TEST(Plan, EncodingsChangeNothingInWhatIsMeasured) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0, 256);
  const double plain = bake_planned(source, pair.low, options).chosen.error.mean_degrees;
  options.bake.flip_y = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.raw = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.two_component = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 0.02);
  options.bake.raw = options.bake.two_component = options.bake.flip_y = false;
  options.bake.space = NormalMapSpace::object;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain,
              0.2 * plain);
}

TEST(Plan, KeepsTheShapeOfTheMapAndTheCage) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(1e-4, 256);
  options.bake.width = 512;
  options.bake.cage = Length::share(0.05);
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

}  // namespace
}  // namespace kiln
