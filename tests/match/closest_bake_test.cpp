// Bakes by nearest points, alone and as the fallback of other matches.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "shared/common.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

BakeOptions closest_options(std::uint32_t size, double max_distance) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = MatchMethod::closest;
  options.match.max_distance = Length::absolute(max_distance);
  options.report.keep_match = true;
  options.encoding.gutter = 0;
  return options;
}

/// A plane moved up, and one turned over and moved down by as much: the sides of a sheet.
Mesh sheet(std::uint32_t cells, float half_thickness) {
  Mesh mesh = test::plane(cells, cells);
  const auto count = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    Vec3 below = mesh.positions[i];
    below.z -= half_thickness;
    mesh.positions[i].z += half_thickness;
    mesh.positions.push_back(below);
  }
  const std::vector<Triangle> front = mesh.triangles;
  for (const Triangle& t : front) {
    mesh.triangles.push_back({t[0] + count, t[2] + count, t[1] + count});
  }
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(ClosestBake, ThinSheetsKeepTheirSides) {
  KILN_REQUIRE_DEVICE();
  // The light plane looks up, and lies three times as near to the side that looks down.
  const Mesh high = sheet(32, 0.01F);
  Mesh low = test::plane(2, 2);
  for (Vec3& p : low.positions) p.z -= 0.005F;
  const std::uint32_t front = 32 * 32 * 2;
  const Source source(*test::device(), high);
  BakeOptions options = closest_options(128, 0.1);
  const BakeResult right = bake(source, low, options);
  EXPECT_EQ(right.report.closest, 128U * 128);
  EXPECT_EQ(right.report.missed, 0U);
  EXPECT_NEAR(right.report.mean_abs_distance, 0.015, 1e-6);
  for (std::size_t i = 0; i < right.match->triangle.size(); ++i) {
    ASSERT_LT(right.match->triangle[i], front);
    ASSERT_NEAR(right.match->distance[i], 0.015F, 1e-6F);
    ASSERT_EQ(right.match->status[i], KILN_STATUS_CLOSEST);
  }
  // That it is the facing that decides: both sides asked for, the wrong one is taken.
  options.match.two_sided = true;
  const BakeResult wrong = bake(source, low, options);
  for (std::size_t i = 0; i < wrong.match->triangle.size(); ++i) {
    ASSERT_GE(wrong.match->triangle[i], front);
    ASSERT_NEAR(wrong.match->distance[i], -0.005F, 1e-6F);
  }
}

TEST(ClosestBake, IsTheSameWithBothTraversalsAndFromASavedMatch) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = test::BumpySphere::light();
  BakeOptions options = closest_options(200, 0.2);
  const BakeResult cpu = bake(Source(*test::device(), high, RayTraversal::cpu), low, options);
  const Source source(*test::device(), high, RayTraversal::gpu);
  const BakeResult gpu = bake(source, low, options);
  EXPECT_EQ(cpu.report.closest, cpu.report.samples);
  EXPECT_EQ(cpu.match->triangle, gpu.match->triangle);
  EXPECT_EQ(cpu.match->distance, gpu.match->distance);
  EXPECT_EQ(cpu.match->u, gpu.match->u);
  EXPECT_EQ(cpu.match->v, gpu.match->v);
  EXPECT_EQ(cpu.maps[0].image.pixels, gpu.maps[0].image.pixels);

  const std::filesystem::path folder = test::scratch_folder();
  save_match(*cpu.match, folder / "match.exr");
  const Match saved = load_match(folder / "match.exr");
  EXPECT_EQ(saved.status, cpu.match->status);
  options.match.saved = &saved;
  const BakeResult again = bake(source, low, options);
  EXPECT_EQ(again.report.closest, cpu.report.closest);
  EXPECT_EQ(again.maps[0].image.pixels, cpu.maps[0].image.pixels);
}

/// If detail is shallow against its distance, nearest points and rays name nearly the same points.
TEST(ClosestBake, IsNearRaysOnASmoothSurface) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::uv_sphere(256, 128, 1);
  const Mesh low = test::uv_sphere(64, 32, 1);
  const Source source(*test::device(), high);
  BakeOptions options = closest_options(256, 0.1);
  const BakeResult closest = bake(source, low, options);
  options.match.method = MatchMethod::ray;
  const BakeResult rays = bake(source, low, options);
  EXPECT_EQ(closest.report.missed, 0U);
  const ImageDifference difference =
      compare_images(closest.maps[0].image, rays.maps[0].image, nullptr);
  EXPECT_LT(difference.mean_angle_degrees, 0.5);
  EXPECT_GT(difference.mean_angle_degrees, 0);
  // No point is farther than the one that a ray finds.
  for (std::size_t i = 0; i < rays.match->status.size(); ++i) {
    if (rays.match->triangle[i] == KILN_NO_TRIANGLE) continue;
    ASSERT_LE(std::abs(closest.match->distance[i]), std::abs(rays.match->distance[i]) + 1e-6F);
  }
}

TEST(ClosestBake, DecidesWhatRaysMiss) {
  KILN_REQUIRE_DEVICE();
  // A plane that the light one overhangs: rays beyond its border meet nothing.
  const Mesh high = test::plane(16, 16);
  const Mesh low = test::plane(1, 1, 1.1, 1.1);
  const Source source(*test::device(), high);
  BakeOptions options = closest_options(128, 0.2);
  options.match.method = MatchMethod::ray;
  const BakeResult alone = bake(source, low, options);
  EXPECT_GT(alone.report.missed, 1000U);
  options.match.fallback = {MatchMethod::closest};
  const BakeResult helped = bake(source, low, options);
  EXPECT_EQ(helped.report.missed, 0U);
  EXPECT_EQ(helped.report.closest, alone.report.missed);
  EXPECT_EQ(helped.report.outward, alone.report.outward);
  options.match.method = MatchMethod::closest;
  options.match.fallback.clear();
  const BakeResult all = bake(source, low, options);
  for (std::size_t i = 0; i < alone.match->status.size(); ++i) {
    const bool missed = alone.match->status[i] == KILN_STATUS_MISS;
    const Match& same = missed ? *all.match : *alone.match;
    ASSERT_EQ(helped.match->status[i],
              missed ? std::uint8_t{KILN_STATUS_CLOSEST} : alone.match->status[i]);
    ASSERT_EQ(helped.match->triangle[i], same.triangle[i]);
    ASSERT_EQ(helped.match->u[i], same.u[i]);
    ASSERT_EQ(helped.match->v[i], same.v[i]);
    ASSERT_EQ(helped.match->distance[i], same.distance[i]);
  }
  // A sample whose point lies beyond the distance stays missed.
  options.match.method = MatchMethod::ray;
  options.match.fallback = {MatchMethod::closest};
  options.match.max_distance = Length::absolute(0.02);
  const BakeResult near = bake(source, low, options);
  EXPECT_GT(near.report.closest, 0U);
  EXPECT_GT(near.report.missed, 0U);
  EXPECT_EQ(near.report.closest + near.report.missed, alone.report.missed);
}

TEST(ClosestBake, RaysCanDecideWhatItMisses) {
  KILN_REQUIRE_DEVICE();
  // Nothing that looks the plane's way is within the distance, until rays from a cage look for it.
  const Mesh high = test::plane(16, 16);
  Mesh low = test::plane(1, 1);
  for (Vec3& p : low.positions) p.z -= 0.15F;
  BakeOptions options = closest_options(64, 0.1);
  const Source source(*test::device(), high);
  EXPECT_EQ(bake(source, low, options).report.missed, 64U * 64);
  options.match.cage = Length::absolute(0.2);
  options.match.fallback = {MatchMethod::ray};
  const BakeResult helped = bake(source, low, options);
  EXPECT_EQ(helped.report.cage, 64U * 64);
}

TEST(ClosestBake, AFallbackMustBeAnotherMethod) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(4, 4);
  const Source source(*test::device(), plane);
  const auto expect_usage = [&](const BakeOptions& options) {
    try {
      bake(source, plane, options);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(std::string(error.what()).find("fallback"), std::string::npos);
    }
  };
  BakeOptions options = closest_options(16, 0.1);
  options.match.fallback = {MatchMethod::closest};
  expect_usage(options);
  options.match.method = MatchMethod::ray;
  options.match.fallback = {MatchMethod::ray};
  expect_usage(options);
  options.match.fallback.clear();
  const BakeResult good = bake(source, plane, options);
  options.match.saved = &*good.match;
  options.match.fallback = {MatchMethod::closest};
  expect_usage(options);
}

}  // namespace
}  // namespace kiln
