// Ambient occlusion and bent normals by depth views: closed forms, rays, and other devices' kernels.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "detail/occlusion_scene.h"
#include "kiln/validate.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::add_disc;
using test::asking;
using test::ground;
using test::map_of;

BakeOptions by_views(std::vector<MapKind> maps, std::uint32_t side, std::uint32_t views) {
  BakeOptions options = asking(std::move(maps), side);
  options.occlusion.by = OcclusionBy::views;
  options.occlusion.views = views;
  return options;
}

/// Share of a hemisphere's cosine that a disc takes, parallel to the plane at height h and off by a.
double disc_share(double radius, double height, double off) {
  const double sum = height * height + off * off + radius * radius;
  return 0.5 *
         (1 - (sum - 2 * radius * radius) / std::sqrt(sum * sum - 4 * radius * radius * off * off));
}

/// Calls with each texel of ground(2) and its place.
template <typename Call>
void each_texel(std::uint32_t side, const Call& call) {
  for (std::size_t i = 0; i < std::size_t{side} * side; ++i) {
    const double x = 2 * ((static_cast<double>(i % side) + 0.5) / side - 0.5);
    const double y = 2 * (0.5 - (static_cast<double>(i / side) + 0.5) / side);
    call(i, x, y);
  }
}

Mesh disc_over_a_plane() {
  Mesh high = test::plane(3, 3, 6, 6);
  add_disc(high, {0, 0, 0.5F}, 0.4F, false);
  return high;
}

TEST(OcclusionViews, ADiscAboveAPlane) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), disc_over_a_plane());
  const BakeResult baked =
      bake(source, ground(2), by_views({MapKind{"ao"}, MapKind{"bent_normal"}}, 24, 512));
  ASSERT_TRUE(baked.report.occlusion.has_value());
  EXPECT_EQ(baked.report.occlusion->by, OcclusionBy::views);
  EXPECT_EQ(baked.report.occlusion->views, 512U);
  double mean = 0;
  each_texel(24, [&](std::size_t i, double x, double y) {
    const double off = std::hypot(x, y);
    const double error = map_of(baked, "ao").pixels[i] - (1 - disc_share(0.4, 0.5, off));
    // Half of the directions lie over the plane; the disc's rim passes some 50 of them.
    EXPECT_LT(std::abs(error), 0.03) << x << ' ' << y;
    mean += error / (24 * 24);
    const float* bent = &map_of(baked, "bent_normal").pixels[3 * i];
    EXPECT_GT(bent[2], 0.0F);
    if (off > 0.2 && off < 0.8) {
      EXPECT_GT(bent[0] * x + bent[1] * y, 0);
    }
  });
  EXPECT_LT(std::abs(mean), 0.004);
}

TEST(OcclusionViews, OthersFarBeyondTheHighPolyOcclude) {
  KILN_REQUIRE_DEVICE();
  // The same disc, ten times as far and as large, from another mesh: seen from the middle it takes as much.
  Mesh far;
  add_disc(far, {0, 0, 5}, 4, false);
  const Source source(*test::device(), test::plane(3, 3, 6, 6));
  BakeOptions options = by_views({MapKind{"ao"}}, 24, 512);
  options.occlusion.by_others = {&far};
  const BakeResult baked = bake(source, ground(2), options);
  each_texel(24, [&](std::size_t i, double x, double y) {
    const double open = 1 - disc_share(4, 5, std::hypot(x, y));
    EXPECT_NEAR(map_of(baked, "ao").pixels[i], open, 0.03) << x << ' ' << y;
  });
  options.occlusion.by_high = false;
  EXPECT_NEAR(map_of(bake(source, ground(2), options), "ao").pixels[12 * 24 + 12],
              1 - disc_share(4, 5, 0.06), 0.03);
}

/// A sphere with folds that darken each other.
Mesh folded() {
  Mesh mesh = test::icosphere(5);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) {
    const float scale =
        1 + 0.3F * (std::sin(10 * p.x) + std::sin(10 * p.y) + std::sin(10 * p.z)) / 3;
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  return mesh;
}

TEST(OcclusionViews, RaysSayTheSameOfACurvedSurface) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), folded());
  const Mesh low = test::BumpySphere::light(24, 12);
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, 48);
  options.encoding.space = NormalMapSpace::object;
  options.match.max_distance = Length::absolute(0.3);
  options.occlusion.rays = 2048;
  const BakeResult rays = bake(source, low, options);
  EXPECT_EQ(rays.report.occlusion->by, OcclusionBy::rays);
  options.occlusion.by = OcclusionBy::views;
  options.occlusion.views = 512;
  const BakeResult baked = bake(source, low, options);
  double squares = 0, darkness = 0, worst = 0, count = 0;
  for (std::size_t i = 0; i < rays.coverage.size(); ++i) {
    if (rays.coverage[i] != kCoverageBaked) continue;
    const double open = map_of(rays, "ao").pixels[i];
    squares += std::pow(open - map_of(baked, "ao").pixels[i], 2);
    darkness += std::pow(1 - open, 2);
    ++count;
    const float* a = &map_of(rays, "bent_normal").pixels[3 * i];
    const float* b = &map_of(baked, "bent_normal").pixels[3 * i];
    const double cosine = double{a[0]} * b[0] + double{a[1]} * b[1] + double{a[2]} * b[2];
    worst = std::max(worst, std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi);
  }
  const double rms = std::sqrt(squares / count);
  EXPECT_LT(rms, 2.5 / 255);
  EXPECT_GT(std::sqrt(darkness / count), 5 * rms) << "there is nothing to see";
  EXPECT_LT(worst, 5);
}

TEST(OcclusionViews, TraversalsAndOtherMapsChangeNoByte) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(5000, true);
  const Mesh low = test::BumpySphere::light(24, 12);
  const BakeOptions both = by_views({MapKind{"ao"}, MapKind{"bent_normal"}}, 48, 100);
  const BakeResult cpu = bake(Source(*test::device(), high, RayTraversal::cpu), low, both);
  const BakeResult gpu = bake(Source(*test::device(), high, RayTraversal::gpu), low, both);
  EXPECT_EQ(map_of(cpu, "ao").pixels, map_of(gpu, "ao").pixels);
  EXPECT_EQ(map_of(cpu, "bent_normal").pixels, map_of(gpu, "bent_normal").pixels);
  const BakeResult alone =
      bake(Source(*test::device(), high), low, by_views({MapKind{"ao"}}, 48, 100));
  EXPECT_EQ(map_of(cpu, "ao").pixels, map_of(alone, "ao").pixels);
  // Thickness is of rays, whatever gathers the light outside.
  const BakeResult thick = bake(Source(*test::device(), high), low,
                                by_views({MapKind{"thickness"}, MapKind{"ao"}}, 48, 100));
  EXPECT_EQ(map_of(cpu, "ao").pixels, map_of(thick, "ao").pixels);
  EXPECT_EQ(map_of(thick, "thickness").pixels,
            map_of(bake(Source(*test::device(), high), low, asking({MapKind{"thickness"}}, 48)),
                   "thickness")
                .pixels);
}

TEST(OcclusionViews, MissesSeeFromTheLowPoly) {
  KILN_REQUIRE_DEVICE();
  // The high poly's plane lies too far away to be found: the disc darkens the low poly's own points.
  Mesh high = disc_over_a_plane();
  for (Vec3& p : high.positions) {
    if (p.z == 0) p.z = -1;
  }
  const BakeResult baked =
      bake(Source(*test::device(), high), ground(2), by_views({MapKind{"ao"}}, 24, 256));
  EXPECT_EQ(baked.report.missed, baked.report.samples);
  each_texel(24, [&](std::size_t i, double x, double y) {
    EXPECT_NEAR(map_of(baked, "ao").pixels[i], 1 - disc_share(0.4, 0.5, std::hypot(x, y)), 0.04);
  });
}

TEST(OcclusionViews, AutomaticTakesThemForLargeMapsAndFewRays) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), disc_over_a_plane());
  const auto views = [&](std::uint32_t side, const auto& change) {
    BakeOptions options = by_views({MapKind{"ao"}}, side, 512);
    options.occlusion.by = OcclusionBy::automatic;
    options.occlusion.rays = 16;
    change(options);
    return bake(source, ground(2), options).report.occlusion->views;
  };
  const auto nothing = [](BakeOptions&) {};
  EXPECT_EQ(views(512, nothing), 32U);
  EXPECT_EQ(views(64, nothing), 0U) << "drawing would take longer";
  EXPECT_EQ(views(256, [](BakeOptions& o) { o.samples = 2; }), 32U);
  EXPECT_EQ(views(512, [](BakeOptions& o) { o.occlusion.rays = 65; }), 0U);
  EXPECT_EQ(views(512, [](BakeOptions& o) { o.occlusion.distance = Length::absolute(1); }), 0U);
  EXPECT_EQ(views(512, [](BakeOptions& o) { o.occlusion.back_faces = false; }), 0U);
  EXPECT_EQ(views(512, [](BakeOptions& o) { o.occlusion.max_error = 0.05; }), 0U);
}

TEST(OcclusionViews, WhatTheyCannotTellIsAnError) {
  const auto refused = [](const auto& change) {
    BakeOptions options = by_views({MapKind{"ao"}}, 16, 64);
    EXPECT_NO_THROW(validate(options));
    change(options);
    EXPECT_THROW(validate(options), Error);
  };
  refused([](BakeOptions& o) { o.occlusion.views = 15; });
  refused([](BakeOptions& o) { o.occlusion.views = 4097; });
  refused([](BakeOptions& o) { o.occlusion.distance = Length::share(0.1); });
  refused([](BakeOptions& o) { o.occlusion.back_faces = false; });
  refused([](BakeOptions& o) { o.occlusion.max_error = 0.01; });
  refused([](BakeOptions& o) { o.occlusion.by = static_cast<OcclusionBy>(7); });
}

}  // namespace
}  // namespace kiln
