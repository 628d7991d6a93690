// Chains of fallbacks: matches that are asked in turn.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "kiln/bake.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

BakeOptions chain_options(MatchMethod method, std::vector<MatchMethod> fallback) {
  BakeOptions options;
  options.width = options.height = 96;
  options.report.keep_match = true;
  options.match.method = method;
  options.match.fallback = std::move(fallback);
  options.match.visibility.directions = 64;
  options.match.visibility.view_size = 64;
  return options;
}

/// A plane under a roof that hides its middle from above, and a low plane that overhangs it: views from
/// above find what lies beside the roof, rays what lies under it, and nearest points, as far as they reach,
/// what lies beyond the border.
struct Overhang {
  Overhang() {
    const Mesh roof = test::plane(1, 1, 0.5, 0.5);
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (const Vec3& p : roof.positions) high.positions.push_back({p.x, p.y, p.z + 0.5F});
    for (const Triangle& t : roof.triangles) {
      high.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }
  Mesh high = positions_alone(test::plane(16, 16));
  Mesh low = test::plane(1, 1, 1.3, 1.3);

 private:
  static Mesh positions_alone(const Mesh& mesh) {
    Mesh alone;
    alone.positions = mesh.positions;
    alone.triangles = mesh.triangles;
    return alone;
  }
};

/// The surface lies 0.2 below, another one floats 0.8 above its left half; right of 2 there is the latter alone. With
/// a near distance of 0.5 the surface is found, and the other one where that is all; without, the outermost.
TEST(NearDistance, RaysLookFartherOnlyWhereNothingIsNear) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::plane(1, 1, 8, 8);
  Mesh high;
  const auto add = [&](float left, float right, float z) {
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (const float x : {left, right}) {
      for (const float y : {-4.5F, 4.5F}) high.positions.push_back({x, y, z});
    }
    high.triangles.push_back({first, first + 2, first + 1});
    high.triangles.push_back({first + 1, first + 2, first + 3});
  };
  add(-4.5F, 2, -0.2F);
  add(-4.5F, 0, 0.8F);
  add(2, 4.5F, 0.8F);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.maps = {find_map("height").kind};
  options.match.max_distance = Length::absolute(1);
  const auto heights = [&] { return bake(source, low, options).maps[0].image.pixels; };
  const std::vector<float> at_once = heights();
  options.match.near_distance = Length::absolute(0.5);
  const std::vector<float> near = heights();
  for (std::size_t i = 0; i < 256; ++i) {
    const double x = (static_cast<double>(i % 16) + 0.5) / 2 - 4;
    EXPECT_NEAR(at_once[i], x < 0 || x > 2 ? 0.8 : -0.2, 1e-5) << i;
    EXPECT_NEAR(near[i], x > 2 ? 0.8 : -0.2, 1e-5) << i;
  }
  // Not before a cage.
  options.match.cage = Length::absolute(1);
  options.match.max_distance = Length::absolute(2);
  const std::vector<float> caged = heights();
  options.match.near_distance.reset();
  EXPECT_EQ(heights(), caged);
}

TEST(Fallback, AChainAsksEachForWhatIsLeft) {
  KILN_REQUIRE_DEVICE();
  const Overhang scene;
  const Source source(*test::device(), scene.high);
  BakeOptions options = chain_options(MatchMethod::views, {});
  options.match.max_distance = Length::absolute(0.05);
  options.match.views.count = 0;
  options.match.views.directions = {{0, 0, 1}};
  const auto alone = [&](MatchMethod method) {
    BakeOptions one = options;
    one.match.method = method;
    return *bake(source, scene.low, one).match;
  };
  const std::vector<Match> each = {alone(MatchMethod::views), alone(MatchMethod::ray),
                                   alone(MatchMethod::closest)};
  options.match.fallback = {MatchMethod::ray, MatchMethod::closest};
  const BakeResult chained = bake(source, scene.low, options);
  std::vector<std::size_t> decided(each.size());
  std::size_t left = 0;
  for (std::size_t i = 0; i < chained.match->status.size(); ++i) {
    if (each[0].status[i] == std::uint8_t{KILN_STATUS_NONE}) continue;
    std::size_t by = 0;
    while (by < each.size() && each[by].status[i] == std::uint8_t{KILN_STATUS_MISS}) ++by;
    if (by == each.size()) {
      ++left;
      ASSERT_EQ(chained.match->status[i], std::uint8_t{KILN_STATUS_MISS});
      continue;
    }
    ++decided[by];
    ASSERT_EQ(chained.match->status[i], each[by].status[i]) << i;
    ASSERT_EQ(chained.match->triangle[i], each[by].triangle[i]) << i;
    ASSERT_EQ(chained.match->u[i], each[by].u[i]) << i;
    ASSERT_EQ(chained.match->v[i], each[by].v[i]) << i;
    ASSERT_EQ(chained.match->distance[i], each[by].distance[i]) << i;
  }
  // Each of the three has something to do, and something is left.
  EXPECT_GT(decided[0], 100U);
  EXPECT_GT(decided[1], 100U);
  EXPECT_GT(decided[2], 100U);
  EXPECT_GT(left, 100U);
  EXPECT_EQ(chained.report.missed, left);
}

TEST(Fallback, MatchesThatNeedTheWholeBandCanFollow) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(16, 16);
  const Mesh low = test::plane(2, 2);
  const Source source(*test::device(), high);
  BakeOptions options = chain_options(MatchMethod::visibility, {});
  options.match.max_distance = Length::share(0.1);
  const Match alone = *bake(source, low, options).match;
  options.match.method = MatchMethod{"axis"};
  options.match.views.directions = {{1, 0, 0}};  // along the plane: it meets nothing
  const BakeResult missed = bake(source, low, options);
  ASSERT_EQ(missed.report.missed, missed.report.samples);
  options.match.fallback = {MatchMethod::visibility};
  const BakeResult followed = bake(source, low, options);
  EXPECT_EQ(followed.report.missed, 0U);
  EXPECT_TRUE(followed.report.visibility.has_value());
  EXPECT_EQ(followed.match->triangle, alone.triangle);
  EXPECT_EQ(followed.match->u, alone.u);
  EXPECT_EQ(followed.match->v, alone.v);
}

TEST(Fallback, WhatCannotFollowIsAnError) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(4, 4);
  const Source source(*test::device(), plane);
  const auto message = [&](MatchMethod method, std::vector<MatchMethod> fallback) -> std::string {
    try {
      bake(source, plane, chain_options(method, std::move(fallback)));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "nothing was thrown";
  };
  EXPECT_NE(message(MatchMethod::ray, {MatchMethod::uv}).find("'uv'"), std::string::npos);
  EXPECT_NE(message(MatchMethod::ray, {MatchMethod::closest, MatchMethod::ray}).find("twice"),
            std::string::npos);
  EXPECT_NE(message(MatchMethod::ray, {MatchMethod::closest, MatchMethod::closest}).find("twice"),
            std::string::npos);
  EXPECT_NE(message(MatchMethod::ray, {MatchMethod{"nowhere"}}).find("nowhere"), std::string::npos);
}

}  // namespace
}  // namespace kiln
