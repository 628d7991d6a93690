// Occlusion that counts less with distance: closed forms, random rays, and what it does not depend on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "detail/occlusion_scene.h"
#include "kiln/session.h"
#include "reference/occlusion.h"

namespace kiln {
namespace {

using test::add_rectangle;
using test::asking;
using test::ground;
using test::map_of;

constexpr double kHeight = 0.3;

/// A floor, and a ceiling above it that looks down.
Mesh room() {
  Mesh high = test::plane(3, 3, 6, 6);
  add_rectangle(high, {-3, -3, static_cast<float>(kHeight)}, {0, 6, 0}, {6, 0, 0});
  return high;
}

BakeOptions with(OcclusionFalloff falloff, std::vector<MapKind> maps, std::uint32_t side) {
  BakeOptions options = asking(std::move(maps), side);
  options.occlusion.falloff = falloff;
  return options;
}

double darkens(OcclusionFalloff falloff, double x) {
  if (falloff == OcclusionFalloff::linear) return 1 - x;
  return falloff == OcclusionFalloff::smooth ? 1 - x * x * (3 - 2 * x) : 1;
}

/// Darkness of a floor under a ceiling that is endless, at a share `h` of the reach: the cosine-weighted mean of
/// the falloff at h / cos, over the cone where that is below 1.
double under_ceiling(OcclusionFalloff falloff, double h) {
  if (falloff == OcclusionFalloff::linear) return (1 - h) * (1 - h);
  if (falloff == OcclusionFalloff::none) return 1 - h * h;
  return 1 + 3 * h * h - 4 * h * h * h + 6 * h * h * std::log(h);
}

constexpr OcclusionFalloff kEach[] = {OcclusionFalloff::none, OcclusionFalloff::linear,
                                      OcclusionFalloff::smooth};

TEST(OcclusionFalloffs, ACeilingOverAFloor) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), room());
  for (const OcclusionFalloff falloff : kEach) {
    for (const double reach : {0.31, 0.5, 1.0}) {
      BakeOptions options = with(falloff, {MapKind{"ao"}, MapKind{"bent_normal"}}, 12);
      options.occlusion.rays = 1024;
      options.occlusion.distance = Length::absolute(reach);
      const BakeResult baked = bake(source, ground(1), options);
      const double expected = 1 - under_ceiling(falloff, kHeight / reach);
      // Random rays would err by 0.016, spread ones by a fifth of that; by the rim's alone without a falloff.
      const double most = falloff == OcclusionFalloff::none ? 2.0 / 1024 : 0.006;
      double mean = 0;
      for (const float open : map_of(baked, "ao").pixels) {
        EXPECT_NEAR(open, expected, most) << static_cast<int>(falloff) << ' ' << reach;
        mean += open / 144;
      }
      EXPECT_NEAR(mean, expected, 0.0015) << static_cast<int>(falloff) << ' ' << reach;
      // As much is open all around.
      for (std::size_t i = 0; i < map_of(baked, "bent_normal").pixels.size(); i += 3) {
        EXPECT_NEAR(map_of(baked, "bent_normal").pixels[i + 2], 1, 1e-3);
      }
    }
  }
}

/// A sphere over a plane, against random rays.
TEST(OcclusionFalloffs, RandomRaysSayTheSame) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  const Mesh sphere = test::icosphere(2, 0.4);
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (const Vec3& p : sphere.positions) high.positions.push_back({p.x, p.y, p.z + 0.45F});
  for (const Triangle& t : sphere.triangles) {
    high.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  high.normals.clear();
  high.normal_triangles.clear();
  high.uvs.clear();
  high.uv_triangles.clear();
  const Source source(*test::device(), high);
  constexpr double kReach = 0.9;
  for (const OcclusionFalloff falloff : kEach) {
    BakeOptions options = with(falloff, {MapKind{"ao"}, MapKind{"bent_normal"}}, 4);
    options.match.max_distance = Length::absolute(1e-4);
    options.occlusion.rays = 1024;
    options.occlusion.distance = Length::absolute(kReach);
    const BakeResult baked = bake(source, ground(2), options);
    double mean = 0;
    for (std::size_t i = 0; i < 16; ++i) {
      const double x = (static_cast<double>(i % 4) + 0.5) / 2 - 1;
      const double y = 1 - (static_cast<double>(i / 4) + 0.5) / 2;
      reference::HemisphereSearch search;
      search.rays = 2000;
      search.seed = i + 1;
      search.distance = kReach;
      search.darkens = [&](double share) { return darkens(falloff, share); };
      const auto view =
          reference::view_hemisphere(high.positions, high.triangles, {x, y, 0}, {0, 0, 1}, search);
      // Five deviations of 2000 random rays at worst.
      const double open = map_of(baked, "ao").pixels[i];
      EXPECT_NEAR(open, view.open, 5 * 0.5 / std::sqrt(2000)) << i;
      mean += (open - view.open) / 16;
      const double lean = std::hypot(view.lean[0], view.lean[1], view.lean[2]);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i + c], view.lean[c] / lean, 0.1) << i;
      }
    }
    EXPECT_LT(std::abs(mean), 0.012);  // less than five deviations of 16 times as many
  }
}

TEST(OcclusionFalloffs, ReachTheDiagonalWithoutADistance) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), room());
  BakeOptions options = with(OcclusionFalloff::linear, {MapKind{"ao"}}, 8);
  options.occlusion.rays = 256;
  const BakeResult plain = bake(source, ground(1), options);
  options.occlusion.distance = Length::absolute(std::hypot(6, 6, kHeight));
  const BakeResult same = bake(source, ground(1), options);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_NEAR(plain.maps[0].image.pixels[i], same.maps[0].image.pixels[i], 1e-3);
    EXPECT_GT(plain.maps[0].image.pixels[i], 0.03);
  }
}

/// Traversals, single maps, bands of a session and saved matches give the same bytes.
TEST(OcclusionFalloffs, ChangeNoByteWithTheWay) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::torus(20, 10, 1, 0.45), low = test::torus(30, 12, 1, 0.45);
  BakeOptions options = with(OcclusionFalloff::smooth, {MapKind{"ao"}, MapKind{"bent_normal"}}, 40);
  options.samples = 2;
  options.report.keep_match = true;
  options.occlusion.rays = 33;
  options.match.max_distance = Length::share(0.1);
  const BakeResult cpu = bake(Source(*test::device(), high, RayTraversal::cpu), low, options);
  const BakeResult gpu = bake(Source(*test::device(), high, RayTraversal::gpu), low, options);
  BakeOptions recalled = options;
  recalled.match.saved = &*cpu.match;
  const BakeResult again = bake(Source(*test::device(), high), low, recalled);
  for (std::size_t m = 0; m < 2; ++m) {
    EXPECT_EQ(cpu.maps[m].image.pixels, gpu.maps[m].image.pixels);
    EXPECT_EQ(cpu.maps[m].image.pixels, again.maps[m].image.pixels);
    BakeOptions alone = options;
    alone.maps = {options.maps[m]};
    EXPECT_EQ(cpu.maps[m].image.pixels,
              bake(Source(*test::device(), high), low, alone).maps[0].image.pixels);
  }
  // Thickness has no falloff.
  options.maps = {MapKind{"thickness"}};
  const BakeResult thick = bake(Source(*test::device(), high), low, options);
  options.occlusion.falloff = OcclusionFalloff::none;
  EXPECT_EQ(thick.maps[0].image.pixels,
            bake(Source(*test::device(), high), low, options).maps[0].image.pixels);
}

/// Adaptive rays come as near as is asked for, and what was reached is measured by the same measure.
TEST(OcclusionFalloffs, ObeyTheErrorAskedFor) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::torus(60, 30, 1, 0.45));
  const Mesh low = test::torus(30, 12, 1, 0.45);
  for (const std::uint32_t samples : {1U, 2U}) {
    BakeOptions options = with(OcclusionFalloff::linear, {MapKind{"ao"}}, 64);
    options.samples = samples;
    options.match.max_distance = Length::share(0.1);
    options.occlusion.distance = Length::absolute(1.5);
    options.occlusion.max_error = 0.01;
    const BakeResult baked = bake(source, low, options);
    ASSERT_EQ(baked.report.errors.size(), 1U);
    EXPECT_EQ(baked.report.errors[0].reference, "4096 rays from the same points");
    EXPECT_LT(baked.report.errors[0].rms, 255 * 0.01);
    options.occlusion.max_error = 0;
    options.occlusion.rays = 1024;
    const BakeResult full = bake(source, low, options);
    double squares = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < full.coverage.size(); ++i) {
      if (full.coverage[i] != kCoverageBaked) continue;
      const double error = baked.maps[0].image.pixels[i] - full.maps[0].image.pixels[i];
      squares += error * error;
      ++count;
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.012);
  }
}

TEST(OcclusionFalloffs, OtherMeshesDarkenByTheirDistance) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(3, 3, 6, 6));
  Mesh ceiling;
  add_rectangle(ceiling, {-3, -3, static_cast<float>(kHeight)}, {0, 6, 0}, {6, 0, 0});
  BakeOptions options = with(OcclusionFalloff::linear, {MapKind{"ao"}}, 8);
  options.occlusion.by_others = {&ceiling};
  options.occlusion.distance = Length::absolute(1);
  options.occlusion.rays = 1024;
  const BakeResult baked = bake(source, ground(1), options);
  for (const float open : baked.maps[0].image.pixels) {
    EXPECT_NEAR(open, 1 - under_ceiling(OcclusionFalloff::linear, kHeight), 0.006);
  }
}

TEST(OcclusionFalloffs, AreOfRays) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), room());
  BakeOptions options = with(OcclusionFalloff::linear, {MapKind{"ao"}}, 256);
  options.occlusion.by = OcclusionBy::views;
  EXPECT_THROW(bake(source, ground(1), options), Error);
  options.occlusion.by = OcclusionBy::automatic;
  EXPECT_EQ(bake(source, ground(1), options).report.occlusion->by, OcclusionBy::rays);
  options.occlusion.falloff = static_cast<OcclusionFalloff>(7);
  EXPECT_THROW(bake(source, ground(1), options), Error);
}

}  // namespace
}  // namespace kiln
