// Depth in pictures, and how far two meshes' are apart.
#include <gtest/gtest.h>

#include <cmath>

#include "kiln/measure.h"
#include "kiln/render.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

Mesh moved(Mesh mesh, float x, float y, float z) {
  for (Vec3& p : mesh.positions) p = {p.x + x, p.y + y, p.z + z};
  return mesh;
}

// Two planes a known distance apart, seen from straight ahead and askew.
TEST(Depth, OfPlanesIsTheirDistance) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(4, 3, 2, 1.5);  // diagonal 2.5
  const Mesh behind = moved(plane, 0, 0, -0.125F);
  const Scene scene(*test::device(), plane), other(*test::device(), behind);
  const DepthError ahead = DepthReference(scene, plane, {{0, 0}}, 100).compare(other);
  EXPECT_GT(ahead.pixels, 4000U);
  // Floats of the frame: 2^-24 of about 1.
  EXPECT_NEAR(ahead.mean, 0.125 / 2.5, 2e-7);
  EXPECT_NEAR(ahead.rms, 0.125 / 2.5, 2e-7);
  EXPECT_NEAR(ahead.max, 0.125 / 2.5, 2e-7);
  // Askew by 60 degrees, a ray meets the plane behind 0.125 / cos 60 further on.
  const DepthError askew = DepthReference(scene, plane, {{60, 0}}, 100).compare(other);
  EXPECT_GT(askew.pixels, 1000U);
  EXPECT_GT(askew.one_sided, 100U);
  EXPECT_NEAR(askew.mean, 0.25 / 2.5, 1e-6);
}

// A sphere within a sphere: along a ray at distance r from the middle the depths differ by
// sqrt(R^2 - r^2) - sqrt(q^2 - r^2). Its mean over the inner disc is 2/3 (R^3 - (R^2 - q^2)^(3/2) - q^3) / q^2.
TEST(Depth, OfSpheresIsTheIntegral) {
  KILN_REQUIRE_DEVICE();
  const Mesh outer = test::uv_sphere(512, 256), inner = test::uv_sphere(512, 256, 0.9);
  const double big = 1, small = 0.9;
  const double mean = 2.0 / 3 *
                      (big - std::pow(big * big - small * small, 1.5) - std::pow(small, 3)) /
                      (small * small);
  const DepthReference reference(Scene(*test::device(), outer), outer, {{20, 35}, {200, -60}}, 400);
  const DepthError error = reference.compare(Scene(*test::device(), inner));
  // The box's diagonal is 2 sqrt 3. Facets of 0.7 degrees lie within 1.9e-5 of the sphere; pixels of the
  // disc's border, where the difference is steep, are 0.6% of it.
  EXPECT_NEAR(error.mean, mean / (2 * std::sqrt(3.0)), 0.005 * mean);
  EXPECT_EQ(reference.compare(Scene(*test::device(), outer)).max, 0);
}

TEST(Depth, PictureSaysHowFarInWorldUnits) {
  KILN_REQUIRE_DEVICE();
  // Far from the origin, in another unit.
  Mesh sphere = test::uv_sphere(256, 128, 50);
  sphere = moved(std::move(sphere), 1000, -300, 20);
  RenderOptions options;
  options.size = 101;
  const Scene scene(*test::device(), sphere);
  const Image depth = scene.draw_depth(options);
  EXPECT_NEAR(*depth.at(50, 50), 50, 0.02);
  EXPECT_EQ(*depth.at(0, 0), Scene::kNoDepth);
  options.at = {1000, -300, 20 + 50.0};
  options.azimuth_degrees = options.elevation_degrees = 0;
  EXPECT_NEAR(*scene.draw_depth(options).at(50, 50), 0, 0.02);
}

}  // namespace
}  // namespace kiln
