// Drawing by tiles: the same keys as with atomics, to the bit, whatever lies where on the tiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "accel/depth_views.h"
#include "accel/drawn.h"
#include "accel/raster.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"
#include "reference/raster.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

using Keys = std::vector<std::uint64_t>;

constexpr std::uint64_t kCanary = 0x3F00000000000000ULL;  // nearer than anything: triangle 0

cl::Context& context() { return context_of(*device()); }

kiln::Vec3d unit(double x, double y, double z) {
  const kiln::Vec3d v{x, y, z};
  return v * (1 / length(v));
}

DepthKeys canaries(std::uint64_t count) {
  DepthKeys keys(context(), count);
  context().fill(keys.keys, kCanary);
  context().fill(keys.drawn, std::uint8_t{1});
  return keys;
}

Keys draw(const kiln_view& view, const Drawn& drawn, RasterPath path = RasterPath::tiles) {
  Rasterizer rasterizer(context(), drawn.positions, drawn.triangles, path);
  const DepthKeys keys = canaries(view.first + DepthKeys::count(view.width, view.height));
  rasterizer.draw({&view, 1}, keys);
  return keys.picture(context(), view);
}

void expect_same_on_all_paths(const kiln_view& view, const Drawn& drawn) {
  const Keys tiles = draw(view, drawn);
  EXPECT_TRUE(tiles == draw(view, drawn, RasterPath::atomics))
      << view.width << " x " << view.height << ", flags " << view.flags;
  if (view.width < 200) {
    EXPECT_TRUE(tiles == draw(view, drawn, RasterPath::two_passes));
  }
}

void expect_as_oracle(const kiln_view& view, const Drawn& drawn) {
  const Keys keys = draw(view, drawn);
  const auto expected = reference_raster(view, drawn.positions, drawn.triangles);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(keys[i] == KILN_RASTER_EMPTY, expected[i].triangle == KILN_NO_TRIANGLE)
        << i % view.width << ", " << i / view.width;
    // If another triangle is as near as single precision can tell, either may be there.
    if (keys[i] == KILN_RASTER_EMPTY || expected[i].second - expected[i].depth < 2e-6) continue;
    ASSERT_EQ(static_cast<std::uint32_t>(keys[i]), expected[i].triangle);
  }
}

/// A view along -z in which x and y are pixels from the lower left, over 1024.
kiln_view pixel_view(std::uint32_t width, std::uint32_t height) {
  kiln_view view = make_view({0, 0, 1}, 0.5, std::max(width, height));
  view.scale = 1024;
  view.left = 0;
  view.top = static_cast<float>(height);
  view.width = width;
  view.height = height;
  return view;
}

Vec3 at_pixel(const kiln_view& view, double x, double y, double z = 0) {
  return {static_cast<float>(x / 1024), static_cast<float>((view.height - y) / 1024),
          static_cast<float>(z)};
}

TEST(Tiles, DrawWhatAtomicsDraw) {
  KILN_REQUIRE_DEVICE();
  const std::array<Drawn, 6> scenes = {in_frame(icosphere(4)),
                                       shuffled(in_frame(torus(60, 30))),
                                       in_frame(random_soup(3000, 1, 0.02)),
                                       in_frame(random_soup(300, 2, 0.3)),
                                       in_frame(random_soup(60, 3, 3.0)),
                                       in_frame(tetrahedron())};
  for (const Drawn& scene : scenes) {
    for (const std::uint32_t size : {1U, 7U, 63U, 64U, 65U, 129U, 300U}) {
      kiln_view view = make_view(unit(0.3, size, 40), 0.5, size);
      if (size == 300) view.height = 170;
      expect_same_on_all_paths(view, scene);
      view.flags = KILN_RASTER_TWO_SIDED;
      view.first = 3 * KILN_RASTER_TILE_PIXELS;
      expect_same_on_all_paths(view, scene);
    }
  }
}

TEST(Tiles, DrawTheBunnyAsAtomicsDo) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  const Mesh mesh = load_mesh(*shared_data("bunny_high.ply"));
  const Drawn bunny = in_frame(mesh);
  Rasterizer tiles(context(), bunny.positions, bunny.triangles, RasterPath::tiles);
  Rasterizer atomics(context(), bunny.positions, bunny.triangles, RasterPath::atomics);
  for (const std::uint32_t size : {500U, 1100U}) {
    const DepthKeys keys = canaries(DepthKeys::count(size, size));
    for (const kiln::Vec3d& toward : spread_directions(5)) {
      const kiln_view view = make_view(toward, tiles.radius(), size);
      tiles.draw({&view, 1}, keys);
      const Keys picture = keys.picture(context(), view);
      atomics.draw({&view, 1}, keys);
      ASSERT_TRUE(picture == keys.picture(context(), view));
    }
  }
}

TEST(Tiles, ChunksThatFaceAwayHideNothing) {
  KILN_REQUIRE_DEVICE();
  // Triangles much smaller than a pixel: the snapping turns some round.
  const Drawn sphere = in_frame(icosphere(6));
  for (const std::uint32_t size : {5U, 20U, 90U, 600U}) {
    expect_same_on_all_paths(make_view(unit(0.1, 0.7, -0.4), 0.5, size), sphere);
  }
  // A sheet seen almost, quite, and more than edge on: along a column of pixel centres.
  Drawn sheet = in_frame(plane(60, 60));
  std::mt19937 random(3);
  for (Vec3& p : sheet.positions) {
    p.x += 0.004F * static_cast<float>(random() % 1000) / 1000;
    p.y += 0.004F * static_cast<float>(random() % 1000) / 1000;
  }
  for (const std::uint32_t size : {5U, 91U, 601U, 1201U}) {
    for (const double tilt : {0.02, 0.001, 0.0, -0.0001, -0.0003, -0.001, -0.003, -0.02}) {
      expect_same_on_all_paths(make_view(unit(1, 0, tilt), 0.5, size), sheet);
    }
  }
}

TEST(Tiles, PixelsOnBothSidesOfBorders) {
  KILN_REQUIRE_DEVICE();
  const kiln_view view = pixel_view(193, 130);
  Drawn drawn;
  std::vector<std::uint32_t> expected;
  const std::array<std::uint32_t, 9> columns = {0, 1, 62, 63, 64, 65, 127, 128, 192};
  const std::array<std::uint32_t, 8> rows = {0, 1, 63, 64, 65, 127, 128, 129};
  for (const std::uint32_t y : rows) {
    for (const std::uint32_t x : columns) {
      // Around one pixel's centre.
      const auto first = static_cast<std::uint32_t>(drawn.positions.size());
      drawn.positions.push_back(at_pixel(view, x + 0.25, y + 0.75));
      drawn.positions.push_back(at_pixel(view, x + 0.75, y + 0.75));
      drawn.positions.push_back(at_pixel(view, x + 0.5, y + 0.125));
      drawn.triangles.push_back({first, first + 1, first + 2});
      expected.push_back(y * view.width + x);
    }
  }
  const Keys keys = draw(view, drawn);
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    const auto found = std::find(expected.begin(), expected.end(), i);
    const auto triangle = static_cast<std::uint32_t>(found - expected.begin());
    ASSERT_EQ(static_cast<std::uint32_t>(keys[i]),
              found == expected.end() ? KILN_NO_TRIANGLE : triangle)
        << i % view.width << ", " << i / view.width;
  }
}

TEST(Tiles, TrianglesWithCornersAndEdgesOnBorders) {
  KILN_REQUIRE_DEVICE();
  for (const auto& [width, height] :
       {std::pair{193U, 130U}, std::pair{64U, 64U}, std::pair{128U, 65U}, std::pair{9U, 200U}}) {
    kiln_view view = pixel_view(width, height);
    view.flags = KILN_RASTER_TWO_SIDED;
    std::mt19937 random(width);
    Drawn drawn;
    for (std::uint32_t t = 0; t < 120; ++t) {
      // Corners at borders, half a pixel beside them (pixel centres) and a 256th beside those.
      std::array<Vec3, 3> corners;
      for (Vec3& corner : corners) {
        constexpr std::array<double, 6> kBeside = {0, 0.5, -0.5, 0.49609375, 0.50390625, 7.5};
        const double x = 64.0 * static_cast<double>(random() % 5) - 32 * (t & 1U) +
                         kBeside[random() % kBeside.size()];
        const double y =
            64.0 * static_cast<double>(random() % 4) + kBeside[random() % kBeside.size()];
        corner = at_pixel(view, x, y, 0.001 * t);
      }
      // Every third: small ones.
      if (t % 3 == 0) {
        corners[1] = {corners[0].x + 9.0F / 1024, corners[0].y + 2.0F / 1024, corners[0].z};
        corners[2] = {corners[0].x - 3.0F / 1024, corners[0].y + 11.0F / 1024, corners[0].z};
      }
      drawn.positions.insert(drawn.positions.end(), corners.begin(), corners.end());
      drawn.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    expect_as_oracle(view, drawn);
    expect_same_on_all_paths(view, drawn);
  }
}

TEST(Tiles, EmptyTilesAreMarkedAndNotWritten) {
  KILN_REQUIRE_DEVICE();
  const kiln_view view = pixel_view(320, 192);  // 5 x 3 tiles
  // In tile (3, 1), and with a box that reaches into (2, 1) and (3, 0) but no pixel there.
  const Drawn drawn = {
      {at_pixel(view, 191.9, 80), at_pixel(view, 230, 120), at_pixel(view, 230, 63.9)},
      {{0, 1, 2}}};
  Rasterizer rasterizer(context(), drawn.positions, drawn.triangles, RasterPath::tiles);
  const DepthKeys keys = canaries(DepthKeys::count(view.width, view.height));
  rasterizer.draw({&view, 1}, keys);
  const std::vector<std::uint8_t> marks = keys.drawn.download(context());
  const Keys stored = keys.keys.download(context());
  for (std::size_t tile = 0; tile < marks.size(); ++tile) {
    EXPECT_EQ(marks[tile], tile == 8 ? 1 : 0) << tile;
    const auto first = stored.begin() + static_cast<std::ptrdiff_t>(tile * KILN_RASTER_TILE_PIXELS);
    const auto kept = std::count(first, first + KILN_RASTER_TILE_PIXELS, kCanary);
    EXPECT_EQ(kept, tile == 8 ? 0 : KILN_RASTER_TILE_PIXELS) << tile;
  }
  EXPECT_TRUE(keys.picture(context(), view) == draw(view, drawn, RasterPath::atomics));
}

TEST(Tiles, DrawingAgainLeavesNothingBehind) {
  KILN_REQUIRE_DEVICE();
  const Drawn scene = in_frame(torus(30, 15));
  Rasterizer rasterizer(context(), scene.positions, scene.triangles, RasterPath::tiles);
  const std::uint32_t size = 260;
  const DepthKeys keys = canaries(DepthKeys::count(size, size));
  kiln_view above = make_view({0, 1, 0}, 0.5, size);
  kiln_view beside = make_view({0, 0, 1}, 0.5, size);
  kiln_view away = beside;
  away.left = 5000;  // shows nothing
  for (const kiln_view& view : {above, beside, away, above, away, beside}) {
    rasterizer.draw({&view, 1}, keys);
    EXPECT_TRUE(keys.picture(context(), view) == draw(view, scene, RasterPath::atomics));
  }
}

TEST(Tiles, ManyViewsAtOnce) {
  KILN_REQUIRE_DEVICE();
  const Drawn scene = in_frame(icosphere(3));
  Rasterizer rasterizer(context(), scene.positions, scene.triangles, RasterPath::tiles);
  // More than one launch takes; with a gap before the first.
  std::vector<kiln_view> views;
  std::uint32_t first = 2 * KILN_RASTER_TILE_PIXELS;
  for (const kiln::Vec3d& toward : spread_directions(35)) {
    views.push_back(make_view(toward, 0.5, 70));
    views.back().flags = views.size() % 3 == 0 ? KILN_RASTER_TWO_SIDED : 0;
    views.back().first = first;
    first += static_cast<std::uint32_t>(DepthKeys::count(70, 70));
  }
  const DepthKeys keys = canaries(first + KILN_RASTER_TILE_PIXELS);
  rasterizer.draw(views, keys);
  for (kiln_view view : views) {
    const Keys together = keys.picture(context(), view);
    view.first = 0;
    ASSERT_TRUE(together == draw(view, scene, RasterPath::atomics));
  }
  const Keys stored = keys.keys.download(context());
  for (std::size_t i = 0; i < KILN_RASTER_TILE_PIXELS; ++i) {
    ASSERT_EQ(stored[i], kCanary);
    ASSERT_EQ(stored[stored.size() - 1 - i], kCanary);
  }
}

TEST(Tiles, MatchingSeesNothingInEmptyTiles) {
  KILN_REQUIRE_DEVICE();
  const Drawn scene = in_frame(icosphere(3));
  Rasterizer rasterizer(context(), scene.positions, scene.triangles, RasterPath::tiles);
  constexpr std::uint32_t kSize = 600;  // the tiles in the corners stay empty
  DepthViews views(context(), rasterizer, {{0, 0, 1}}, kSize, false, {{}, rasterizer.radius()});
  // Tiles that were left out: the nearest of the sphere's own triangles, everywhere.
  context().fill(views.keys().keys, std::uint64_t{0x3F40000000000005ULL});
  rasterizer.draw(views.views(), views.keys());
  // Samples at the depth 0.75, which those keys say, over the whole picture.
  constexpr std::uint32_t kSide = 64;
  constexpr std::uint32_t kCount = kSide * kSide;
  std::vector<float> points(std::size_t{7} * kCount);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    points[i] = (static_cast<float>(i % kSide) / kSide - 0.5F) * 0.6F;
    points[kCount + i] = (static_cast<float>(i / kSide) / kSide - 0.5F) * 0.6F;
    points[2 * kCount + i] = 0.25F;
    points[5 * kCount + i] = 1;
  }
  const cl::Array<float> samples(context(), std::span<const float>(points));
  const cl::Array<float> quality(context(), kCount);
  ViewQuery query;
  query.max_distance = 0.3F;
  views.probe(samples, kCount, kCount, query, quality);
  const std::vector<float> seen = quality.download(context());
  DeviceCorrespondence match(context(), kCount);
  const cl::Array<float> score(context(), kCount);
  DepthViews::reset(context(), kCount, score, match);
  views.match(samples, kCount, kCount, query, score, match);
  const std::vector<std::uint32_t> found = match.triangle.download(context());
  const Keys picture = views.keys().picture(context(), views.views()[0]);
  const kiln_view& view = views.views()[0];
  std::uint32_t hits = 0;
  std::uint32_t in_empty_tiles = 0;
  const std::vector<std::uint8_t> marks = views.keys().drawn.download(context());
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const float x = points[i] * view.scale + view.left;
    const float y = view.top - points[kCount + i] * view.scale;
    if (!(x >= 0 && y >= 0 && x < kSize && y < kSize)) continue;
    const auto column = static_cast<std::uint32_t>(x);
    const auto row = static_cast<std::uint32_t>(y);
    in_empty_tiles += marks[row / 64 * KILN_RASTER_TILES(kSize) + column / 64] == 0 ? 1 : 0;
    const bool empty = picture[row * kSize + column] == KILN_RASTER_EMPTY;
    if (empty) {
      ASSERT_EQ(seen[i], 0) << column << ", " << row;
      ASSERT_EQ(found[i], KILN_NO_TRIANGLE) << column << ", " << row;
    }
    hits += seen[i] > 0 ? 1 : 0;
  }
  EXPECT_GT(hits, 100U);
  EXPECT_GT(in_empty_tiles, 100U);
}

TEST(Tiles, FarAndHugeTrianglesAreAsWithAtomics) {
  KILN_REQUIRE_DEVICE();
  Drawn drawn = in_frame(random_soup(50, 9, 0.5));
  const auto far = static_cast<std::uint32_t>(drawn.positions.size());
  for (const float reach : {3.0F, 60.0F, 1e10F, 3e38F}) {
    drawn.positions.push_back({-reach, 0, 0});
    drawn.positions.push_back({reach, 0.01F, 0});
    drawn.positions.push_back({0, reach, 0});
  }
  for (std::uint32_t i = 0; i < 12; i += 3)
    drawn.triangles.push_back({far + i, far + i + 1, far + i + 2});
  drawn.triangles.push_back({0, far, far + 7});
  for (const std::uint32_t size : {50U, 333U}) {
    kiln_view view = make_view({0, 0, 1}, 0.5, size);
    view.flags = KILN_RASTER_TWO_SIDED;
    expect_same_on_all_paths(view, drawn);
    expect_same_on_all_paths(make_view(unit(0.001, 0.001, 1), 0.5, size), drawn);
  }
}

}  // namespace
}  // namespace kiln::test
