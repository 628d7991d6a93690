// Plans of faces, texels and match together: the error asked for, by few bytes.
#include "kiln/light_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kiln/kiln.h"
#include "lowpoly/simplify_levels.h"
#include "measure/light_model.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

LightPlanOptions light_options(double max_error, std::uint32_t size = 512) {
  LightPlanOptions options;
  options.max_error = max_error;
  options.bake.width = options.bake.height = size;
  return options;
}

/// Of rendered normals, by pictures that are drawn. Null map: the mesh's own normals.
double by_pictures(const Mesh& high, const Mesh& low, const Image* map) {
  std::vector<ViewAngles> views;
  for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
    views.push_back(view_angles(toward));
  }
  const NormalReference reference(Scene(*test::device(), high), high, views, 96);
  return reference
      .compare(map != nullptr ? Scene(*test::device(), low, {map}) : Scene(*test::device(), low))
      .mean_degrees;
}

TEST(LightPlan, ReachesTheErrorWithFewerBytesThanAGridFinds) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(8000, true);
  const Source source(*test::device(), high);
  const double wanted = 5;
  const LightBake light = bake_light(source, high, light_options(wanted));
  ASSERT_TRUE(light.reached);
  ASSERT_TRUE(light.result.has_value());
  EXPECT_EQ(light.wanted, wanted);
  EXPECT_LE(light.chosen.measured, wanted);
  EXPECT_EQ(light.low.triangles.size(), light.chosen.faces);
  EXPECT_EQ(light.chosen.vertices, split_vertices(light.low));
  const BakedMap& map = light.result->maps.front();
  EXPECT_EQ(map.image.width, light.chosen.size);
  EXPECT_EQ(map.image.height, light.chosen.size);
  const double seen = by_pictures(high, light.low, &map.image);
  EXPECT_NEAR(seen, light.chosen.measured, 0.04 * wanted);

  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint32_t size : {32U, 64U, 128U}) {
    for (std::uint32_t faces = 1200; faces >= 100; faces = faces * 3 / 4) {
      const Mesh low =
          unwrap(simplify(high, {.faces = faces}), {.method = UnwrapMethod::charts, .size = size});
      const LightBytes bytes =
          light_bytes(split_vertices(low), low.triangles.size(), size, {3}, light.chosen.bits);
      if (bytes.total() >= light.chosen.bytes.total()) continue;
      BakeOptions bake = light.bake;
      bake.width = bake.height = size;
      const BakeResult result = kiln::bake(source, low, bake);
      if (by_pictures(high, low, &result.maps.front().image) >
          seen * wanted / light.chosen.measured) {
        break;  // and so will fewer faces
      }
      least = std::min(least, bytes.total());
    }
  }
  EXPECT_LE(static_cast<double>(light.chosen.bytes.total()), 1.1 * static_cast<double>(least));
}

TEST(LightPlan, SaysWhatItTriedAndExpected) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  const LightBake light = bake_light(source, high, light_options(8));
  ASSERT_FALSE(light.trials.empty());
  EXPECT_TRUE(std::any_of(light.trials.begin(), light.trials.end(), [&](const LightTrial& trial) {
    return trial.faces == light.chosen.faces && trial.size == light.chosen.size;
  }));
  for (const LightTrial& trial : light.trials) {
    EXPECT_GE(trial.measured, 0);
    if (trial.measured <= light.wanted) EXPECT_GE(trial.bytes.total(), light.chosen.bytes.total());
  }
  EXPECT_TRUE(std::is_sorted(light.trade.begin(), light.trade.end(),
                             [](const auto& a, const auto& b) { return a.size < b.size; }));
  for (const LightTrial& row : light.trade) EXPECT_LE(row.expected, light.wanted);
  EXPECT_TRUE(std::is_sorted(light.levels.begin(), light.levels.end(),
                             [](const auto& a, const auto& b) { return a.faces < b.faces; }));
  EXPECT_GT(light.levels.front().limit, light.levels.back().limit);
  EXPECT_EQ(light.outlook.size() % light.levels.size(), 0U);
}

TEST(LightPlan, LeavesTheMapOutWhereNoneIsNeeded) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(5);
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(8);
  const LightBake without = bake_light(source, high, options);
  EXPECT_TRUE(without.reached);
  EXPECT_EQ(without.chosen.size, 0U);
  EXPECT_FALSE(without.result.has_value());
  EXPECT_EQ(without.chosen.bytes.texels, 0U);
  EXPECT_TRUE(without.low.uvs.empty());
  EXPECT_LE(by_pictures(high, without.low, nullptr), 8 * 1.04);
  options.may_leave_map_out = false;
  const LightBake with = bake_light(source, high, options);
  EXPECT_TRUE(with.result.has_value());
  EXPECT_GE(with.chosen.size, 16U);
}

TEST(LightPlan, FarAwayItNeedsLess) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::icosphere(5);
  for (Vec3& p : high.positions) {
    const float scale = 1 + 0.004F * (std::sin(60 * p.x) + std::sin(60 * p.y) + std::sin(60 * p.z));
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(4);
  const LightBake near = bake_light(source, high, options);
  options.screen = 24;
  const LightBake far = bake_light(source, high, options);
  EXPECT_TRUE(near.reached);
  EXPECT_TRUE(far.reached);
  EXPECT_LT(2 * far.chosen.bytes.total(), near.chosen.bytes.total());
}

TEST(LightPlan, ObeysWhatIsGiven) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(5);
  options.choose_match = options.choose_samples = options.may_leave_map_out = false;
  options.bits = 16;
  options.bake.method = MatchMethod::closest;
  options.bake.samples = 2;
  options.bake.maps = {MapKind::normal, MapKind::mask};
  options.bake.raw = true;
  const LightBake light = bake_light(source, high, options);
  EXPECT_EQ(light.chosen.method, MatchMethod::closest);
  EXPECT_EQ(light.chosen.samples, 2U);
  EXPECT_EQ(light.chosen.bits, 16U);
  ASSERT_TRUE(light.result.has_value());
  ASSERT_EQ(light.result->maps.size(), 2U);
  const auto& pixels = light.result->maps.front().image.pixels;
  EXPECT_LT(*std::min_element(pixels.begin(), pixels.end()), -0.1F);
  EXPECT_EQ(light.chosen.bytes.texels, light_bytes(0, 0, light.chosen.size, {3, 1}, 16).texels);
}

/// A plan of a height field is a mesh over its rectangle with its layout, whatever its size and place.
TEST(LightPlan, OfHeightFieldsKeepTheirLayout) {
  KILN_REQUIRE_DEVICE();
  Image heights;
  heights.width = heights.height = 97;
  heights.channels = 1;
  for (std::uint32_t i = 0; i < 97 * 97; ++i) {
    const float x = static_cast<float>(i % 97) / 96, y = static_cast<float>(i / 97) / 96;
    heights.pixels.push_back(0.5F + 0.2F * std::sin(5 * x) * std::cos(4 * y) +
                             0.004F * std::sin(90 * x) * std::sin(80 * y));
  }
  const HeightFieldOptions extent{300, 200, 60};
  const Mesh high = height_field_mesh(heights, extent);
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(4);
  options.height_field = true;
  options.may_leave_map_out = false;
  for (const bool choose : {true, false}) {
    options.choose_match = choose;
    options.bake.method = choose ? MatchMethod::ray : MatchMethod::uv;
    const LightBake light = bake_light(source, high, options);
    EXPECT_TRUE(light.reached);
    EXPECT_LT(light.low.triangles.size(), high.triangles.size() / 8);
    ASSERT_TRUE(light.result.has_value());
    Mesh laid_out = light.low;
    lay_out_over_height_field(laid_out, heights, extent);
    ASSERT_EQ(light.low.uvs.size(), laid_out.uvs.size());
    std::size_t corners = 0;
    for (std::size_t v = 0; v < laid_out.uvs.size(); ++v) {
      const Vec2 &uv = light.low.uvs[v], &wanted = laid_out.uvs[v];
      EXPECT_NEAR(uv.x, wanted.x, 1e-6);
      EXPECT_NEAR(uv.y, wanted.y, 1e-6);
      corners += (uv.x == 0 || uv.x == 1) && (uv.y == 0 || uv.y == 1) ? 1 : 0;
    }
    EXPECT_EQ(corners, 4U);
    EXPECT_EQ(light.result->report.texels, std::uint64_t{light.chosen.size} * light.chosen.size);
  }
  Mesh upright = high;
  for (Vec3& p : upright.positions) p.y = 0;
  EXPECT_THROW(bake_light(Source(*test::device(), upright), upright, options), Error);
}

TEST(LightPlan, SaysWhereTheErrorIsOutOfReach) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Source source(*test::device(), high);
  const LightBake light = bake_light(source, high, light_options(0.01, 32));
  EXPECT_FALSE(light.reached);
  EXPECT_GT(light.chosen.measured, 0.01);
  EXPECT_TRUE(light.trade.empty());
}

TEST(LightPlan, RefusesAndCancels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Source source(*test::device(), high);
  const auto refuses = [&](const auto& change) {
    LightPlanOptions options = light_options(5);
    change(options);
    EXPECT_THROW(bake_light(source, high, options), Error);
  };
  refuses([](LightPlanOptions& o) { o.max_error = 0; });
  refuses([](LightPlanOptions& o) { o.max_error = std::nan(""); });
  refuses([](LightPlanOptions& o) { o.screen = 15; });
  refuses([](LightPlanOptions& o) { o.bits = 9; });
  refuses([](LightPlanOptions& o) { o.bake.width = 8; });
  refuses([](LightPlanOptions& o) { o.bake.maps = {MapKind::mask}; });
  refuses([](LightPlanOptions& o) { o.bake.method = MatchMethod::uv; });
  refuses([&](LightPlanOptions& o) { o.bake.cage_mesh = &high; });
  LightPlanOptions options = light_options(5);
  options.bake.progress = [](double, std::string_view) { return false; };
  EXPECT_TRUE(bake_light(source, high, options).cancelled);
}

TEST(LightPlan, CountsBytes) {
  // 100 vertices of 24 bytes, 180 triangles of 6; 16 x 16 texels and a third.
  const LightBytes bytes = light_bytes(100, 180, 16, {3}, 8);
  EXPECT_EQ(bytes.vertices, 2400U + 1080U);
  EXPECT_EQ(bytes.texels, 342U);
  EXPECT_EQ(bytes.total(), bytes.vertices + bytes.texels);
  EXPECT_EQ(light_bytes(100, 180, 0, {3}, 8).total(), 1600U + 1080U);
  EXPECT_EQ(light_bytes(65537, 1, 0, {}, 8).total(), 65537U * 16 + 12);
  EXPECT_EQ(light_bytes(0, 0, 16, {1}, 8).texels, 171U);
  EXPECT_EQ(light_bytes(0, 0, 16, {3}, 16).texels, 1366U);
  Mesh mesh = test::cube();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  EXPECT_EQ(split_vertices(mesh), mesh.positions.size());
  const Mesh laid_out = unwrap(mesh, {.size = 64});
  EXPECT_GT(split_vertices(laid_out), mesh.positions.size());
}

TEST(SimplifyLevels, AreWhatSimplifyMakes) {
  const Mesh high = test::BumpySphere::dense(6000);
  const std::vector<std::uint32_t> faces = {2000, 700, 240};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_EQ(levels.count(), 3U);
  for (const std::size_t i : {2U, 0U, 1U}) {
    SimplifyReport report, direct_report;
    const Mesh level = levels.mesh(i, &report);
    const Mesh direct = simplify(high, {.faces = faces[i]}, &direct_report);
    EXPECT_EQ(level.positions, direct.positions);
    EXPECT_EQ(level.triangles, direct.triangles);
    EXPECT_EQ(level.normals, direct.normals);
    EXPECT_EQ(levels.faces(i), direct.triangles.size());
    EXPECT_EQ(levels.vertices(i), direct.positions.size());
    EXPECT_EQ(report.faces, direct_report.faces);
    EXPECT_EQ(report.error, direct_report.error);
    EXPECT_EQ(report.warnings.size(), direct_report.warnings.size());
  }
}

TEST(SimplifyLevels, EndWhereTheShapeNeedsItsFaces) {
  const std::vector<std::uint32_t> faces = {8, 6, 4, 3, 2};
  const Mesh high = test::icosphere(1);
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_GE(levels.count(), 1U);
  for (std::size_t i = 1; i < levels.count(); ++i) EXPECT_LT(levels.faces(i), levels.faces(i - 1));
  EXPECT_GE(levels.faces(levels.count() - 1), 4U);
}

/// Levels of 4% fewer faces each, whose errors follow powers.
struct Powers {
  std::vector<double> faces;
  int looks = 0;
  LightModel::Node look(std::size_t level) {
    ++looks;
    return {200 / std::sqrt(faces[level]), 900 / faces[level]};
  }
  LightModel model() {
    faces.clear();
    for (double f = 20000; f > 12; f *= 0.96) faces.push_back(std::floor(f));
    return LightModel(faces, [this](std::size_t level) { return look(level); });
  }
};

TEST(LightModel, FollowsPowersAndLooksSeldom) {
  Powers powers;
  LightModel model = powers.model();
  const auto level = model.fewest([&](std::size_t i) { return model.at(i).limit; });
  ASSERT_TRUE(level.has_value());
  EXPECT_NEAR(powers.faces[*level], 900, 40);
  EXPECT_LT(powers.looks, 6);
  EXPECT_FALSE(model.fewest([](std::size_t) { return 2.0; }).has_value());
  EXPECT_EQ(model.fewest([](std::size_t) { return 1.0; }), powers.faces.size() - 1);
}

TEST(LightModel, GuessesWithoutALook) {
  Powers powers;
  LightModel model = powers.model();
  model.exactly(34);
  model.exactly(51);
  const int looks = powers.looks;
  // Along the line between what is known, and beyond it to both sides.
  for (const std::size_t level : {0U, 20U, 34U, 40U, 51U, 80U}) {
    const LightModel::Node truth{200 / std::sqrt(powers.faces[level]), 900 / powers.faces[level]};
    EXPECT_NEAR(model.guess(level).plain, truth.plain, 0.01 * truth.plain) << level;
    EXPECT_NEAR(model.guess(level).limit, truth.limit, 0.01 * truth.limit) << level;
    EXPECT_EQ(model.guessed(level, 0), model.guess(level).plain) << level;
  }
  EXPECT_EQ(powers.looks, looks);
  // A level that is known is not looked at again, nor are those beside it.
  model.at(34);
  model.at(51);
  EXPECT_EQ(powers.looks, looks);
  model.at(85);  // A level where looks begin: itself alone.
  EXPECT_EQ(powers.looks, looks + 1);
}

TEST(LightModel, LearnsFromMaps) {
  Powers powers;
  LightModel model = powers.model();
  const std::size_t level = 50;
  const LightModel::Node node = model.exactly(level);
  // A mip-map's figure gives way to that of a map of its own.
  model.measured(level, 64, node.limit + 3, /*mip=*/true);
  model.measured(level, 128, node.limit + 1);
  EXPECT_GT(model.expected(level, 64), node.limit + 3) << "charts of a small map are farther apart";
  EXPECT_LT(model.expected(level, 64), node.limit + 4);
  model.measured(level, 64, node.limit + 2);
  EXPECT_NEAR(model.expected(level, 64), node.limit + 2, 0.01 * node.limit + 1e-6);
  EXPECT_NEAR(model.expected(level, 128), node.limit + 1, 0.01 * node.limit + 1e-6);
  EXPECT_EQ(model.expected(level, 0), node.plain);
  EXPECT_LT(model.expected(level, 256), model.expected(level, 128));
  EXPECT_GT(model.expected(level, 256), node.limit);
  EXPECT_GT(model.expected(level, 32), model.expected(level, 64));
  EXPECT_LE(model.expected(level, 16), node.plain);
  // Two maps of a size tell how faces count: here, more of them leave each texel with more surface.
  LightModel two = powers.model();
  two.measured(level, 64, two.exactly(level).limit + 1);
  const std::size_t finer = level - 17, finest = level - 34;
  two.measured(finer, 64, two.exactly(finer).limit + 1.2);
  EXPECT_NEAR(two.expected(finer, 64), two.exactly(finer).limit + 1.2, 1e-6);
  LightModel one = powers.model();
  one.measured(finer, 64, one.exactly(finer).limit + 1.2);
  EXPECT_GT(two.expected(finest, 64), 1.05 * one.expected(finest, 64));
}

/// Cubes on a grid, far from each other.
Mesh far_cubes(int a_side, float apart) {
  Mesh cube = test::cube();
  Mesh mesh;
  mesh.name = "cubes";
  for (int i = 0; i < a_side * a_side; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const float x = apart * static_cast<float>(i % a_side);
    const float y = apart * static_cast<float>(i / a_side);
    for (const Vec3& p : cube.positions) mesh.positions.push_back({p.x + x, p.y + y, p.z});
    for (const Triangle& t : cube.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return mesh;
}

TEST(LightPlan, UsesMoreThanHalfOfTheFacesWhereNothingElseDoes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = far_cubes(6, 2);
  const LightBake light = bake_light(Source(*test::device(), high), high, light_options(0.5, 64));
  EXPECT_TRUE(light.reached);
  EXPECT_EQ(light.chosen.size, 0U);
  EXPECT_EQ(light.low.triangles.size(), high.triangles.size());
}

TEST(LightPlan, WhatIsSmallerThanAPixelIsNotSaidToBeReached) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = far_cubes(4, 200);
  LightPlanOptions options = light_options(5, 64);
  options.screen = 32;
  const LightBake light = bake_light(Source(*test::device(), high), high, options);
  EXPECT_FALSE(light.reached);
  EXPECT_EQ(light.chosen.measured, 180);
}

}  // namespace
}  // namespace kiln
