// Matching by depth views: against rays, one view at a time, and where the method fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "kiln/kiln.h"
#include "mesh/vector.h"
#include "shared/common.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

BakeOptions view_options(std::uint32_t size, double max_distance) {
  BakeOptions options;
  options.width = options.height = size;
  options.method = MatchMethod::views;
  options.max_distance = Length::absolute(max_distance);
  options.keep_match = true;
  options.gutter = 0;
  return options;
}

BakeResult bake_pair(const Mesh& high, const Mesh& low, const BakeOptions& options) {
  return bake(Source(*test::device(), high), low, options);
}

ImageDifference difference(const BakeResult& a, const BakeResult& b) {
  Image mask{a.maps[0].image.width, a.maps[0].image.height, 1, {}};
  for (std::size_t i = 0; i < a.coverage.size(); ++i) {
    mask.pixels.push_back(a.coverage[i] == 1 && b.coverage[i] == 1 ? 1.0F : 0.0F);
  }
  return compare_images(a.maps[0].image, b.maps[0].image, &mask);
}

/// What holds of every match: a found point lies on its triangle, within the distance.
void expect_sound(const Match& match, double max_distance) {
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    if (match.status[i] == KILN_STATUS_NONE || match.status[i] == KILN_STATUS_MISS) {
      ASSERT_EQ(match.triangle[i], KILN_NO_TRIANGLE);
      continue;
    }
    ASSERT_LT(match.triangle[i], match.source_triangles);
    ASSERT_GE(match.u[i], 0);
    ASSERT_GE(match.v[i], 0);
    ASSERT_LE(match.u[i] + match.v[i], 1.000001F);
    ASSERT_LE(std::abs(match.distance[i]), max_distance * 1.00001);
  }
}

/// Triangles of b after those of a; UVs of a in the left half of the square, those of b in the right.
Mesh together(Mesh a, const Mesh& b) {
  const auto vertices = static_cast<std::uint32_t>(a.positions.size());
  const auto uvs = static_cast<std::uint32_t>(a.uvs.size());
  a.normals.clear();
  a.normal_triangles.clear();
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + vertices, t[1] + vertices, t[2] + vertices});
  }
  for (Vec2& uv : a.uvs) uv.x *= 0.5F;
  for (const Vec2& uv : b.uvs) a.uvs.push_back({0.5F + 0.5F * uv.x, uv.y});
  for (const Triangle& t : b.uv_triangles) {
    a.uv_triangles.push_back({t[0] + uvs, t[1] + uvs, t[2] + uvs});
  }
  return a;
}

Mesh turned_inside_out(Mesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Triangle& t : mesh.uv_triangles) std::swap(t[1], t[2]);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(Views, FindWhatRaysFind) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(300000);
  const Mesh low = test::BumpySphere::light();
  const BakeOptions options = view_options(512, 0.15);
  BakeOptions rays = options;
  rays.method = MatchMethod::ray;
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
  options.method = MatchMethod::ray;
  const BakeResult rays = bake(source, low, options);
  options.method = MatchMethod::views;
  double last = 1e9;
  for (const std::uint32_t size : {64U, 128U, 256U, 512U, 1024U}) {
    options.views.size = size;
    const double error = difference(bake(source, low, options), rays).mean_angle_degrees;
    std::printf("depth views of %u^2: mean %.4f degrees to rays\n", size, error);
    EXPECT_LT(error, last);
    last = error;
  }
  // As in the paper, on the view's line: the angle decides better than the depth.
  options.views.size = 1024;
  options.views.refine = false;
  options.views.criterion = ViewCriterion::depth;
  const double by_depth = difference(bake(source, low, options), rays).mean_angle_degrees;
  options.views.criterion = ViewCriterion::angle;
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
  options.method = MatchMethod::ray;
  const BakeResult rays = bake(source, low, options);
  options.method = MatchMethod::views;
  const auto error = [&](ViewCriterion criterion, bool refine) {
    options.views.criterion = criterion;
    options.views.refine = refine;
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
    options.views.criterion = criterion;
    options.views.count = 0;
    options.views.size = 300;
    options.views.directions = {{0, 1, 0}, {1, 0.2F, 0}, {-3, 0.5F, 1}, {0, -1, 0.1F}, {0, 0, -2}};
    const BakeResult together = bake(source, low, options);
    ViewSession session(source, low, options);
    std::uint64_t decided = 0;
    for (const Vec3& direction : options.views.directions) {
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
    options.match = &match;
    EXPECT_EQ(bake(source, low, options).maps[0].image.pixels, together.maps[0].image.pixels);
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
  options.views.count = 7;
  EXPECT_EQ(bake_pair(high, test::plane(2, 2, 2, 2), options).report.views->directions.size(), 7U);
  const BakeResult round =
      bake_pair(test::BumpySphere::dense(5000), test::BumpySphere::light(), view_options(64, 0.2));
  EXPECT_FALSE(round.report.views->height_field);
  EXPECT_EQ(round.report.views->directions.size(), 12U);
}

TEST(Views, PlansNoMoreThanTheSceneNeeds) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = view_options(256, 0.15);
  options.views.automatic = true;
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
  options.views.directions = {{0, 0, 5}};
  options.views.count = 4;
  const BakeResult own =
      bake_pair(test::BumpySphere::dense(5000), test::BumpySphere::light(), options);
  EXPECT_EQ(own.report.views->directions.size(), 4U);
  EXPECT_EQ(own.report.views->directions[0], (Vec3{0, 0, 1}));
}

// ---- where it fails -----------------------------------------------------------------------------------

TEST(ViewsFailing, WhatNoViewSeesStaysUndecidedOrGoesToRays) {
  KILN_REQUIRE_DEVICE();
  // A hollow ball: the inner wall cannot be seen from outside.
  const Mesh high =
      together(test::uv_sphere(128, 64, 1), turned_inside_out(test::uv_sphere(128, 64, 0.8)));
  const Mesh low =
      together(test::uv_sphere(32, 16, 1), turned_inside_out(test::uv_sphere(32, 16, 0.8)));
  BakeOptions options = view_options(256, 0.1);
  const BakeResult alone = bake_pair(high, low, options);
  expect_sound(*alone.match, 0.1);
  const std::size_t outer = test::uv_sphere(128, 64, 1).triangles.size();
  std::uint64_t wrong = 0, undecided_outside = 0, decided_inside = 0, inside = 0;
  for (std::size_t y = 0; y < 256; ++y) {
    for (std::size_t x = 0; x < 256; ++x) {
      const std::size_t i = y * 256 + x;
      const std::uint8_t status = alone.match->status[i];
      if (status == KILN_STATUS_NONE) continue;
      const bool is_inside = x >= 128;
      const bool found = status == KILN_STATUS_VIEW;
      inside += is_inside;
      decided_inside += is_inside && found;
      undecided_outside += !is_inside && !found;
      wrong += found && (alone.match->triangle[i] >= outer) != is_inside;
    }
  }
  EXPECT_GT(inside, 10000U);
  EXPECT_EQ(decided_inside, 0U);
  EXPECT_EQ(undecided_outside, 0U);
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(alone.report.missed, inside);

  options.fallback = {MatchMethod::ray};
  const BakeResult helped = bake_pair(high, low, options);
  EXPECT_EQ(helped.report.missed, 0U);
  EXPECT_EQ(helped.report.outward + helped.report.inward, inside);
  EXPECT_EQ(helped.report.viewed, alone.report.viewed);

  options.fallback = {MatchMethod::closest};
  const BakeResult nearest = bake_pair(high, low, options);
  expect_sound(*nearest.match, 0.1);
  EXPECT_EQ(nearest.report.missed, 0U);
  EXPECT_EQ(nearest.report.closest, inside);
  EXPECT_EQ(nearest.report.viewed, alone.report.viewed);
  options.method = MatchMethod::closest;
  options.fallback.clear();
  const BakeResult closest = bake_pair(high, low, options);
  EXPECT_EQ(closest.report.closest, closest.report.samples);
  for (std::size_t i = 0; i < alone.match->status.size(); ++i) {
    const std::uint8_t status = nearest.match->status[i];
    if (status == KILN_STATUS_NONE) continue;
    // What views decided stays; the rest is what nearest points alone give; all on the right wall.
    const Match& same = status == KILN_STATUS_VIEW ? *alone.match : *closest.match;
    ASSERT_EQ(nearest.match->triangle[i], same.triangle[i]);
    ASSERT_EQ(nearest.match->distance[i], same.distance[i]);
    ASSERT_EQ(nearest.match->u[i], same.u[i]);
    ASSERT_EQ(nearest.match->triangle[i] >= outer, i % 256 >= 128);
  }
}

TEST(ViewsFailing, ThinSheetsKeepTheirSides) {
  KILN_REQUIRE_DEVICE();
  // Two sides of a sheet, nearer to each other than the search distance by far.
  const auto sheet = [](std::uint32_t cells) {
    Mesh front = test::plane(cells, cells, 1, 1);
    Mesh back = turned_inside_out(front);
    for (Vec3& p : front.positions) p.z += 0.001F;
    for (Vec3& p : back.positions) p.z -= 0.001F;
    return together(front, back);
  };
  const Mesh high = sheet(64);
  for (const ViewCriterion criterion :
       {ViewCriterion::depth, ViewCriterion::distance, ViewCriterion::angle}) {
    BakeOptions options = view_options(128, 0.05);
    options.views.criterion = criterion;
    const BakeResult result = bake_pair(high, sheet(2), options);
    EXPECT_EQ(result.report.missed, 0U);
    std::uint64_t wrong = 0;
    for (std::size_t i = 0; i < result.match->triangle.size(); ++i) {
      if (result.match->status[i] != KILN_STATUS_VIEW) continue;
      wrong += (result.match->triangle[i] >= 64U * 64 * 2) != (i % 128 >= 64);
    }
    EXPECT_EQ(wrong, 0U);
  }
}

TEST(ViewsFailing, AClosedHoleIsUndecidedNotWrong) {
  KILN_REQUIRE_DEVICE();
  // The paper's figure 6: the low poly closes the torus's hole. Nothing of the torus is within 0.1 of
  // the plate's middle.
  const Mesh high = test::torus(200, 80, 1, 0.35);
  const Mesh plate = test::plane(4, 4, 0.6, 0.6);
  const BakeResult result = bake_pair(high, plate, view_options(64, 0.1));
  EXPECT_EQ(result.report.missed, result.report.samples);
}

TEST(ViewsFailing, GrazingViewsStillFindThePoint) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(100, 100, 1, 1);
  BakeOptions options = view_options(100, 0.05);
  options.views.count = 0;
  options.views.directions = {{1, 0, 0.035F}};  // 2 degrees above the plane
  // A triangle is a quarter of a pixel high at 1024: what lies under a sample is seldom seen, and the point
  // that is found lies up to a pixel over the sine of the angle away. More pixels help.
  double last = 1;
  for (const std::uint32_t size : {1024U, 4096U, 8192U}) {
    options.views.size = size;
    const BakeResult result = bake_pair(high, test::plane(3, 3, 1, 1), options);
    EXPECT_LT(result.report.missed * 20, result.report.samples);  // beside the silhouette
    double sum = 0;
    for (const float distance : result.match->distance) sum += std::abs(distance);
    const double mean = sum / static_cast<double>(result.report.viewed);
    const double pixel = std::sqrt(2.0) / size / std::sin(0.035);
    std::printf("2 degrees above, views of %u^2: mean distance %.5f, a pixel is %.5f long\n", size,
                mean, pixel);
    EXPECT_LT(mean, pixel);
    EXPECT_LT(mean, last);
    last = mean;
  }
}

TEST(ViewsFailing, EquallyNearSurfacesGoToTheLowest) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(10, 10);
  const std::size_t half = high.triangles.size();
  high.triangles.insert(high.triangles.begin(), high.triangles.begin(), high.triangles.end());
  high.uvs.clear();
  high.uv_triangles.clear();
  high.normals.clear();
  high.normal_triangles.clear();
  const BakeResult result = bake_pair(high, test::plane(1, 1), view_options(64, 0.1));
  for (std::size_t i = 0; i < result.match->triangle.size(); ++i) {
    if (result.match->status[i] == KILN_STATUS_VIEW) {
      EXPECT_LT(result.match->triangle[i], half);
    }
  }
}

TEST(ViewsFailing, TrianglesFarSmallerThanAPixel) {
  KILN_REQUIRE_DEVICE();
  // 100,000 triangles on some 200 pixels: few triangles are seen, and those are near.
  BakeOptions options = view_options(128, 0.3);
  options.views.size = 16;
  const BakeResult result =
      bake_pair(test::BumpySphere::dense(100000), test::BumpySphere::light(), options);
  expect_sound(*result.match, 0.3);
  EXPECT_GT(result.report.views->undersampled, 0.99);
  EXPECT_LT(result.report.missed * 10, result.report.samples);
  // The size that Kiln chooses by itself sees nearly all.
  options.views.size = 0;
  const BakeResult chosen =
      bake_pair(test::BumpySphere::dense(100000), test::BumpySphere::light(), options);
  EXPECT_LT(chosen.report.views->undersampled, 0.01);
  EXPECT_LT(chosen.report.missed * 1000, chosen.report.samples);
}

TEST(ViewsFailing, ScaleAndPlaceChangeNothing) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = test::BumpySphere::light();
  BakeOptions options = view_options(128, 0.15);
  options.max_distance = Length::share(0.04);
  const BakeResult here = bake_pair(high, low, options);
  for (const double scale : {std::ldexp(1.0, -60), std::ldexp(1.0, 60)}) {
    const auto scaled = [&](Mesh mesh) {
      for (Vec3& p : mesh.positions) {
        p = {static_cast<float>(p.x * scale), static_cast<float>(p.y * scale),
             static_cast<float>(p.z * scale)};
      }
      return mesh;
    };
    const BakeResult there = bake_pair(scaled(high), scaled(low), options);
    EXPECT_TRUE(there.maps[0].image.pixels == here.maps[0].image.pixels) << scale;
  }
  const auto moved = [](Mesh mesh) {
    mesh.origin = {1e6, -1e6, 1e7};
    return mesh;
  };
  EXPECT_LT(difference(bake_pair(moved(high), moved(low), options), here).mean_angle_degrees, 0.01);
}

TEST(ViewsFailing, RotationAndOrderChangeLittle) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(60000);
  const Mesh low = test::BumpySphere::light();
  const BakeOptions options = view_options(256, 0.15);
  const BakeResult here = bake_pair(high, low, options);
  // Turned about an axis of no importance: other views see each place.
  const auto rotated = [](Mesh mesh) {
    const double c = std::cos(0.7), s = std::sin(0.7);
    for (Vec3& p : mesh.positions) {
      const Vec3d v(p);
      const Vec3d w{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
      p = to_float({w.x, c * w.y - s * w.z, s * w.y + c * w.z});
    }
    for (Vec3& n : mesh.normals) {
      const Vec3d v(n);
      const Vec3d w{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
      n = to_float({w.x, c * w.y - s * w.z, s * w.y + c * w.z});
    }
    return mesh;
  };
  const ImageDifference turned = difference(bake_pair(rotated(high), rotated(low), options), here);
  std::printf("turned: mean %.4f degrees, 99%% %.4f\n", turned.mean_angle_degrees,
              turned.p99_angle_degrees);
  EXPECT_LT(turned.mean_angle_degrees, 0.05);
  Mesh shuffled = high;
  std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), std::mt19937(3));
  const ImageDifference order = difference(bake_pair(shuffled, low, options), here);
  EXPECT_LT(order.mean_angle_degrees, 0.001);
  EXPECT_LT(order.max_angle_degrees, 1);
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

  // One that is a million times as large leaves next to nothing to see: that is said.
  for (std::size_t i = first; i < with_floor.positions.size(); ++i) {
    with_floor.positions[i].x *= 40000;
    with_floor.positions[i].z *= 40000;
  }
  const BakeResult lost = bake_pair(with_floor, low, options);
  EXPECT_TRUE(std::any_of(lost.report.warnings.begin(), lost.report.warnings.end(),
                          [](const Warning& w) { return w.code == "coarse-views"; }));
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
  expect_usage([](BakeOptions& o) { o.views.count = 513; });
  expect_usage([](BakeOptions& o) { o.views.count = 0; });
  expect_usage([](BakeOptions& o) { o.views.size = 8193; });
  expect_usage([](BakeOptions& o) { o.views.directions = {{0, 0, 0}}; });
  expect_usage([](BakeOptions& o) { o.views.directions = {{0, INFINITY, 0}}; });
}

}  // namespace
}  // namespace kiln
