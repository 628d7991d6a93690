// Plans of faces, texels and match together: the error asked for, by few bytes.
#include "kiln/light_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kiln/kiln.h"
#include "measure/light_looks.h"
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
  LightPlanOptions options = light_options(wanted);
  options.may_leave_map_out = false;
  const LightBake light = bake_light(source, high, options);
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
  // The first map is laid out for its first mip-map.
  ASSERT_FALSE(light.trials.empty());
  EXPECT_EQ(light.trials[0].size, 2 * light.trials[0].laid_out_for);
  for (std::size_t i = 1; i < light.trials.size(); ++i) {
    EXPECT_EQ(light.trials[i].laid_out_for, light.trials[i].size);
  }

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

/// Two bumpy spheres, one just inside the other: coarse low polys stray far.
TEST(LightPlan, SearchesAsFarAsTheLowPolyStrays) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(8000);
  const auto corners = static_cast<std::uint32_t>(high.positions.size());
  const std::size_t faces = high.triangles.size();
  for (std::uint32_t i = 0; i < corners; ++i) {
    const Vec3 p = high.positions[i];
    high.positions.push_back({0.99F * p.x, 0.99F * p.y, 0.99F * p.z});
  }
  for (std::size_t t = 0; t < faces; ++t) {
    const Triangle v = high.triangles[t];
    high.triangles.push_back({v[0] + corners, v[2] + corners, v[1] + corners});
  }
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(8, 128);
  options.may_leave_map_out = false;
  const LightBake light = bake_light(source, high, options);
  ASSERT_TRUE(light.result.has_value());
  EXPECT_GT(light.simplified.error, 0.02);
  EXPECT_LT(light.result->report.missed, light.result->report.samples / 50);
  ASSERT_TRUE(light.bake.max_distance.has_value());

  // A distance that is asked for stays.
  options.bake.max_distance = Length::share(0.03);
  const LightBake asked = bake_light(source, high, options);
  EXPECT_EQ(asked.result->report.max_distance, 0.03 * source.stats().diagonal);
}

TEST(LightPlan, SaysWhatItTriedAndExpected) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(8);
  LightBake told;
  options.on_measured = [&](const LightBake& light) { told = light; };
  const LightBake light = bake_light(source, high, options);
  ASSERT_FALSE(light.trials.empty());
  EXPECT_EQ(told.chosen.measured, light.chosen.measured);
  EXPECT_EQ(told.outlook.size(), light.outlook.size());
  EXPECT_TRUE(std::any_of(light.trials.begin(), light.trials.end(), [&](const LightTrial& trial) {
    return trial.faces == light.chosen.faces && trial.size == light.chosen.size;
  }));
  for (const LightTrial& trial : light.trials) {
    EXPECT_GE(trial.measured, 0);
    if (trial.measured <= light.wanted) EXPECT_GE(trial.bytes.total(), light.chosen.bytes.total());
  }
  EXPECT_TRUE(std::is_sorted(light.trade.begin(), light.trade.end(),
                             [](const auto& a, const auto& b) { return a.size < b.size; }));
  for (const LightTrial& row : light.trade) {
    EXPECT_LE(row.expected, light.wanted);
    EXPECT_GE(row.faces, light.levels.front().faces) << "coarser than all that was looked at";
    for (const LightTrial& trial : light.trials) {
      if (trial.size == row.size && trial.laid_out_for == row.size && trial.measured > light.wanted)
        EXPECT_GT(row.faces, trial.faces) << row.size;
    }
  }
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

/// The rounding of 8 bits is 0.16 degrees on average, and a texel of 16 bits weighs four times as much.
TEST(LightPlan, TakesSixteenBitsOnlyWhereEightAskForMoreBytes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LightPlanOptions options = light_options(0.4, 256);
  options.may_leave_map_out = false;
  const LightBake coarse = bake_light(source, high, options);
  EXPECT_EQ(coarse.chosen.bits, 8U);
  options.bits = 16;
  const LightBake more = bake_light(source, high, options);
  if (more.reached) EXPECT_TRUE(coarse.reached);
  EXPECT_LT(coarse.chosen.bytes.total(), more.chosen.bytes.total());
  options.bits = 0;
  options.max_error = 0.15;
  EXPECT_EQ(bake_light(source, high, options).chosen.bits, 16U);
}

/// A size on screen is the mesh's, from every side: a ball is as wide as that. Boxes around it are wider.
TEST(LightPlan, SizesOnScreenAreThoseOfTheMesh) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::icosphere(5));
  const auto extent = [&](const Picture& picture, const Vec3d& axis) {
    double low = 1e300, high = -1e300;
    for (const Vec3& p : impl_of(source).positions) {
      low = std::min(low, dot(Vec3d(p) - picture.middle, axis));
      high = std::max(high, dot(Vec3d(p) - picture.middle, axis));
    }
    EXPECT_NEAR(low + high, 0, 1e-5) << "in the middle";
    return high - low;
  };
  const DenseShown shown = shown_to_plans(source, 50);
  ASSERT_EQ(shown.pictures.size(), kPlanViews);
  for (const Picture& picture : shown.pictures) {
    const double wide = std::max(extent(picture, picture.right), extent(picture, picture.up));
    EXPECT_NEAR(50 * picture.footprint, wide, 1e-5);
    EXPECT_NEAR(2 * picture.half_side, wide, 1e-5);
  }
}

TEST(LightPlan, TellsHowFarOutlinesDiffer) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::icosphere(5));
  // With a size on screen and without.
  for (const std::uint32_t screen : {0U, 50U}) {
    const DenseShown shown = shown_to_plans(source, screen);
    const auto share = [&](double radius) {
      const Mesh low = with_any_uvs(test::icosphere(5, radius));
      const NormalError error = NormalProbe(impl_of(source), low, shown).without_map();
      EXPECT_GE(error.standard_error_degrees, 0);
      return error.one_sided_share;
    };
    EXPECT_EQ(share(1), 0);
    EXPECT_NEAR(share(0.9), 1 - 0.9 * 0.9, 0.01);
    EXPECT_NEAR(share(0.5), 1 - 0.5 * 0.5, 0.01);
  }
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
  LightPlanOptions options = light_options(1e-4, 32);
  options.may_leave_map_out = false;  // The high poly itself has hardly an error.
  const LightBake light = bake_light(source, high, options);
  EXPECT_FALSE(light.reached);
  EXPECT_GT(light.chosen.measured, 1e-4);
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
  EXPECT_EQ(split_vertices(mesh), 24U);  // A cube's corners have three normals.
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  EXPECT_EQ(split_vertices(mesh), mesh.positions.size());
  const Mesh laid_out = unwrap(mesh, {.size = 64});
  EXPECT_GT(split_vertices(laid_out), mesh.positions.size());
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
