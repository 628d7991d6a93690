// Plans within a number of bytes: what trials say of themselves, and parts that may not be lost.
#include "plan/byte_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/plan.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::uint64_t mesh_bytes(const Mesh& low) {
  return 600 + 48 * split_vertices(low) + 6 * low.triangles.size();
}

BytePlanOptions options_of(std::uint64_t max_bytes, std::uint32_t size = 128) {
  BytePlanOptions options;
  options.plan.bake.width = options.plan.bake.height = size;
  options.plan.may_leave_map_out = false;
  options.max_bytes = max_bytes;
  options.pictures.any_format = false;
  options.maps_of = [](std::vector<BakedMap>& maps, std::span<const std::uint8_t>) {
    AssetMaps pictures;
    pictures.normal = &maps.front().image;
    return pictures;
  };
  options.mesh_bytes = mesh_bytes;
  return options;
}

/// A ball with spikes, which few faces cut off. \param height  of ripples between them, which take texels
Mesh spiky_ball(double height) {
  Mesh mesh = test::icosphere(height > 0 ? 6 : 5);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) {
    const double wave = std::sin(7 * p.x) * std::sin(7 * p.y) * std::sin(7 * p.z);
    const double ripple = height * std::sin(40 * p.x) * std::sin(40 * p.y) * std::sin(40 * p.z);
    const auto scale = static_cast<float>(1 + ripple + 0.9 * std::pow(std::max(wave, 0.0), 3));
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  return mesh;
}

TEST(BytePlan, TrialsSayWhatTheyAre) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  for (const std::uint64_t most : {12000U, 40000U}) {
    const BytePlan planned = plan_within_bytes(source, high, options_of(most));
    ASSERT_LT(planned.chosen, planned.trials.size());
    for (const ByteTrial& trial : planned.trials) {
      EXPECT_EQ(trial.fits, trial.bytes <= most);
      if (!trial.fits) continue;
      std::uint64_t pictures = 0;
      for (const TrialPicture& picture : trial.pictures) pictures += picture.bytes;
      EXPECT_EQ(trial.bytes, trial.mesh_bytes + pictures);
      ASSERT_EQ(trial.pictures.size(), 1U);
      EXPECT_EQ(trial.error, trial.pictures[0].error.steps);
      EXPECT_EQ(trial.degrees, trial.pictures[0].error.degrees);
      EXPECT_LE(trial.pictures[0].width, trial.baked);
      EXPECT_LE(planned.trials[planned.chosen].error, trial.error);
    }
    const ByteTrial& chosen = planned.trials[planned.chosen];
    EXPECT_TRUE(chosen.fits);
    EXPECT_EQ(planned.plan.low.triangles.size(), chosen.faces);
    EXPECT_EQ(planned.plan.chosen.faces, chosen.faces);
    EXPECT_EQ(mesh_bytes(planned.plan.low), chosen.mesh_bytes);
    EXPECT_EQ(planned.plan.chosen.vertices, split_vertices(planned.plan.low));
    ASSERT_TRUE(planned.plan.result.has_value());
    EXPECT_EQ(planned.plan.result->maps.front().image.width, chosen.baked);
    EXPECT_EQ(planned.plan.chosen.measured, chosen.degrees);
  }
}

/// A low poly that has lost a part of the outline ranks behind each that has not, however near its normals are.
TEST(BytePlan, LostPartsOutweighNormals) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = spiky_ball(0.01);
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(14000);
  const BytePlan any = plan_within_bytes(source, high, options);
  options.plan.max_outline = 0.9 * any.plan.chosen.silhouette_mismatch;
  const BytePlan bounded = plan_within_bytes(source, high, options);
  EXPECT_LE(bounded.plan.chosen.silhouette_mismatch, options.plan.max_outline);
  EXPECT_TRUE(bounded.plan.reached);
  EXPECT_GT(bounded.plan.chosen.faces, any.plan.chosen.faces);
  EXPECT_LE(bounded.trials[bounded.chosen].bytes, options.max_bytes);
}

/// Where the first low poly has lost more than allowed, and each that is predicted has, the plan goes on all the same.
TEST(BytePlan, GoesOnWhereAllHaveLostParts) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = spiky_ball(0);
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(14000);
  const BytePlan any = plan_within_bytes(source, high, options);
  options.plan.max_outline = 0.8 * any.plan.chosen.silhouette_mismatch;
  const BytePlan bounded = plan_within_bytes(source, high, options);
  EXPECT_LE(bounded.trials[bounded.chosen].error, 1.02 * any.trials[any.chosen].error);
}

/// Pictures of two maps: each is in the file once. Too few bytes are refused with the least that are enough.
TEST(BytePlan, SaysHowFewBytesAreEnoughForAllPictures) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(3000, true);
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(1, 32);
  options.plan.bake.maps = {MapKind::normal, MapKind{"position"}};
  options.maps_of = [](std::vector<BakedMap>& maps, std::span<const std::uint8_t>) {
    AssetMaps pictures;
    pictures.normal = &maps.at(0).image;
    pictures.color = &maps.at(1).image;
    return pictures;
  };
  const auto refused = [&](std::uint64_t bytes) -> std::string {
    options.max_bytes = bytes;
    try {
      plan_within_bytes(source, high, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  const std::string text = refused(1000), before = "the smallest possible file has ";
  ASSERT_NE(text.find(before), std::string::npos) << text;
  const std::uint64_t least = std::stoull(text.substr(text.find(before) + before.size()));
  EXPECT_NE(refused(least - 1), "");
  for (const std::uint64_t bytes : {least, 3 * least}) {
    options.max_bytes = bytes;
    const BytePlan planned = plan_within_bytes(source, high, options);
    const ByteTrial& chosen = planned.trials.at(planned.chosen);
    EXPECT_TRUE(chosen.fits);
    ASSERT_EQ(chosen.pictures.size(), 2U);
    EXPECT_EQ(chosen.pictures[0].picture, PictureSlot::normal);
    EXPECT_EQ(chosen.pictures[1].picture, PictureSlot::color);
    EXPECT_EQ(chosen.bytes,
              chosen.mesh_bytes + chosen.pictures[0].bytes + chosen.pictures[1].bytes);
    if (bytes == least) EXPECT_EQ(chosen.bytes, least);
  }
}

/// A plan that is stopped says so, and never a plan that is done.
TEST(BytePlan, Cancels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(3000, true);
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(20000, 64);
  for (const int most : {0, 3}) {
    int calls = 0;
    options.plan.bake.progress = [&](double, std::string_view) { return calls++ < most; };
    EXPECT_TRUE(plan_within_bytes(source, high, options).plan.cancelled) << most;
  }
}

/// Maps halve while they halve evenly; match and samples are kept where they are given.
TEST(BytePlan, SizesHalveAndGivenOptionsStay) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(3000, true);
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(9000, 100);
  options.plan.choose_match = options.plan.choose_samples = false;
  options.plan.bake.match.method = MatchMethod::closest;
  options.plan.bake.samples = 2;
  const BytePlan planned = plan_within_bytes(source, high, options);
  EXPECT_EQ(planned.plan.chosen.method, MatchMethod::closest);
  EXPECT_EQ(planned.plan.chosen.samples, 2U);
  ASSERT_TRUE(planned.plan.result.has_value());
  EXPECT_EQ(planned.plan.result->report.closest + planned.plan.result->report.missed,
            planned.plan.result->report.samples);
  for (const ByteTrial& trial : planned.trials) {
    EXPECT_TRUE(trial.baked == 100 || trial.baked == 50 || trial.baked == 25) << trial.baked;
  }
  EXPECT_EQ(planned.plan.result->maps.front().image.width, planned.trials[planned.chosen].baked);
  // 25 does not halve: 7 bytes of a picture of 25 x 25 are too few, and no smaller size is tried.
  options.max_bytes = 900;
  EXPECT_THROW(plan_within_bytes(source, high, options), Error);
}

/// Bytes and numbers that the chosen trial states are those of the result, with the colours of its vertices.
TEST(BytePlan, TheChosenTrialIsTheResult) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(4000, true);
  for (std::size_t i = 0; i < high.positions.size(); ++i) {
    high.colors.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i * 7),
                           static_cast<std::uint8_t>(255 - i), 255});
  }
  const Source source(*test::device(), high);
  BytePlanOptions options = options_of(14000, 64);
  bool has_seen_colors = false;
  options.mesh_bytes = [&](const Mesh& low) {
    has_seen_colors = has_seen_colors || !low.colors.empty();
    return mesh_bytes(low) + (low.colors.empty() ? 0 : 4 * low.positions.size());
  };
  const BytePlan planned = plan_within_bytes(source, high, options);
  EXPECT_TRUE(has_seen_colors);
  const ByteTrial& chosen = planned.trials.at(planned.chosen);
  EXPECT_EQ(planned.plan.low.colors.size(), planned.plan.low.positions.size());
  EXPECT_EQ(chosen.mesh_bytes, options.mesh_bytes(planned.plan.low));
  EXPECT_EQ(chosen.faces, planned.plan.low.triangles.size());
  EXPECT_EQ(planned.plan.chosen.faces, chosen.faces);
  EXPECT_EQ(planned.plan.chosen.positions, planned.plan.low.positions.size());
  EXPECT_EQ(planned.plan.chosen.vertices, split_vertices(planned.plan.low));
  EXPECT_EQ(planned.plan.chosen.size, chosen.baked);
  EXPECT_EQ(planned.plan.chosen.measured, chosen.degrees);
  for (const ByteTrial& trial : planned.trials) {
    if (trial.fits) EXPECT_GE(trial.error, chosen.error);
  }
}

}  // namespace
}  // namespace kiln
