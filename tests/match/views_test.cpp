// Matching by depth views: against rays, one view at a time, planned.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <span>
#include <utility>
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
#include "texel/host_correspondence.h"

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
  for (const auto& [criterion, refine] : {std::pair{ViewCriterion::depth, true},
                                          {ViewCriterion::distance, true},
                                          {ViewCriterion::distance, false},
                                          {ViewCriterion::angle, true}}) {
    BakeOptions options = view_options(200, 0.15);
    options.samples = 2;
    options.match.views.criterion = criterion;
    options.match.views.refine = refine;
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

/// Views of 32 pixels over a diameter of 2, one from above unless others are given, and samples that are matched with them.
struct ViewFromAbove {
  static constexpr std::uint32_t kSize = 34;  // one pixel of margin on each side
  static constexpr float kPixel = 1.0F / 16;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  struct Sample {
    Vec3 position, direction{0, 0, 1};
  };
  std::vector<Sample> samples;
  std::vector<Vec3d> directions = {{0, 0, 1}};
  struct Point {
    std::uint32_t triangle;
    float distance;
    Vec3d position;
  };

  void add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }

  std::vector<Point> match(const ViewQuery& query) const {
    cl::Context& context = context_of(*test::device());
    const auto count = static_cast<std::uint32_t>(samples.size());
    std::vector<float> points(std::size_t{7} * count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [p, d] = samples[i];
      const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
      for (std::size_t k = 0; k < 6; ++k) points[k * count + i] = values[k];
    }
    Rasterizer raster(context, positions, triangles);
    const DepthViews views(context, raster, directions, kSize, false, {{0, 0, 0}, 1});
    const cl::Array<float> device_points(context, std::span<const float>(points));
    const cl::Array<float> scores(context, count);
    DeviceCorrespondence found(context, count);
    found.count = count;
    DepthViews::reset(context, count, scores, found);
    views.match(device_points, count, count, query, scores, found);
    context.finish();
    const HostCorrespondence host(context, found, count);
    std::vector<Point> result;
    for (std::size_t i = 0; i < count; ++i) {
      Point point{host.triangle[i], host.distance[i], {}};
      if (point.triangle != KILN_NO_TRIANGLE) {
        const Triangle& t = triangles[point.triangle];
        const double u = host.u[i], v = host.v[i];
        point.position = to_double(positions[t[0]]) * (1 - u - v) + to_double(positions[t[1]]) * u +
                         to_double(positions[t[2]]) * v;
      }
      result.push_back(point);
    }
    return result;
  }
};

constexpr std::array kCriteria = {ViewCriterion::depth, ViewCriterion::distance,
                                  ViewCriterion::angle};

/// A square sheet at z = 0 of triangles of nine pixels, which faces up or down.
void add_sheet(ViewFromAbove& view, bool up) {
  constexpr int kCells = 5;
  const auto at = [](int i) { return 0.65F * (2.0F * static_cast<float>(i) / kCells - 1); };
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const Vec3 a{at(x), at(y), 0}, b{at(x + 1), at(y), 0}, c{at(x + 1), at(y + 1), 0},
          d{at(x), at(y + 1), 0};
      view.add(a, up ? b : c, up ? c : b);
      view.add(a, up ? c : d, up ? d : c);
    }
  }
}

// The sheet lies four pixels above or below the samples, which look at it at 45 degrees to the view: their points lie four
// pixels beside the place that the view shows there.
TEST(Views, RefinedPointsLieOnTheSamplesOwnLines) {
  KILN_REQUIRE_DEVICE();
  const float slant = std::sqrt(0.5F);
  struct Case {
    bool up;
    Vec3 view, sample;
  };
  for (const auto& [up, toward, direction] :
       {Case{true, {0, 0, 1}, {slant, 0, slant}}, Case{true, {slant, 0, slant}, {0, 0, 1}},
        Case{false, {0, 0, -1}, {0, slant, -slant}}, Case{false, {0, slant, -slant}, {0, 0, -1}}}) {
    ViewFromAbove view;
    view.directions = {to_double(toward)};
    add_sheet(view, up);
    for (int i = 0; i < 20; ++i) {
      const float x = 0.17F - 0.017F * static_cast<float>(i),
                  y = 0.2F - 0.023F * static_cast<float>(i);
      view.samples.push_back({{x, y, i % 2 == 0 ? -0.25F : 0.25F}, direction});
    }
    for (const ViewCriterion criterion : kCriteria) {
      for (const bool refine : {true, false}) {
        const auto found = view.match({.criterion = criterion, .refine = refine});
        std::size_t beside = 0;
        for (std::size_t i = 0; i < found.size(); ++i) {
          ASSERT_NE(found[i].triangle, KILN_NO_TRIANGLE);
          const Vec3d from = to_double(view.samples[i].position),
                      along = to_double(refine ? direction : toward),
                      way = along * (-from.z / along.z);
          // At a border the four pixels around may all show the other triangle.
          const double off = length(found[i].position - (from + way));
          EXPECT_LT(off, 1.5 * ViewFromAbove::kPixel) << i << refine;
          beside += off > 1e-5 ? 1 : 0;
          // Along the direction or against it
          EXPECT_NEAR(found[i].distance, std::copysign(length(way), dot(way, to_double(direction))),
                      1e-5 + off);
        }
        EXPECT_LE(beside, 2U) << refine;
      }
    }
  }
}

// The view nearest to the sample's direction shows a face there that is turned away from the direction, so that it has no
// point: the next view has.
TEST(Views, TheNextViewIsTakenWhereTheBestHasNoPoint) {
  KILN_REQUIRE_DEVICE();
  ViewFromAbove view;
  view.directions = {{0, 0, 1}, {-0.6, 0, 0.8}};
  add_sheet(view, true);
  const auto sheet = static_cast<std::uint32_t>(view.triangles.size());
  // It rises towards +x, and looks to -x and up.
  view.add({-0.06F, -0.3F, 0.2F}, {0.1F, -0.3F, 0.56F}, {0.1F, 0.3F, 0.56F});
  view.add({-0.06F, -0.3F, 0.2F}, {0.1F, 0.3F, 0.56F}, {-0.06F, 0.3F, 0.2F});
  view.samples.push_back({{0.02F, 0.03F, 0.001F}, {0.55F, 0, 0.835F}});
  for (const bool both : {true, false}) {
    if (!both) view.directions.pop_back();
    const auto found = view.match({.criterion = ViewCriterion::angle, .refine = false});
    if (both) {
      ASSERT_LT(found[0].triangle, sheet);
      EXPECT_NEAR(found[0].position.z, 0, 1e-6);
    } else {
      EXPECT_EQ(found[0].triangle, KILN_NO_TRIANGLE);
    }
  }
}

// A view that sees a sample at too flat an angle does not count.
TEST(Views, AreOfUseUpToAnAngle) {
  KILN_REQUIRE_DEVICE();
  ViewFromAbove view;
  view.add({-0.7F, -0.6F, 0}, {0.7F, -0.6F, 0}, {0, 0.8F, 0});
  for (const float cosine : {0.3F, 0.5F, 0.9F})
    view.samples.push_back({{0, 0, 0.01F}, {std::sqrt(1 - cosine * cosine), 0, cosine}});
  for (const ViewCriterion criterion : kCriteria) {
    for (const float least : {0.0F, 0.4F, 0.6F}) {
      const auto found = view.match({.criterion = criterion, .least_cosine = least});
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].triangle == KILN_NO_TRIANGLE, view.samples[i].direction.z < least)
            << least << " " << i;
      }
    }
  }
}

// A sample's own pixel shows a speck that its line passes by, and the pixels around it a sheet that the line meets, far
// below: within the distance that is the point, beyond it the speck is.
TEST(Views, TakeNothingBeyondTheDistance) {
  KILN_REQUIRE_DEVICE();
  ViewFromAbove view;
  constexpr float kPixel = ViewFromAbove::kPixel;
  view.add({-0.8F, -0.5F, -0.4F}, {0.8F, -0.5F, -0.4F}, {0, 0.8F, -0.4F});
  const float x = 0.5F * kPixel, y = 0.5F * kPixel, size = 0.1F * kPixel;
  view.add({x - size, y - size, 0.02F}, {x + size, y - size, 0.02F}, {x, y + size, 0.02F});
  view.samples.push_back({{x + 0.3F * kPixel, y, 0}});
  view.samples.push_back({{x - 0.3F * kPixel, y, 0}});
  for (const ViewCriterion criterion : kCriteria) {
    for (const float distance : {0.1F, 0.39F, 0.41F}) {
      for (const auto& point : view.match({.criterion = criterion, .max_distance = distance}))
        EXPECT_EQ(point.triangle, distance < 0.4F ? 1U : 0U) << distance;
    }
  }
}

// The border of the upper sheet runs through a pixel, beyond its centre: all samples of the pixel take the lower one, which
// the pixel shows, and those of the next pixel the upper one.
TEST(Views, TakeWhatTheirPixelShowsWhereTheirLineMeetsIt) {
  KILN_REQUIRE_DEVICE();
  constexpr float kPixel = ViewFromAbove::kPixel;
  for (const bool upper_first : {true, false}) {
    ViewFromAbove view;
    const float border = 0.6F * kPixel;
    for (const bool upper : {upper_first, !upper_first}) {
      if (upper) {
        view.add({border, -0.6F, 0.01F}, {0.6F, -0.6F, 0.01F}, {border, 0.6F, 0.01F});
      } else {
        view.add({-0.7F, -0.6F, 0}, {0.7F, -0.6F, 0}, {0, 0.8F, 0});
      }
    }
    for (const float column : {0.1F, 0.7F, 0.9F, 1.1F, 1.4F}) {
      for (const float row : {0.2F, 0.8F})
        view.samples.push_back({{column * kPixel, row * kPixel, 0.005F}});
    }
    for (const ViewCriterion criterion : kCriteria) {
      const auto found = view.match({.criterion = criterion, .max_distance = 0.1F});
      for (std::size_t i = 0; i < found.size(); ++i) {
        const bool upper = view.samples[i].position.x > kPixel;
        EXPECT_EQ(found[i].triangle, upper == upper_first ? 0U : 1U) << i << upper_first;
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
