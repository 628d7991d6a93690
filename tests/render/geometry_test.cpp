// Geometry of pictures: zoom, middle, shape; and the z-buffer's pictures against the rays'.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/bake.h"
#include "kiln/render.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

RenderOptions normals_seen(std::uint32_t size, double azimuth, double elevation) {
  RenderOptions options;
  options.size = size;
  options.samples = 1;
  options.ambient_rays = 0;
  options.show_normals = true;
  options.azimuth_degrees = azimuth;
  options.elevation_degrees = elevation;
  return options;
}

bool covered(const Image& image, std::size_t x, std::size_t y) {
  const float* p = image.at(x, y);
  return p[0] != 0 || p[1] != 0 || p[2] != 0;
}

/// The middle of what a picture shows, pixels.
std::array<double, 2> middle(const Image& image) {
  double x = 0, y = 0, count = 0;
  for (std::size_t j = 0; j < image.height; ++j) {
    for (std::size_t i = 0; i < image.width; ++i) {
      if (!covered(image, i, j)) continue;
      x += static_cast<double>(i) + 0.5;
      y += static_cast<double>(j) + 0.5;
      ++count;
    }
  }
  return {x / count, y / count};
}

/// A frame of 4 x 4 x 4 around the origin with one small ball in it.
Mesh ball_in_box(double x, double y, double z) {
  Mesh mesh = test::icosphere(2, 0.1);
  for (Vec3& p : mesh.positions) {
    p = {p.x + static_cast<float>(x), p.y + static_cast<float>(y), p.z + static_cast<float>(z)};
  }
  return mesh;
}

TEST(RenderGeometry, AKnownPointLandsOnItsPixel) {
  KILN_REQUIRE_DEVICE();
  const Mesh box = test::cube(4);
  const std::array<double, 3> at = {1.2, -0.7, 0.4};
  const Scene ball(*test::device(), ball_in_box(at[0], at[1], at[2]));
  for (const bool z_up : {false, true}) {
    for (const double zoom : {1.0, 2.5}) {
      RenderOptions options = normals_seen(400, 33, 21);
      options.z_up = z_up;
      options.frame = &box;
      options.zoom = zoom;
      options.trim = true;
      if (zoom != 1) options.at = {1, -0.5, 0.2};
      const Image image = ball.draw(options);
      const PictureGeometry geometry = ball.geometry(options);
      ASSERT_EQ(image.width, geometry.width);
      ASSERT_EQ(image.height, geometry.height);
      const auto [x, y, toward] = geometry.project(at);
      const auto shown = middle(image);
      // A ball of 6 pixels' radius or more: its middle is found to a fraction of one.
      EXPECT_NEAR(shown[0], x, 0.15) << z_up << zoom;
      EXPECT_NEAR(shown[1], y, 0.15) << z_up << zoom;
      // By hand: the front is +Z (-Y with z_up); azimuth turns to +X, elevation up.
      const double a = 33 * 3.14159265358979 / 180, e = 21 * 3.14159265358979 / 180;
      const std::array<double, 3> from = {at[0] - geometry.center[0], at[1] - geometry.center[1],
                                          at[2] - geometry.center[2]};
      const double front = z_up ? -from[1] : from[2], up = z_up ? from[2] : from[1];
      const double right = from[0] * std::cos(a) - front * std::sin(a);
      const double ahead = from[0] * std::sin(a) + front * std::cos(a);
      EXPECT_NEAR(x, geometry.width / 2.0 + right / geometry.pixel, 1e-9);
      EXPECT_NEAR(y,
                  geometry.height / 2.0 - (up * std::cos(e) - ahead * std::sin(e)) / geometry.pixel,
                  1e-9);
      EXPECT_NEAR(toward, ahead * std::cos(e) + up * std::sin(e), 1e-9);
    }
  }
}

TEST(RenderGeometry, ZoomShowsLessAndAtIsTheMiddle) {
  KILN_REQUIRE_DEVICE();
  const Mesh box = test::cube(4);
  const Scene ball(*test::device(), ball_in_box(-1.5, 1.5, 1.9));
  RenderOptions options = normals_seen(300, -40, 10);
  options.frame = &box;
  const double whole = ball.geometry(options).pixel;
  options.zoom = 8;
  EXPECT_NEAR(ball.geometry(options).pixel, whole / 8, 1e-12);
  const auto count = [&](const Image& image) {
    std::size_t pixels = 0;
    for (std::size_t y = 0; y < 300; ++y) {
      for (std::size_t x = 0; x < 300; ++x) pixels += covered(image, x, y) ? 1 : 0;
    }
    return pixels;
  };
  EXPECT_EQ(count(ball.draw(options)), 0U) << "the ball is not in the middle";
  options.at = {-1.5, 1.5, 1.9};
  const Image image = ball.draw(options);
  EXPECT_NEAR(middle(image)[0], 150, 0.2);
  EXPECT_NEAR(middle(image)[1], 150, 0.2);
  // A disc of radius 0.1, but for what facets of the second subdivision cut off (under 3%).
  const double disc = 3.14159265 * std::pow(0.1 / ball.geometry(options).pixel, 2);
  EXPECT_NEAR(static_cast<double>(count(image)), disc, 0.04 * disc);
}

TEST(RenderGeometry, TrimmedPicturesFitTheMesh) {
  KILN_REQUIRE_DEVICE();
  const Mesh tall = test::plane(1, 1, 0.1, 2);
  const Scene scene(*test::device(), tall);
  RenderOptions options = normals_seen(500, 0, 0);
  options.trim = true;
  const Image image = scene.draw(options);
  EXPECT_EQ(image.height, 500U);
  // The side is 2 / 0.92; 4% of it on each side, and a twentieth of 92% between.
  EXPECT_EQ(image.width, 63U) << "500 (0.08 + 0.92 / 20)";
  EXPECT_EQ(image.pixels.size(), std::size_t{500} * image.width * 3);
  const auto [x, y] = middle(image);
  EXPECT_NEAR(x, image.width / 2.0, 0.51);
  EXPECT_NEAR(y, 250, 0.51);
  options.trim = false;
  EXPECT_EQ(scene.draw(options).width, 500U);
  // The same pixels, cut.
  EXPECT_NEAR(scene.geometry(options).pixel, 2 / 0.92 / 500, 1e-12);
}

TEST(RenderGeometry, RefusesWhatCannotBe) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(*test::device(), test::cube());
  RenderOptions options;
  options.size = 32;
  for (const double zoom : {0.0, -1.0, 1e6, std::nan("")}) {
    options.zoom = zoom;
    EXPECT_THROW(scene.draw(options), Error) << zoom;
  }
  options.zoom = 1;
  options.at = {0, std::nan(""), 0};
  EXPECT_THROW(scene.draw_depth(options), Error);
  options.at.reset();
  EXPECT_THROW(scene.time_frames(options, 0), Error);
  options.zoom = 2;
  EXPECT_THROW(scene.rasterise(options), Error);
}

/// Share of the pixels whose colours differ by more than 2/255, of those that rays cover.
double differing(const Image& rays, const Image& drawn) {
  std::size_t all = 0, off = 0;
  for (std::size_t i = 0; i < rays.pixels.size(); i += 3) {
    if (rays.pixels[i] == 0 && drawn.pixels[i] == 0) continue;
    ++all;
    for (std::size_t c = 0; c < 3; ++c) {
      if (std::abs(rays.pixels[i + c] - drawn.pixels[i + c]) <= 2.0F / 255) continue;
      ++off;
      break;
    }
  }
  return static_cast<double>(off) / static_cast<double>(all);
}

TEST(Frames, ShowWhatRaysShow) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(20000), low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  BakeOptions bake_options;
  bake_options.width = bake_options.height = 256;
  bake_options.match.max_distance = Length::absolute(0.1);
  const BakeResult baked = bake(source, low, bake_options);
  const Scene plain(*test::device(), high), mapped(*test::device(), low, {&baked.maps[0].image});
  for (const Scene* scene : {&plain, &mapped}) {
    RenderOptions options = normals_seen(301, 25, 40);
    options.frame = &high;
    options.trim = true;
    const Image rays = scene->draw(options), drawn = scene->rasterise(options);
    ASSERT_EQ(rays.width, drawn.width);
    ASSERT_EQ(rays.height, drawn.height);
    // Silhouettes pass within 1/128 of a pixel of the middle of about that share of their pixels.
    EXPECT_LT(differing(rays, drawn), 0.003);
    options.show_normals = false;
    EXPECT_LT(differing(scene->draw(options), scene->rasterise(options)), 0.003);
  }
}

TEST(Frames, CostIsWhatABufferHolds) {
  KILN_REQUIRE_DEVICE();
  // 8 positions with 6 split normals: 24 corners that differ, with UVs the same.
  const Mesh cube = test::cube();
  const Image map{32, 16, 3, std::vector<float>(32 * 16 * 3, 0.5F)};
  const Scene scene(*test::device(), cube, {&map});
  RenderOptions options;
  options.size = 64;
  const FrameCost with = scene.time_frames(options, 3);
  EXPECT_EQ(with.frames, 3U);
  EXPECT_EQ(with.triangles, 12U);
  EXPECT_EQ(with.vertices, 24U);
  EXPECT_EQ(with.bytes, 12U * 12 + 24U * 48 + 32U * 16 * 6);
  options.ignore_map = true;
  const FrameCost without = scene.time_frames(options, 4);
  EXPECT_EQ(without.vertices, 24U);
  EXPECT_EQ(without.bytes, 12U * 12 + 24U * 24);
  for (const FrameCost& cost : {with, without}) {
    EXPECT_GT(cost.seconds_least, 0);
    EXPECT_LE(cost.seconds_least, cost.seconds_median);
    EXPECT_LE(cost.seconds_median, cost.seconds_most);
  }
}

}  // namespace
}  // namespace kiln
