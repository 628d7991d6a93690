// Measuring a device: what is chosen from the measurements, and that each is one of what it claims.
#include "accel/tune.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

using cl::Tuning;

tune::BuildTrial build_trial(std::uint64_t triangles, double host, double device,
                             double host_rays = 1, double device_rays = 1) {
  return {.triangles = triangles,
          .host_build = host,
          .host_rays = host_rays,
          .can_device_build = true,
          .device_build = device,
          .device_rays = device_rays};
}

TEST(Tune, TheDeviceBuildsFromTheSizeAtWhichItAlwaysWins) {
  const auto wins = [](std::uint64_t n) { return build_trial(n, 2, 1); };
  const auto loses = [](std::uint64_t n) { return build_trial(n, 1, 2); };
  EXPECT_EQ(tune::choose_min_triangles({}), Tuning::kNever);
  EXPECT_EQ(tune::choose_min_triangles({loses(400), wins(100)}), Tuning::kNever);
  EXPECT_EQ(tune::choose_min_triangles({wins(400), loses(100), wins(25)}), 400U);
  EXPECT_EQ(tune::choose_min_triangles({wins(400), wins(100)}), 100U);
  tune::BuildTrial impossible = wins(400);
  impossible.can_device_build = false;
  EXPECT_EQ(tune::choose_min_triangles({impossible}), Tuning::kNever);
}

/// A tree that is built sooner may cost more with the rays.
TEST(Tune, RaysCountWithTheBuild) {
  EXPECT_FALSE(build_trial(1, 2, 1, 1, 3).is_device_faster());
  EXPECT_TRUE(build_trial(1, 2, 1, 1, 1.5).is_device_faster());
  EXPECT_TRUE(build_trial(1, 1, 2, 3, 1).is_device_faster());
  EXPECT_FALSE(build_trial(1, 1, 0.99, 1, 1).is_device_faster()) << "within the noise";
}

TEST(Tune, AGroupSizeReplacesTheDefaultIfItGains) {
  const auto choose = [](std::vector<double> seconds) {
    return tune::choose_group(
        {.key = "k", .name = "n", .sizes = {0, 16, 64}, .seconds = std::move(seconds)});
  };
  EXPECT_EQ(choose({1, 0.5, 0.7}), 16U);
  EXPECT_EQ(choose({1, 0.7, 0.5}), 64U);
  EXPECT_EQ(choose({1, 2, 3}), 0U);
  EXPECT_EQ(choose({1, 0.99, 0.98}), 0U) << "within the noise";
}

TEST(Tune, MeasuresADevice) {
  KILN_REQUIRE_DEVICE();
  const Device device = Device::open(std::to_string(test::device()->info().index));
  cl::Context& context = context_of(device);
  Tuning before;
  before.ray_group = 32;
  context.set_tuning(before);
  std::vector<std::string> stages;
  const tune::Result result =
      tune::measure(context, 20000, [&](std::string_view stage) { stages.emplace_back(stage); });
  EXPECT_EQ(context.tuning(), before);
  const std::size_t families = context.info().is_gpu ? 5 : 4;
  EXPECT_EQ(stages.size(), 4 + families);
  ASSERT_EQ(result.builds.size(), 4U);
  for (std::size_t i = 0; i < result.builds.size(); ++i) {
    const tune::BuildTrial& trial = result.builds[i];
    EXPECT_NEAR(static_cast<double>(trial.triangles), 20000 / std::pow(4.0, i), 2000);
    EXPECT_TRUE(trial.can_device_build);
    for (const double seconds :
         {trial.host_build, trial.host_rays, trial.device_build, trial.device_rays}) {
      EXPECT_GT(seconds, 0);
      EXPECT_LT(seconds, 100);
    }
  }
  EXPECT_EQ(result.tuning.min_device_build_triangles, tune::choose_min_triangles(result.builds));
  std::set<std::string> keys;
  for (const tune::GroupTrial& trial : result.groups) {
    keys.insert(trial.key);
    ASSERT_EQ(trial.sizes.size(), trial.seconds.size());
    EXPECT_GE(trial.sizes.size(), 4U);
    EXPECT_EQ(trial.sizes.front(), 0U);
    for (const double seconds : trial.seconds) EXPECT_GT(seconds, 0);
    EXPECT_EQ(trial.best, tune::choose_group(trial));
    EXPECT_EQ(result.tuning.*trial.member, trial.best) << trial.key;
  }
  keys.erase("raster_group");  // of GPUs only
  EXPECT_EQ(keys,
            (std::set<std::string>{"ray_group", "closest_group", "occlusion_group", "view_group"}));
  EXPECT_EQ(result.groups.size(), families);
}

TEST(Tune, RestoresTheTuningIfItIsCancelled) {
  KILN_REQUIRE_DEVICE();
  const Device device = Device::open(std::to_string(test::device()->info().index));
  cl::Context& context = context_of(device);
  Tuning before;
  before.view_group = 8;
  context.set_tuning(before);
  int stages = 0;
  EXPECT_THROW(tune::measure(context, 1000,
                             [&](std::string_view) {
                               if (++stages == 3) throw Error(ErrorCode::cancelled, "Cancelled.");
                             }),
               Error);
  EXPECT_EQ(context.tuning(), before);
}

}  // namespace
}  // namespace kiln::test
