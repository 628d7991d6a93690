// Errors that plans expect of maps that were not made.
#include "plan/error_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "plan/level_evaluator.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr LevelErrors kLevel = {12, 2, 0};
constexpr double kFaces = 1000;

TEST(ErrorModel, GoesThroughWhatWasMeasured) {
  ErrorModel model;
  EXPECT_NEAR(model.expected(kFaces, kLevel, 64), 12, 1e-9) << "nothing is known of any map";
  for (const auto& [size, error] : {std::pair{32U, 9.0}, {64U, 6.0}, {128U, 3.5}}) {
    model.add_measurement(kFaces, kLevel, size, error, true);
    EXPECT_NEAR(model.expected(kFaces, kLevel, size), error, 1e-9);
  }
}

TEST(ErrorModel, FallsWithTheSizeAndStaysWithinItsBounds) {
  ErrorModel model;
  model.add_measurement(kFaces, kLevel, 32, 9, false);
  model.add_measurement(kFaces, kLevel, 64, 6, false);
  double last = 12;
  for (std::uint32_t size = 32; size <= 16384; size *= 2) {
    const double error = model.expected(kFaces, kLevel, size);
    EXPECT_LT(error, last) << size;
    EXPECT_GT(error, kLevel.infinite_map) << size;
    last = error;
  }
  // Beyond what is known sharpness grows with the size at least, with its square at most.
  const auto sharpness = [&](std::uint32_t size) {
    return 1 / (model.expected(kFaces, kLevel, size) - kLevel.infinite_map) - 0.1;
  };
  EXPECT_GE(sharpness(256), 4 * sharpness(64) * (1 - 1e-9));
  EXPECT_LE(sharpness(256), 16 * sharpness(64) * (1 + 1e-9));
}

/// Beyond the largest size sharpness goes on along the last two, but no slower than the size, no faster than its square.
TEST(ErrorModel, GoesOnWithTheLastTwoSizes) {
  const auto error_at = [](double sharpness) {
    return kLevel.infinite_map + 1 / (sharpness + 0.1);  // 10 degrees of detail
  };
  const auto sharpness = [](const ErrorModel& model, std::uint32_t size) {
    return 1 / (model.expected(kFaces, kLevel, size) - kLevel.infinite_map) - 0.1;
  };
  ErrorModel one;
  one.add_measurement(kFaces, kLevel, 64, error_at(0.2), true);
  EXPECT_NEAR(sharpness(one, 256), 4 * 0.2, 1e-9) << "of one size, with the size itself";
  for (const auto& [slope, used] :
       {std::pair(0.3, 1.0), {1.0, 1.0}, {1.4, 1.4}, {2.0, 2.0}, {2.7, 2.0}}) {
    ErrorModel two;
    two.add_measurement(kFaces, kLevel, 32, error_at(0.2 * std::pow(0.5, slope)), true);
    two.add_measurement(kFaces, kLevel, 64, error_at(0.2), true);
    EXPECT_NEAR(sharpness(two, 256), 0.2 * std::pow(4, used), 1e-9) << slope;
  }
}

TEST(ErrorModel, TakesMapsOfTheirOwnSizeBeforeMipMaps) {
  ErrorModel model;
  model.add_measurement(kFaces, kLevel, 64, 6, false);
  model.add_measurement(2 * kFaces, kLevel, 64, 7, true);
  EXPECT_NEAR(model.expected(2 * kFaces, kLevel, 64), 7, 1e-9);
  model.add_measurement(2 * kFaces, kLevel, 64, 6, false);
  EXPECT_NEAR(model.expected(2 * kFaces, kLevel, 64), 7, 1e-9);
}

/// Sharpness follows from the nearest number of faces that is known, and falls slower than with the faces' cube root.
TEST(ErrorModel, FinerMeshesTakeMoreTexels) {
  ErrorModel model;
  model.add_measurement(kFaces, kLevel, 64, 6, true);
  model.add_measurement(100 * kFaces, kLevel, 64, 7, true);
  const auto sharpness = [](double error) { return 1 / (error - kLevel.infinite_map) - 0.1; };
  const auto expected = [&](double faces) { return sharpness(model.expected(faces, kLevel, 64)); };
  const auto expect_between = [&](double faces, double least, double most) {
    EXPECT_GT(expected(faces), least) << faces;
    EXPECT_LT(expected(faces), most) << faces;
  };
  expect_between(kFaces / 8, sharpness(6), 2 * sharpness(6));
  expect_between(8 * kFaces, sharpness(6) / 2, sharpness(6));
  expect_between(12.5 * kFaces, sharpness(7), 2 * sharpness(7));
  EXPECT_NEAR(expected(100 * kFaces), sharpness(7), 1e-9);
}

/// Errors are what they are, also where they make no sense.
TEST(ErrorModel, StaysFinite) {
  for (const LevelErrors& level :
       {LevelErrors{0, 0, 0}, LevelErrors{1, 3, 0}, LevelErrors{180, 180, 0}}) {
    for (const double error : {0.0, 1.0, 200.0}) {
      ErrorModel model;
      model.add_measurement(kFaces, level, 64, error, true);
      for (const std::uint32_t size : {16U, 64U, 4096U}) {
        EXPECT_TRUE(std::isfinite(model.expected(kFaces, level, size)));
      }
    }
  }
}

TEST(LevelEvaluator, TellsOfLevelsNearThoseThatAreKnown) {
  const Mesh high = test::BumpySphere::dense(6000);
  const Source source(*test::device(), high);
  const LowPolyPlanOptions options;
  BakeOptions bake;
  LowPolyPlan plan;
  LevelCache cache;
  LevelEvaluator evaluator(source, high, options, bake, plan, cache);
  constexpr std::size_t kStep = plan_settings::kNodeStep;
  const auto error = [&](std::size_t level) { return evaluator.at(level, false).without_map; };
  const double coarse = error(3 * kStep), fine = error(2 * kStep);
  ASSERT_LT(fine, coarse);
  // Of finer ones up to half a step, along the line.
  const double share = std::log(evaluator.faces(2 * kStep - 8) / evaluator.faces(3 * kStep)) /
                       std::log(evaluator.faces(2 * kStep) / evaluator.faces(3 * kStep));
  EXPECT_NEAR(error(2 * kStep - 8), coarse * std::pow(fine / coarse, share), 1e-9);
  EXPECT_EQ(evaluator.evaluated_levels(false), (std::vector<std::size_t>{2 * kStep, 3 * kStep}));
  // What was made corrects what is rough.
  evaluator.record_measured(3 * kStep, false, {coarse / 2, 0, 0});
  EXPECT_EQ(error(3 * kStep), coarse / 2);
  EXPECT_NEAR(error(2 * kStep), fine / 2, 1e-9);
  evaluator.record_measured(2 * kStep, false, {fine / 4, 0, 0});
  EXPECT_NEAR(error(2 * kStep - 8), coarse * std::pow(fine / coarse, share) / 4, 1e-9);
  EXPECT_EQ(error(3 * kStep), coarse / 2);
  // Errors with a map and without are corrected each by itself.
  const LevelErrors mapped = evaluator.at(3 * kStep, true);
  EXPECT_GT(mapped.silhouette_mismatch, 0);
  evaluator.record_measured(3 * kStep, true,
                            {0.9 * mapped.without_map, 0.5 * mapped.infinite_map, 0});
  EXPECT_NEAR(evaluator.at(3 * kStep, true).without_map, 0.9 * mapped.without_map, 1e-9);
  EXPECT_NEAR(evaluator.at(3 * kStep, true).infinite_map, 0.5 * mapped.infinite_map, 1e-9);
}

TEST(Coarsest, IsTheLastThatDoesAndAsksFew) {
  for (std::size_t begin : {0U, 5U, 40U}) {
    for (std::size_t end : {5U, 41U, 200U}) {
      for (std::size_t last = begin; last <= std::max(begin, end); ++last) {
        int asked = 0;
        const auto found = coarsest_level(begin, end, [&](std::size_t level) {
          EXPECT_GE(level, begin);
          EXPECT_LT(level, end);
          ++asked;
          return level < last;
        });
        if (last == begin || end <= begin) {
          EXPECT_FALSE(found.has_value());
        } else {
          EXPECT_EQ(found, last - 1);
        }
        EXPECT_LE(asked, 13);  // log of 200 by halves is 8, by thirds 13.
      }
    }
  }
}

}  // namespace
}  // namespace kiln
