// Matching by depth views: where the method fails, and what it makes of that.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "match/views_scene.h"
#include "mesh/vector.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::bake_pair;
using test::difference;
using test::expect_sound;
using test::view_options;

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

  options.match.fallback = {MatchMethod::ray};
  const BakeResult helped = bake_pair(high, low, options);
  EXPECT_EQ(helped.report.missed, 0U);
  EXPECT_EQ(helped.report.outward + helped.report.inward, inside);
  EXPECT_EQ(helped.report.viewed, alone.report.viewed);

  options.match.fallback = {MatchMethod::closest};
  const BakeResult nearest = bake_pair(high, low, options);
  expect_sound(*nearest.match, 0.1);
  EXPECT_EQ(nearest.report.missed, 0U);
  EXPECT_EQ(nearest.report.closest, inside);
  EXPECT_EQ(nearest.report.viewed, alone.report.viewed);
  options.match.method = MatchMethod::closest;
  options.match.fallback.clear();
  const BakeResult closest = bake_pair(high, low, options);
  EXPECT_EQ(closest.report.closest, closest.report.samples);
  for (std::size_t i = 0; i < alone.match->status.size(); ++i) {
    const std::uint8_t status = nearest.match->status[i];
    if (status == KILN_STATUS_NONE) continue;
    // Samples that views decided stay; the rest is as nearest points alone give it; all on the right wall.
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
    options.match.views.criterion = criterion;
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
  options.match.views.count = 0;
  options.match.views.directions = {{1, 0, 0.035F}};  // 2 degrees above the plane
  // A triangle is a quarter of a pixel high at 1024: what lies under a sample is seldom seen, and the point
  // that is found lies up to a pixel over the sine of the angle away. More pixels help.
  double last = 1;
  for (const std::uint32_t size : {1024U, 4096U, 8192U}) {
    options.match.views.size = size;
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
  options.match.views.size = 16;
  const BakeResult result =
      bake_pair(test::BumpySphere::dense(100000), test::BumpySphere::light(), options);
  expect_sound(*result.match, 0.3);
  EXPECT_GT(result.report.views->undersampled, 0.99);
  EXPECT_LT(result.report.missed * 10, result.report.samples);
  // The size that Kiln chooses by itself sees nearly all.
  options.match.views.size = 0;
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
  options.match.max_distance = Length::share(0.04);
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
      const Vec3d v = to_double(p);
      const Vec3d w{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
      p = to_float({w.x, c * w.y - s * w.z, s * w.y + c * w.z});
    }
    for (Vec3& n : mesh.normals) {
      const Vec3d v = to_double(n);
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

}  // namespace
}  // namespace kiln
