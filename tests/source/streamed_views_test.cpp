// Matching a high poly that is larger than memory by depth views, and along visibility directions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/ply_stream.h"
#include "bake/streaming.h"
#include "kiln/bake.h"
#include "kiln/limits.h"
#include "match/view_plan.h"
#include "mesh/triangle_blocks.h"
#include "source/chunked_mesh.h"
#include "source/chunked_views.h"
#include "source/high_poly.h"
#include "source/streamed_bakes.h"
#include "source/streamed_files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

/// A bake by views of 200 pixels a side, which takes little time.
BakeOptions by_views(std::uint32_t size, double distance) {
  BakeOptions options = options_for(size, false);
  options.match.method = MatchMethod::views;
  options.match.max_distance = Length::absolute(distance);
  options.match.views.size = 200;
  return options;
}

/// Each criterion, planned views, views of one's own, faces from both sides, points that stay on the views' lines, views
/// as a fallback, and with one.
std::vector<BakeOptions> all_by_views(std::uint32_t size, double distance) {
  std::vector<BakeOptions> all(7, by_views(size, distance));
  all[1].match.views.criterion = ViewCriterion::depth;
  all[1].match.two_sided = true;
  all[1].samples = 2;
  all[2].match.views.criterion = ViewCriterion::distance;
  all[2].match.views.count = 5;
  all[3].match.views.automatic = true;
  all[3].match.views.count = 4;
  all[3].match.views.directions = {{1, 2, 3}};
  all[4].match.views.count = 0;
  all[4].match.views.directions = {{0, 0, 1}, {0, -3, 1}};
  all[4].match.views.refine = false;
  all[4].match.fallback = {MatchMethod::closest};
  all[5].match.method = MatchMethod::ray;
  all[5].match.max_distance = Length::absolute(distance / 8);
  all[5].match.fallback = {MatchMethod::views};
  all[6].report.errors = true;
  return all;
}

TEST(StreamedViews, MapsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = BumpySphere::dense(6000);
  expect_same_for_chunks(
      high, BumpySphere::light(), all_by_views(96, 0.15),
      {high.triangles.size(), high.triangles.size() / 2 + 1, high.triangles.size() / 7, 300});
}

/// The size of views follows the high poly's triangles, of which no chunk has all.
TEST(StreamedViews, TheSizeOfViewsIsTheSame) {
  KILN_REQUIRE_DEVICE();
  Mesh high = BumpyTorus::dense(90000, true);
  for (std::size_t v = 0; v < high.positions.size() / 2; ++v) high.positions[v].z *= 1.5F;
  std::vector<BakeOptions> all(2, by_views(256, 0.15));
  all[0].match.views.size = 0;
  all[1].match.views.automatic = true;
  expect_same_for_chunks(high, torus(40, 20), all, {70000, 20000});
}

TEST(StreamedViews, TiesOfSheetsAreDecidedAsInOnePiece) {
  KILN_REQUIRE_DEVICE();
  std::vector<BakeOptions> all = all_by_views(48, 0.05);
  expect_same_for_chunks(sheets(), plane(2, 2), all, {500, 33});
  expect_same_for_chunks(random_soup(120, 3, 0.4), cube(1.5), {by_views(32, 0.4)}, {1, 7, 50});
}

/// A height field has one view.
TEST(StreamedViews, HeightFieldsAreRecognized) {
  KILN_REQUIRE_DEVICE();
  Mesh waves = plane(200, 200);
  waves.normals.clear();
  for (Vec3& p : waves.positions) p.z = 0.02F * std::sin(25 * p.x) * std::sin(20 * p.y);
  BakeOptions options = by_views(64, 0.1);
  const fs::path file = save_ply(waves, scratch_folder());
  EXPECT_TRUE(
      bake(Source(*device(), load_mesh(file)), plane(1, 1), options).report.views->height_field);
  expect_same_for_chunks(waves, plane(1, 1), {options}, {70000, 9000});
  // One face in the second block that is turned away
  std::swap(waves.triangles.back()[0], waves.triangles.back()[1]);
  expect_same_for_chunks(waves, plane(1, 1), {options}, {9000});
}

/// Triangles whose corners lie on a line, which searches in space ignore. Once corners are snapped to parts of pixels,
/// some of them cover pixels.
TEST(StreamedViews, TrianglesWithoutAnAreaInSpaceAreDrawn) {
  KILN_REQUIRE_DEVICE();
  Mesh high = BumpySphere::dense(400);
  const std::size_t solid = high.triangles.size();
  std::uint32_t bits = 1;
  const auto next = [&bits] {
    bits = bits * 1664525U + 1013904223U;
    return static_cast<float>(bits >> 16U) / 65536;
  };
  for (int i = 0; i < 3000; ++i) {
    // Halves of powers of two, so that the middle corner lies on the line between the others
    const auto grid = [&] { return std::round((next() - 0.5F) * 64) / 32; };
    const Vec3 a{grid(), grid(), grid()}, c{grid(), grid(), grid()};
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    high.positions.insert(high.positions.end(),
                          {a, {(a.x + c.x) / 2, (a.y + c.y) / 2, (a.z + c.z) / 2}, c});
    high.triangles.push_back({first, first + 1, first + 2});
  }
  const fs::path folder = scratch_folder();
  const fs::path file = save_ply(high, folder);
  const auto chunks = std::make_shared<const ChunkedMesh>(
      stream_ply(file), ChunkOptions{.triangles = 500, .folder = folder});
  ASSERT_GT(chunks->summary().unsearchable_triangles, 1000U);
  const Source whole(*device(), load_mesh(file));
  cl::Context& context = context_of(*device());
  ChunkedViews streamed(context, chunks);
  ViewedSurface& in_memory = impl_of(whole).viewed_surface();
  EXPECT_EQ(streamed.radius(), in_memory.radius());
  std::size_t drawn = 0;
  for (const kiln::Vec3d& toward : spread_directions(9)) {
    kiln_view view = make_view(toward, in_memory.radius(), 1000);
    view.flags = KILN_RASTER_TWO_SIDED;
    DepthKeys keys(context, DepthKeys::count(1000, 1000)), all(context, keys.keys.size());
    in_memory.draw(std::span(&view, 1), all);
    streamed.draw(std::span(&view, 1), keys);
    const std::vector<std::uint64_t> expected = all.picture(context, view);
    EXPECT_EQ(keys.picture(context, view), expected);
    for (const std::uint64_t key : expected) {
      const auto triangle = static_cast<std::uint32_t>(key);
      drawn += triangle != KILN_NO_TRIANGLE && triangle >= solid ? 1 : 0;
    }
    // The triangles that keys refer to, in the order of the mesh
    const auto shown = streamed.show(keys);
    const std::vector<std::uint32_t> ids = shown->ids.download(context);
    std::vector<std::uint64_t> renumbered = keys.picture(context, view);
    for (std::size_t i = 0; i < renumbered.size(); ++i) {
      if (renumbered[i] == KILN_RASTER_EMPTY) continue;
      const auto rank = static_cast<std::uint32_t>(renumbered[i]);
      ASSERT_LT(rank, ids.size());
      renumbered[i] += ids[rank] - std::uint64_t{rank};
    }
    EXPECT_EQ(renumbered, expected);
    EXPECT_EQ(shown->triangles.size(), 3 * ids.size());
  }
  EXPECT_GT(drawn, 0U);
}

/// Views side by side in one array of keys, one of which shows nothing.
TEST(StreamedViews, ViewsAreDrawnSideBySide) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = BumpySphere::dense(2000);
  const fs::path folder = scratch_folder();
  const fs::path file = save_ply(high, folder);
  const auto chunks = std::make_shared<const ChunkedMesh>(
      stream_ply(file), ChunkOptions{.triangles = 300, .folder = folder});
  const Source whole(*device(), load_mesh(file));
  cl::Context& context = context_of(*device());
  ChunkedViews streamed(context, chunks);
  constexpr std::uint32_t kSide = 150;
  const auto count = static_cast<std::uint32_t>(DepthKeys::count(kSide, kSide));
  std::vector<kiln_view> views;
  for (const double away : {0.0, 9.0, 0.0}) {
    views.push_back(make_view({0, 0, views.empty() ? 1.0 : -1.0}, 0.5, kSide, {away, 0, 0}));
    views.back().first = static_cast<std::uint32_t>(views.size()) * count;
  }
  // The first part of the keys belongs to no view.
  DepthKeys keys(context, 4 * std::size_t{count}), all(context, 4 * std::size_t{count});
  context.fill(keys.keys, std::uint64_t{7});
  context.fill(keys.drawn, std::uint8_t{1});
  impl_of(whole).viewed_surface().draw(views, all);
  streamed.draw(views, keys);
  for (const kiln_view& view : views) {
    EXPECT_EQ(keys.picture(context, view), all.picture(context, view));
  }
  std::vector<std::uint64_t> before(count);
  keys.keys.read(context, before);
  EXPECT_EQ(before, std::vector<std::uint64_t>(count, 7));
  // Nothing is shown
  DepthKeys empty(context, count);
  kiln_view away = views[1];
  away.first = 0;
  streamed.draw(std::span(&away, 1), empty);
  const auto shown = streamed.show(empty);
  EXPECT_EQ(shown->ids.size(), 1U);
  EXPECT_EQ(empty.keys.download(context), std::vector<std::uint64_t>(count, KILN_RASTER_EMPTY));
}

/// With little memory, views are drawn in several batches, each of which reads the mesh.
TEST(StreamedViews, BatchesOfViewsGiveTheSameMaps) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = BumpySphere::dense(6000);
  const fs::path folder = scratch_folder();
  const fs::path file = save_ply(high, folder);
  BakeOptions options = by_views(64, 0.15);
  options.match.views.size = 512;
  const BakeResult expected =
      bake(Source(*device(), load_mesh(file)), BumpySphere::light(), options);
  const Source source = streamed_source(
      *device(), std::make_shared<const ChunkedMesh>(
                     stream_ply(file), ChunkOptions{.triangles = 2000, .folder = folder}));
  std::string last;
  int passes = 0;
  options.progress = [&](double, std::string_view stage) {
    if (stage.starts_with("drawing part 1 of ") && stage != last) ++passes;
    last = stage;
    return true;
  };
  expect_same(expected, bake(source, BumpySphere::light(), options), "one batch");
  EXPECT_EQ(std::exchange(passes, 0), 1);
  leave_memory(std::uint64_t{80} << 20);
  const BakeResult in_batches = bake(source, BumpySphere::light(), options);
  set_memory_limit(0);
  expect_same(expected, in_batches, "several batches");
  EXPECT_GT(passes, 1);
  EXPECT_LE(passes, 12);
}

TEST(StreamedViews, AViewIsDrawnEvenWithTheLeastMemory) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder();
  const ChunkedViews views(
      context_of(*device()),
      std::make_shared<const ChunkedMesh>(stream_ply(save_ply(BumpySphere::dense(500), folder)),
                                          ChunkOptions{.triangles = 100, .folder = folder}));
  leave_memory(std::uint64_t{96} << 20);
  const std::uint32_t small = views.views_at_once(256), large = views.views_at_once(512),
                      largest = views.views_at_once(8192);
  set_memory_limit(0);
  // 8 bytes a pixel, and 48 bytes for each third
  EXPECT_GE(small, 28U);
  EXPECT_LE(small, 32U);
  EXPECT_GE(large, 7U);
  EXPECT_LE(large, 8U);
  EXPECT_EQ(largest, 1U);
}

TEST(StreamedViews, ProgressNamesThePartAndCancels) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder();
  const fs::path file = save_ply(BumpySphere::dense(2000), folder);
  const Source source = streamed_source(
      *device(), std::make_shared<const ChunkedMesh>(
                     stream_ply(file), ChunkOptions{.triangles = 300, .folder = folder}));
  BakeOptions options = by_views(64, 0.15);
  std::vector<std::string> parts;
  options.progress = [&](double, std::string_view stage) {
    if (stage.starts_with("drawing part") && (parts.empty() || stage != parts.back()))
      parts.emplace_back(stage);
    return parts.size() < 3;
  };
  EXPECT_TRUE(bake(source, BumpySphere::light(), options).cancelled);
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[1], "drawing part 2 of 7");
}

/// Each band is matched with the same views.
TEST(StreamedViews, SeveralBandsAreTheSame) {
  KILN_REQUIRE_DEVICE();
  Mesh waves = plane(60, 60);
  waves.normals.clear();
  for (Vec3& p : waves.positions) p.z = 0.05F * std::sin(25 * p.x) * std::sin(20 * p.y);
  BakeOptions options = by_views(32, 0.2);  // Two bands of 4 million samples
  options.maps = {MapKind::normal, find_map("distance").kind, find_map("provenance").kind};
  options.height = 8192;
  options.samples = 5;
  options.match.views.count = 3;
  expect_same_for_chunks(waves, strip(0.02F), {options}, {2000});
}

/// Visibility directions depend on the low poly alone; rays along them search the chunks.
TEST(StreamedViews, VisibilityDirectionsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = BumpySphere::dense(6000);
  std::vector<BakeOptions> all(5, options_for(64, false));
  for (BakeOptions& options : all) {
    options.match.method = MatchMethod::visibility;
    options.match.max_distance = Length::absolute(0.15);
    options.match.visibility.directions = 64;
  }
  all[1].match.method = MatchMethod::hybrid;
  all[1].samples = 2;
  all[2].match.visibility.clusters = 2;
  all[2].match.visibility.cluster_deviation = 0.7;
  all[3].match.method = MatchMethod::hybrid;
  all[3].match.max_distance.reset();
  all[3].match.two_sided = true;
  all[4].match.visibility.at = VisibilityAt::vertex;
  all[4].match.visibility.test = VisibilityTest::rays;
  all[4].match.fallback = {MatchMethod::closest};
  all[4].match.max_distance = Length::absolute(0.03);
  all[4].report.errors = true;
  expect_same_for_chunks(high, BumpySphere::light(), all, {high.triangles.size(), 900, 300});
  expect_same_for_chunks(sheets(), plane(2, 2), {all[0], all[1]}, {500, 33});
}

TEST(StreamedViews, NoOptionOfViewsIsRefused) {
  for (const BakeOptions& options : all_by_views(64, 0.1)) {
    EXPECT_TRUE(streaming_obstacle(options).empty()) << streaming_obstacle(options).text();
  }
}

/// Blocks of a mesh in memory and of one that is read are the same.
TEST(TriangleBlocks, AreTheSameInMemoryAndInAFile) {
  const fs::path folder = scratch_folder();
  const fs::path file = save_ply(BumpySphere::dense(150000), folder);
  const Mesh mesh = load_mesh(file);
  const auto stream = stream_ply(file);
  const TriangleBlocks whole(mesh.positions, mesh.triangles), streamed(mesh.positions, *stream);
  ASSERT_EQ(streamed.size(), whole.size());
  EXPECT_EQ(whole.size(), (mesh.triangles.size() - 1) / TriangleBlocks::kTrianglesPerBlock + 1);
  const auto blocks_of = [](const TriangleBlocks& from) {
    std::vector<std::vector<Triangle>> blocks(from.size());
    from.for_each([&](std::size_t block, std::span<const Triangle> triangles) {
      blocks[block].assign(triangles.begin(), triangles.end());
    });
    return blocks;
  };
  const auto blocks = blocks_of(whole);
  EXPECT_EQ(blocks_of(streamed), blocks);
  std::vector<Triangle> all;
  for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
  EXPECT_EQ(all, mesh.triangles);
  EXPECT_EQ(TriangleBlocks(mesh.positions, std::span<const Triangle>()).size(), 0U);
}

}  // namespace
}  // namespace kiln::test
