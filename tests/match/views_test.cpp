// Matching by depth views: against rays, one view at a time, planned.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <span>
#include <vector>

#include "accel/depth_views.h"
#include "accel/raster.h"
#include "cl/context.h"
#include "kiln/image.h"
#include "kiln/session.h"
#include "match/views_scene.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::bake_pair;
using test::difference;
using test::expect_sound;
using test::view_options;

TEST(Views, FindWhatRaysFind) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(300000);
  const Mesh low = test::BumpySphere::light();
  const BakeOptions options = view_options(512, 0.15);
  BakeOptions rays = options;
  rays.match.method = MatchMethod::ray;
  const Source source(*test::device(), high);
  const BakeResult by_views = bake(source, low, options);
  const BakeResult by_rays = bake(source, low, rays);
  expect_sound(*by_views.match, 0.15);
  EXPECT_EQ(by_views.report.viewed + by_views.report.missed, by_views.report.samples);
  EXPECT_LT(by_views.report.missed, by_views.report.samples / 1000);
  const ImageDifference refined = difference(by_views, by_rays);
  std::uint64_t same = 0;
  for (std::size_t i = 0; i < by_views.match->triangle.size(); ++i) {
    same += by_views.match->status[i] == KILN_STATUS_VIEW &&
            by_views.match->triangle[i] == by_rays.match->triangle[i];
  }
  std::printf("bumpy sphere: mean %.4f degrees to rays, %.2f%% the same triangle\n",
              refined.mean_angle_degrees,
              100.0 * static_cast<double>(same) / static_cast<double>(by_views.report.samples));
  EXPECT_LT(refined.mean_angle_degrees, 0.02);
  EXPECT_GT(same * 100, by_views.report.samples * 98);
}

TEST(Views, ErrorFallsWithDepthResolutionAndTheBetterCriterion) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(300000);
  const Mesh low = test::BumpySphere::light();
  const Source source(*test::device(), high);
  BakeOptions options = view_options(256, 0.15);
  options.match.method = MatchMethod::ray;
  const BakeResult rays = bake(source, low, options);
  options.match.method = MatchMethod::views;
  double last = 1e9;
  for (const std::uint32_t size : {64U, 128U, 256U, 512U, 1024U}) {
    options.match.views.size = size;
    const double error = difference(bake(source, low, options), rays).mean_angle_degrees;
    std::printf("depth views of %u^2: mean %.4f degrees to rays\n", size, error);
    EXPECT_LT(error, last);
    last = error;
  }
  // As in the paper, on the view's line: the angle decides better than the depth.
  options.match.views.size = 1024;
  options.match.views.refine = false;
  options.match.views.criterion = ViewCriterion::depth;
  const double by_depth = difference(bake(source, low, options), rays).mean_angle_degrees;
  options.match.views.criterion = ViewCriterion::angle;
  const double by_angle = difference(bake(source, low, options), rays).mean_angle_degrees;
  std::printf("not refined: depth %.4f, angle %.4f degrees\n", by_depth, by_angle);
  EXPECT_LT(by_angle, by_depth);
  EXPECT_LT(last, by_angle);
}

TEST(Views, AngleDecidesBestOnTheBunny) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  const Mesh high = load_mesh(*test::shared_data("bunny_high.ply"));
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const Source source(*test::device(), high);
  BakeOptions options = view_options(512, 0.005);
  options.match.method = MatchMethod::ray;
  const BakeResult rays = bake(source, low, options);
  options.match.method = MatchMethod::views;
  const auto error = [&](ViewCriterion criterion, bool refine) {
    options.match.views.criterion = criterion;
    options.match.views.refine = refine;
    const BakeResult result = bake(source, low, options);
    EXPECT_LT(result.report.missed * 1000, result.report.samples);
    return difference(result, rays).mean_angle_degrees;
  };
  const double depth = error(ViewCriterion::depth, false);
  const double distance = error(ViewCriterion::distance, false);
  const double angle = error(ViewCriterion::angle, false);
  const double refined = error(ViewCriterion::angle, true);
  std::printf("bunny, mean degrees to rays: depth %.3f, distance %.3f, angle %.3f, refined %.4f\n",
              depth, distance, angle, refined);
  EXPECT_LT(distance, depth);
  EXPECT_LT(angle, distance);
  EXPECT_LT(refined, 0.05);
}

TEST(Views, OneByOneIsTheSameAsTogether) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(60000);
  const Mesh low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  for (const ViewCriterion criterion :
       {ViewCriterion::depth, ViewCriterion::distance, ViewCriterion::angle}) {
    BakeOptions options = view_options(200, 0.15);
    options.samples = 2;
    options.match.views.criterion = criterion;
    options.match.views.count = 0;
    options.match.views.size = 300;
    options.match.views.directions = {
        {0, 1, 0}, {1, 0.2F, 0}, {-3, 0.5F, 1}, {0, -1, 0.1F}, {0, 0, -2}};
    const BakeResult together = bake(source, low, options);
    ViewSession session(source, low, options);
    std::uint64_t decided = 0;
    for (const Vec3& direction : options.match.views.directions) {
      const ViewSession::Step step = session.add(direction);
      EXPECT_EQ(step.samples, together.report.samples);
      EXPECT_GT(step.changed, 0U);
      EXPECT_GE(step.decided, decided);
      decided = step.decided;
    }
    EXPECT_EQ(decided, together.report.viewed);
    EXPECT_EQ(session.add({0, 3, 0}).changed, 0U) << "a view that was there";
    const Match match = session.match();
    EXPECT_EQ(match.triangle, together.match->triangle);
    EXPECT_EQ(match.u, together.match->u);
    EXPECT_EQ(match.v, together.match->v);
    EXPECT_EQ(match.distance, together.match->distance);
    EXPECT_EQ(match.status, together.match->status);
    options.match.saved = &match;
    EXPECT_EQ(bake(source, low, options).maps[0].image.pixels, together.maps[0].image.pixels);
  }
}

/// A triangle's corners, around a place.
void add_triangle(std::vector<Vec3>& positions, std::vector<Triangle>& triangles, const Vec3& at,
                  float size) {
  const auto first = static_cast<std::uint32_t>(positions.size());
  positions.insert(positions.end(), {{at.x - size, at.y - size, at.z},
                                     {at.x + size, at.y - size, at.z},
                                     {at.x, at.y + size, at.z}});
  triangles.push_back({first, first + 1, first + 2});
}

// A sample's own pixel shows a speck that its line passes by, and the pixels around show two sheets that the line
// meets: what lies nearer to the viewer is its point, whichever of the pixels and triangles comes first.
TEST(Views, TakeTheNearerOfTwoSheetsThatPixelsShow) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  constexpr std::uint32_t kSize = 34;
  constexpr float kPixel =
      1.0F / 16;  // 32 pixels over a diameter of 2, and one of margin on each side
  for (const bool upper_first : {true, false}) {
    for (const float side : {-1.0F, 1.0F}) {
      std::vector<Vec3> positions;
      std::vector<Triangle> triangles;
      // Triangles stay within the views' disc: larger ones are not drawn.
      const auto add_upper = [&] {  // half of the picture, to one side of x = 0
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), {{0, -0.9F * side, 0.01F},
                                           {0.9F * side, -0.9F * side, 0.01F},
                                           {0, 0.9F * side, 0.01F}});
        triangles.push_back({first, first + 1, first + 2});
      };
      const auto add_lower = [&] { add_triangle(positions, triangles, {0, -0.05F, 0}, 0.9F); };
      const auto sheet_of = [&](bool upper) -> std::uint32_t {
        return upper == upper_first ? 0 : 1;
      };
      if (upper_first) add_upper();
      add_lower();
      if (!upper_first) add_upper();
      std::vector<float> points;
      std::vector<Vec3> samples;
      for (int row = -8; row < 8; row += 4) {
        const Vec3 centre{0.5F * side * kPixel, (static_cast<float>(row) + 0.5F) * kPixel, 0.02F};
        add_triangle(positions, triangles, centre, 0.1F * kPixel);
        // Beside the speck, towards the border between the sheets and towards either row beside it.
        for (const float down : {-0.25F, 0.25F}) {
          samples.push_back({0.25F * side * kPixel, centre.y + down * kPixel, 0.005F});
        }
      }
      const auto count = static_cast<std::uint32_t>(samples.size());
      points.resize(std::size_t{7} * count);
      for (std::size_t i = 0; i < count; ++i) {
        points[i] = samples[i].x;
        points[i + count] = samples[i].y;
        points[i + 2 * std::size_t{count}] = samples[i].z;
        points[i + 5 * std::size_t{count}] = 1;
      }
      Rasterizer raster(context, positions, triangles);
      const DepthViews view(context, raster, {{0, 0, 1}}, kSize, false, {{0, 0, 0}, 1});
      ASSERT_EQ(view.views()[0].scale, 1 / kPixel);
      const cl::Array<float> device_points(context, std::span<const float>(points));
      for (const ViewCriterion criterion :
           {ViewCriterion::depth, ViewCriterion::distance, ViewCriterion::angle}) {
        const cl::Array<float> scores(context, count);
        DeviceCorrespondence found(context, count);
        found.count = count;
        DepthViews::reset(context, count, scores, found);
        ViewQuery query;
        query.criterion = criterion;
        query.max_distance = 0.1F;
        view.match(device_points, count, count, query, scores, found);
        context.finish();
        const std::vector<std::uint32_t> triangle = found.triangle.download(context);
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_EQ(triangle[i], sheet_of(true)) << i << " of " << side << ", " << upper_first;
        }
      }
    }
  }
}

TEST(Views, HeightFieldsTakeOneView) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(200, 200, 2, 2);
  for (Vec3& p : high.positions) p.z = 0.05F * std::sin(9 * p.x) * std::cos(7 * p.y);
  high.normals.clear();
  high.normal_triangles.clear();
  const BakeResult flat = bake_pair(high, test::plane(2, 2, 2, 2), view_options(128, 0.2));
  ASSERT_TRUE(flat.report.views.has_value());
  EXPECT_TRUE(flat.report.views->height_field);
  EXPECT_EQ(flat.report.views->directions, (std::vector<Vec3>{{0, 0, 1}}));
  EXPECT_EQ(flat.report.missed, 0U);
  // Also where some of it is a cliff of 85 degrees: 1% of the low poly's area.
  Mesh peak = test::plane(60, 60, 2, 2);
  peak.positions[30 * 61 + 30].z = 0.4F;
  const BakeResult steep = bake_pair(peak, peak, view_options(64, 0.2));
  EXPECT_TRUE(steep.report.views->height_field);
  // A number that is asked for is kept, and a closed mesh is none.
  BakeOptions options = view_options(64, 0.2);
  options.match.views.count = 7;
  EXPECT_EQ(bake_pair(high, test::plane(2, 2, 2, 2), options).report.views->directions.size(), 7U);
  const BakeResult round =
      bake_pair(test::BumpySphere::dense(5000), test::BumpySphere::light(), view_options(64, 0.2));
  EXPECT_FALSE(round.report.views->height_field);
  EXPECT_EQ(round.report.views->directions.size(), 12U);
}

TEST(Views, PlansNoMoreThanTheSceneNeeds) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = view_options(256, 0.15);
  options.match.views.automatic = true;
  const BakeResult sphere =
      bake_pair(test::BumpySphere::dense(50000), test::BumpySphere::light(), options);
  const ViewReport& views = *sphere.report.views;
  ASSERT_EQ(views.coverage.size(), views.directions.size());
  EXPECT_TRUE(std::is_sorted(views.coverage.begin(), views.coverage.end()));
  EXPECT_GT(views.coverage.back(), 0.999);
  EXPECT_GE(views.directions.size(), 6U);
  EXPECT_LE(views.directions.size(), 40U);
  // A plane that is seen from one side needs one view, or a few that look at it better.
  const BakeResult flat = bake_pair(test::plane(20, 20), test::plane(1, 1), options);
  EXPECT_LE(flat.report.views->directions.size(), 3U);
  EXPECT_EQ(flat.report.missed, 0U);
  // The caller's own come first and stay; the limit holds.
  options.match.views.directions = {{0, 0, 5}};
  options.match.views.count = 4;
  const BakeResult own =
      bake_pair(test::BumpySphere::dense(5000), test::BumpySphere::light(), options);
  EXPECT_EQ(own.report.views->directions.size(), 4U);
  EXPECT_EQ(own.report.views->directions[0], (Vec3{0, 0, 1}));
}

TEST(Views, AFloorMuchLargerThanTheLightMeshTakesNoPixels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = test::BumpySphere::light(24, 12);
  Mesh with_floor = high;
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (const auto& [x, z] :
       {std::pair{-25.0F, -25.0F}, {25.0F, -25.0F}, {25.0F, 25.0F}, {-25.0F, 25.0F}}) {
    with_floor.positions.push_back({x, -2, z});
  }
  with_floor.triangles.push_back({first, first + 2, first + 1});
  with_floor.triangles.push_back({first, first + 3, first + 2});
  BakeOptions options = view_options(256, 0.1);
  const BakeResult alone = bake_pair(high, low, options);
  const BakeResult on_floor = bake_pair(with_floor, low, options);
  EXPECT_LT(on_floor.report.views->pixel, 1.5 * alone.report.views->pixel);
  EXPECT_LE(on_floor.report.missed, alone.report.missed + 100);
  EXPECT_LT(difference(alone, on_floor).mean_angle_degrees, 0.02);

  // One that is a million times as large is left out, and its vertices are named.
  for (std::size_t i = first; i < with_floor.positions.size(); ++i) {
    with_floor.positions[i].x *= 40000;
    with_floor.positions[i].z *= 40000;
  }
  const BakeResult lost = bake_pair(with_floor, low, options);
  const Source source(*test::device(), with_floor);
  EXPECT_TRUE(std::any_of(source.warnings().begin(), source.warnings().end(),
                          [](const Warning& w) { return w.code == "coarse-source"; }));
  EXPECT_LE(lost.report.missed, alone.report.missed + 100);
}

TEST(Views, SteepWallsAreNoHeightField) {
  KILN_REQUIRE_DEVICE();
  Mesh low = test::plane(8, 8);
  low.normals.clear();
  low.normal_triangles.clear();
  for (Vec3& p : low.positions) {
    if (std::abs(p.x) < 0.2F && std::abs(p.y) < 0.2F) p.z = -3;
  }
  BakeOptions options = view_options(64, 0.1);
  const BakeResult deep = bake_pair(low, low, options);
  EXPECT_FALSE(deep.report.views->height_field);
  EXPECT_EQ(deep.report.views->directions.size(), 12U);
}

TEST(Views, RefuseWhatCannotBe) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::tetrahedron());
  const Mesh low = test::plane(1, 1);
  const auto expect_usage = [&](const std::function<void(BakeOptions&)>& change) {
    BakeOptions options = view_options(16, 1);
    change(options);
    try {
      bake(source, low, options);
      FAIL() << "taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage) << error.what();
    }
  };
  expect_usage([](BakeOptions& o) { o.match.views.count = 513; });
  expect_usage([](BakeOptions& o) { o.match.views.count = 0; });
  expect_usage([](BakeOptions& o) { o.match.views.size = 8193; });
  expect_usage([](BakeOptions& o) { o.match.views.directions = {{0, 0, 0}}; });
  expect_usage([](BakeOptions& o) { o.match.views.directions = {{0, INFINITY, 0}}; });
}

}  // namespace
}  // namespace kiln
