// Depth views against the brute-force oracle, and what a rasteriser must never do.
#include "accel/raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "mesh/frame.h"
#include "reference/raster.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

cl::Context& context() { return context_of(*device()); }

std::vector<std::uint64_t> draw(const kiln_view& view, const std::vector<Vec3>& positions,
                                const std::vector<Triangle>& triangles,
                                RasterPath path = RasterPath::automatic) {
  Rasterizer rasterizer(context(), positions, triangles, path);
  const DepthKeys keys(context(), DepthKeys::count(view.width, view.height) + view.first);
  rasterizer.draw({&view, 1}, keys);
  return keys.picture(context(), view);
}

std::uint32_t triangle_of(std::uint64_t key) { return static_cast<std::uint32_t>(key); }
float depth_of(std::uint64_t key) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(key >> 32));
}

/// Every pixel: the same triangle, or one as near as single precision can tell.
void expect_as_oracle(const kiln_view& view, const std::vector<Vec3>& positions,
                      const std::vector<Triangle>& triangles) {
  const std::vector<std::uint64_t> keys = draw(view, positions, triangles);
  const std::vector<ReferencePixel> expected = reference_raster(view, positions, triangles);
  std::size_t covered = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool empty = expected[i].triangle == KILN_NO_TRIANGLE;
    ASSERT_EQ(keys[i] == KILN_RASTER_EMPTY, empty) << "pixel " << i;
    if (empty) continue;
    ++covered;
    // Depth: positions of 24 bits, three products, three sums of weights of 24 bits.
    constexpr double kDepth = 1e-6;
    ASSERT_NEAR(static_cast<double>(depth_of(keys[i])), expected[i].depth, kDepth) << "pixel " << i;
    if (triangle_of(keys[i]) != expected[i].triangle) {
      ASSERT_LT(expected[i].second - expected[i].depth, 2 * kDepth) << "pixel " << i;
    }
  }
  EXPECT_GT(covered, 0U);
}

struct Drawn {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
};

Drawn in_frame(const Mesh& mesh) { return {Frame::of(mesh).to_frame(mesh), mesh.triangles}; }

kiln::Vec3d unit(double x, double y, double z) {
  const kiln::Vec3d v{x, y, z};
  return v * (1 / length(v));
}

TEST(Raster, AgreesWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  const Drawn sphere = in_frame(icosphere(3));
  const Drawn soup = in_frame(random_soup(150, 3, 0.8));
  const Drawn torus_mesh = in_frame(torus(24, 12));
  for (const kiln::Vec3d& toward :
       {kiln::Vec3d{0, 0, 1}, kiln::Vec3d{0, 1, 0}, unit(0.3, -0.8, 0.5)}) {
    for (const std::uint32_t size : {1U, 7U, 64U, 150U}) {
      kiln_view view = make_view(toward, 0.5, size);
      expect_as_oracle(view, sphere.positions, sphere.triangles);
      expect_as_oracle(view, soup.positions, soup.triangles);
      view.flags = KILN_RASTER_TWO_SIDED;
      expect_as_oracle(view, soup.positions, soup.triangles);
      if (size > 7) expect_as_oracle(view, torus_mesh.positions, torus_mesh.triangles);
    }
  }
}

TEST(Raster, LargeTrianglesAgreeWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  // Up to the whole picture wide: the queue's path; some reach beyond its borders.
  const Drawn soup = in_frame(random_soup(25, 7, 3.0));
  for (const kiln::Vec3d& toward : {kiln::Vec3d{1, 0, 0}, unit(1, 2, 3)}) {
    kiln_view view = make_view(toward, 0.2, 300);
    view.height = 170;
    view.flags = KILN_RASTER_TWO_SIDED;
    view.first = 2 * KILN_RASTER_TILE_PIXELS;
    expect_as_oracle(view, soup.positions, soup.triangles);
  }
}

TEST(Raster, PixelCentresOnSharedEdgesAreDrawnOnce) {
  KILN_REQUIRE_DEVICE();
  // A grid whose vertices and diagonals pass exactly through pixel centres, triangle by triangle.
  const Mesh mesh = plane(8, 8, 0.5, 0.5);
  for (const std::uint32_t size : {64U, 256U}) {  // cells of 4 pixels (small path), of 16
    kiln_view view = make_view({0, 0, 1}, 0.5, size);
    view.scale = static_cast<float>(size);
    view.left = view.top = static_cast<float>(size) / 2 + 0.5F;
    std::vector<int> drawn(std::size_t{size} * size);
    for (const Triangle& triangle : mesh.triangles) {
      const std::vector<std::uint64_t> keys = draw(view, mesh.positions, {triangle});
      for (std::size_t i = 0; i < keys.size(); ++i) drawn[i] += keys[i] != KILN_RASTER_EMPTY;
    }
    EXPECT_EQ(*std::max_element(drawn.begin(), drawn.end()), 1);
    // A half-open square of half the picture's width.
    EXPECT_EQ(std::count(drawn.begin(), drawn.end(), 1), std::ptrdiff_t{size} * size / 4);
  }
}

TEST(Raster, ClosedMeshesHaveNoCracks) {
  KILN_REQUIRE_DEVICE();
  const Drawn sphere = in_frame(icosphere(5));  // 20,480 triangles of about 2 pixels
  const kiln_view view = make_view(unit(0.2, 0.5, 0.8), 0.5, 200);
  const std::vector<std::uint64_t> keys = draw(view, sphere.positions, sphere.triangles);
  // The icosphere's radius is (cube diagonal)^-1 of its box; its polyhedron reaches to 0.998 of it.
  const double radius =
      0.998 * length(kiln::to_double(sphere.positions[0])) * static_cast<double>(view.scale);
  for (std::uint32_t y = 0; y < view.height; ++y) {
    for (std::uint32_t x = 0; x < view.width; ++x) {
      if (std::hypot(x + 0.5 - 100, y + 0.5 - 100) > radius) continue;
      ASSERT_NE(keys[std::size_t{y} * view.width + x], KILN_RASTER_EMPTY) << x << ", " << y;
    }
  }
}

TEST(Raster, EquallyNearTrianglesGoToTheLowest) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = plane(1, 1, 0.5, 0.5);
  std::vector<Triangle> triangles;
  for (int copy = 0; copy < 5; ++copy) {
    triangles.insert(triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  }
  for (const std::uint32_t size : {20U, 200U}) {
    const kiln_view view = make_view(unit(0.1, 0.2, 1), 0.5, size);
    for (const std::uint64_t key : draw(view, mesh.positions, triangles)) {
      if (key != KILN_RASTER_EMPTY) {
        EXPECT_LT(triangle_of(key), 2U);
      }
    }
  }
}

TEST(Raster, TwoPassesDrawTheSame) {
  KILN_REQUIRE_DEVICE();
  const Drawn sphere = in_frame(icosphere(4));
  const Drawn soup = in_frame(random_soup(300, 5, 0.7));
  for (const Drawn* drawn : {&sphere, &soup}) {
    kiln_view view = make_view(unit(-0.4, 0.7, 0.2), 0.5, 180);
    view.flags = KILN_RASTER_TWO_SIDED;
    EXPECT_TRUE(draw(view, drawn->positions, drawn->triangles, RasterPath::two_passes) ==
                draw(view, drawn->positions, drawn->triangles, RasterPath::atomics));
  }
}

TEST(Raster, OrderOfTrianglesChangesOnlyTheirNames) {
  KILN_REQUIRE_DEVICE();
  const Drawn torus_mesh = in_frame(torus(60, 30));
  std::vector<std::uint32_t> order(torus_mesh.triangles.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(5));
  std::vector<Triangle> shuffled;
  for (const std::uint32_t i : order) shuffled.push_back(torus_mesh.triangles[i]);
  const kiln_view view = make_view(unit(0.5, 0.6, -0.3), 0.5, 160);
  const auto expected = draw(view, torus_mesh.positions, torus_mesh.triangles);
  const auto keys = draw(view, torus_mesh.positions, shuffled);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    ASSERT_EQ(keys[i] >> 32, expected[i] >> 32);
    if (keys[i] != KILN_RASTER_EMPTY) {
      ASSERT_EQ(order[triangle_of(keys[i])], triangle_of(expected[i]));
    }
  }
}

TEST(Raster, LeavesOutWhatIsNotFinite) {
  KILN_REQUIRE_DEVICE();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<Vec3> positions = {
      {-0.2F, -0.2F, 0}, {0.2F, -0.2F, 0}, {0, 0.2F, 0}, {kInfinity, 0, 0}, {0, std::nanf(""), 0}};
  const kiln_view view = make_view({0, 0, 1}, 0.5, 40);
  const auto expected = draw(view, positions, {{0, 1, 2}});
  EXPECT_TRUE(draw(view, positions, {{0, 1, 2}, {0, 1, 3}, {4, 1, 2}, {0, 0, 1}}) == expected);
  EXPECT_NE(std::count(expected.begin(), expected.end(), KILN_RASTER_EMPTY), 1600);
}

}  // namespace
}  // namespace kiln::test
