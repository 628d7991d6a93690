// Open single sheets: a leaf bends far off its card, and matches all the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hard_scenes.h"
#include "kiln/bake.h"
#include "mesh/open_sheets.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"

namespace kiln {
namespace {

BakeOptions sized(std::uint32_t size) {
  BakeOptions options;
  options.width = options.height = size;
  options.maps = {MapKind{"normal"}, MapKind{"mask"}};
  return options;
}

/// The leaf lies over all of its card, so each sample's point is straight over or under it.
TEST(Sheet, LeafCardMatchesByDefault) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("leaf");
  const Source source(*test::device(), scene.high);
  const test::HardBake bake(source, scene.low, sized(128));
  EXPECT_EQ(bake.baked.report.missed, 0U);
  for (std::size_t i = 0; i < bake.samples.size(); ++i) {
    const Vec3& p = bake.samples.position[i];
    ASSERT_NEAR(bake.samples.match[i].x, p.x, 1e-5) << i;
    ASSERT_NEAR(bake.samples.match[i].y, p.y, 1e-5) << i;
  }
  // A distance that is said is kept to.
  BakeOptions told = sized(128);
  told.match.max_distance = Length::share(0.02);
  const BakeReport& report = kiln::bake(source, scene.low, told).report;
  EXPECT_GT(report.missed, report.samples / 4);
}

/// A round leaf on a square card: the mask's mean is the leaf's share, and its rim is smooth.
TEST(Sheet, MaskIsSmoothWithSamples) {
  KILN_REQUIRE_DEVICE();
  constexpr int kCorners = 256;
  const double radius = 0.4;
  Mesh leaf;
  leaf.name = "round";
  leaf.positions.push_back({0, 0, 0.3F});
  for (int i = 0; i < kCorners; ++i) {
    const double a = 2 * std::numbers::pi * i / kCorners;
    leaf.positions.push_back(
        {static_cast<float>(radius * std::cos(a)), static_cast<float>(radius * std::sin(a)), 0.2F});
    const auto k = static_cast<std::uint32_t>(i);
    leaf.triangles.push_back({0, 1 + k, 1 + (k + 1) % kCorners});
  }
  const Source source(*test::device(), leaf);
  BakeOptions options = sized(64);
  options.samples = 4;
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  const Image& mask = baked.maps[1].image;
  double sum = 0;
  std::size_t between = 0;
  for (const float value : mask.pixels) {
    sum += double{value};
    between += value > 0 && value < 1 ? 1 : 0;
    EXPECT_EQ(std::fmod(value * 16, 1.0F), 0.0F);
  }
  // Some 160 rim texels, each off by no more than 1/16 either way at random.
  EXPECT_NEAR(sum / (64 * 64), std::numbers::pi * radius * radius, 0.002);
  EXPECT_GT(between, 100U);
}

/// Each sheet of LOW is searched as far as its own half diagonal, to both sides: what lies farther is missed, though
/// another sheet reaches that far.
TEST(Sheet, EachReachesAsFarAsItsOwnSizeToBothSides) {
  KILN_REQUIRE_DEVICE();
  const auto square = [](float x, float width, float z, float u) {
    Mesh mesh = test::plane(4, 4, width, width);
    for (Vec3& p : mesh.positions) p = {p.x + x, p.y, z};
    for (Vec2& uv : mesh.uvs) uv = {u + 0.5F * uv.x, uv.y};
    return mesh;
  };
  const Mesh low = join_meshes(std::vector<Mesh>{square(0, 0.4F, 0, 0), square(4, 2, 0, 0.5F)});
  for (const float height : {-1.0F, -0.2F, 0.2F, 1.0F}) {
    const Mesh high =
        join_meshes(std::vector<Mesh>{square(0, 0.4F, height, 0), square(4, 2, height, 0.5F)});
    BakeOptions options = sized(16);
    const BakeReport report = bake(Source(*test::device(), high), low, options).report;
    // Half diagonals are 0.28 and 1.41; each sheet has half of the samples.
    EXPECT_EQ(report.missed, std::abs(height) > 0.28F ? report.samples / 2 : 0U) << height;
  }
}

std::vector<float> sizes_of(const Mesh& mesh) {
  return sheet_sizes(LowSurface::of(mesh, Frame::of(mesh)));
}

TEST(Sheet, IsOpenAndLooksToOneSide) {
  const Mesh plane = test::plane(3, 2, 3, 4);
  const Frame frame = Frame::of(plane);
  for (const float size : sizes_of(plane)) EXPECT_NEAR(size, 2.5 * frame.scale, 1e-6);
  for (const float size : sizes_of(test::cube(1))) EXPECT_EQ(size, 0);
  // Open, but bent by more than a half turn: a cube without its top.
  Mesh box = test::cube(1);
  box.triangles.resize(10);
  box.uv_triangles.resize(10);
  if (!box.normal_triangles.empty()) box.normal_triangles.resize(10);
  for (const float size : sizes_of(box)) EXPECT_EQ(size, 0);
}

std::size_t extended_range(const Source& source, const Mesh& low, const BakeOptions& options) {
  const BakeResult baked = bake(source, low, options);
  return static_cast<std::size_t>(
      std::count_if(baked.report.warnings.begin(), baked.report.warnings.end(),
                    [](const Warning& w) { return w.code == "far-rays"; }));
}

/// A cage of 50 on a mesh of 2 units is a slip; one of 5% is not.
TEST(LongRays, AreWarnedOf) {
  KILN_REQUIRE_DEVICE();
  const Mesh cube = test::cube(2);
  const Source source(*test::device(), cube);
  BakeOptions options;
  options.width = options.height = 32;
  EXPECT_EQ(extended_range(source, cube, options), 0U);
  options.match.cage = Length::absolute(50);
  EXPECT_EQ(extended_range(source, cube, options), 1U);
  options.match.cage = Length::share(0.05);
  EXPECT_EQ(extended_range(source, cube, options), 0U);
  options.match.max_distance = Length::absolute(50);
  EXPECT_EQ(extended_range(source, cube, options), 1U);
}

}  // namespace
}  // namespace kiln
