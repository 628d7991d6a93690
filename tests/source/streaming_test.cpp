// A high poly that is larger than memory: the maps have the bytes of a bake
// that holds all of it, for chunks of any size.
#include "bake/streaming.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "asset/ply_stream.h"
#include "base/memory.h"
#include "base/progress_guard.h"
#include "kiln/image.h"
#include "kiln/job.h"
#include "kiln/limits.h"
#include "mesh/vector.h"
#include "source/chunked_mesh.h"
#include "source/high_poly.h"
#include "source/streamed_bakes.h"
#include "source/streamed_files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

using test::error_of;
using test::expect_same_for_chunks;
using test::leave_memory;
using test::options_for;
using test::paint;
using test::ply_of;
using test::put;
using test::save_ply;
using test::sheets;
using test::strip;

/// Maps that cast rays at all of the high poly: plain, with two samples a texel, smoothed, and with the low poly and
/// another mesh as occluders.
std::vector<BakeOptions> occlusions(std::uint32_t size, const Mesh& other) {
  BakeOptions options = options_for(size, false);
  options.maps = {find_map("ao").kind, find_map("bent_normal").kind, find_map("thickness").kind,
                  find_map("shadow").kind};
  options.occlusion.rays = 24;
  options.light = {{1, 2, 3}, 20};
  std::vector<BakeOptions> all(6, options);
  all[1].samples = 2;
  all[1].occlusion.distance = Length::share(0.1);
  all[1].occlusion.falloff = OcclusionFalloff::smooth;
  all[1].occlusion.back_faces = false;
  all[2].maps = {find_map("ao").kind};
  all[2].occlusion.max_error = 1;
  all[3].maps = {find_map("ao").kind};
  all[3].occlusion.max_error = 0.01;
  all[3].report.errors = true;
  all[4].occlusion.by_low = true;
  all[4].occlusion.by_others = {&other};
  all[4].encoding.miss = MissPolicy::keep;
  all[5].maps = {find_map("ao").kind};
  all[5].occlusion.rays = 600;  // rays grouped by sample
  all[5].occlusion.by_high = false;
  all[5].occlusion.by_low = true;
  all.push_back(all[5]);  // views of the low poly
  all.back().occlusion.by = OcclusionBy::views;
  all.push_back(options);  // views that no map uses
  all.back().maps = {MapKind::normal, find_map("thickness").kind, find_map("shadow").kind};
  all.back().occlusion.by = OcclusionBy::views;
  return all;
}

/// Rays by either rule, nearest points, and rays with nearest points as their
/// fallback.
std::vector<BakeOptions> matches(std::uint32_t size, bool colors, double distance) {
  std::vector<BakeOptions> all(5, options_for(size, colors));
  for (BakeOptions& options : all) options.match.max_distance = Length::absolute(distance);
  all[1].match.ray.rule = RayRule::nearest;
  all[1].match.two_sided = true;
  all[2].match.method = find_match("closest").method;
  all[3].match.fallback = {find_match("closest").method};
  all[3].match.max_distance = Length::absolute(distance / 4);
  all[4].match.max_distance.reset();
  all[4].match.cage = Length::absolute(distance / 3);
  all[4].samples = 2;
  return all;
}

TEST(Streaming, MapsOfASmoothMeshAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(6000);
  paint(high);
  expect_same_for_chunks(
      high, test::BumpySphere::light(), matches(128, true, 0.15),
      {high.triangles.size(), high.triangles.size() / 2 + 1, high.triangles.size() / 7, 100});
}

// As in an STL: normals are smooth over vertices that lie in one place.
TEST(Streaming, NormalsAreSmoothOverSplitVertices) {
  KILN_REQUIRE_DEVICE();
  const Mesh whole = test::BumpySphere::dense(2000);
  Mesh high;
  for (const Triangle& t : whole.triangles) {
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (const std::uint32_t v : t) high.positions.push_back(whole.positions[v]);
    high.triangles.push_back({first, first + 1, first + 2});
  }
  expect_same_for_chunks(high, test::BumpySphere::light(), {options_for(64, false)}, {300});
}

// Where a chunk has many more triangles than samples, those near the samples
// are selected first.
TEST(Streaming, MapsOfFewSamplesAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(30000);
  expect_same_for_chunks(high, test::BumpySphere::light(), matches(16, false, 0.15),
                         {high.triangles.size(), 12000});
  expect_same_for_chunks(test::BumpyTorus::dense(30000), test::plane(1, 1, 3, 3),
                         {options_for(16, false)}, {20000});
}

TEST(Streaming, MapsOfAMeshWithNormalsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpyTorus::dense(5000, true);
  high.normals[17] = {};  // is computed from the faces around
  high.normals[1000] = {0, 3, 4};
  expect_same_for_chunks(high, test::torus(40, 20), matches(128, false, 0.15), {3000, 700, 64});
}

TEST(Streaming, TiesOfSheetsAreDecidedAsInOnePiece) {
  KILN_REQUIRE_DEVICE();
  Mesh high = sheets();
  paint(high);
  std::vector<BakeOptions> all = matches(64, true, 0.05);
  all.push_back(all[2]);
  all.back().match.two_sided = true;
  expect_same_for_chunks(high, test::plane(2, 2), all, {500, 33, 2});
}

TEST(Streaming, OcclusionIsTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  Mesh other = test::cube(0.3);
  for (Vec3& p : other.positions) p.z += 1.2F;
  std::vector<BakeOptions> all = occlusions(48, other);
  all.push_back(all[0]);
  all.back().maps = {find_map("ao").kind};
  all.back().occlusion.rays = 600;
  const Mesh high = test::BumpySphere::dense(6000);
  expect_same_for_chunks(high, test::BumpySphere::light(), all,
                         {high.triangles.size(), high.triangles.size() / 7, 300});
  expect_same_for_chunks(sheets(), test::plane(2, 2), occlusions(32, other), {500, 33});
}

// Each band has matched triangles of its own, and smoothed occlusion depends on where bands end.
TEST(Streaming, OcclusionOfSeveralBandsIsTheSame) {
  KILN_REQUIRE_DEVICE();
  Mesh waves = test::plane(60, 60);
  waves.normals.clear();
  for (Vec3& p : waves.positions) p.z = 0.05F * std::sin(25 * p.x) * std::sin(20 * p.y);
  BakeOptions options = options_for(32, false);  // Two bands of 4 million samples
  options.height = 8192;
  options.samples = 5;
  options.maps = {find_map("ao").kind, find_map("thickness").kind, MapKind::normal};
  options.occlusion.rays = 1;
  expect_same_for_chunks(waves, strip(0.02F), {options}, {5000});
  options = options_for(128, false);  // Two bands of a million samples
  options.height = 160;
  options.samples = 8;
  options.maps = {find_map("ao").kind};
  options.occlusion.rays = 4;
  options.occlusion.max_error = 1;
  expect_same_for_chunks(waves, strip(1), {options}, {2000});
}

TEST(Streaming, TriangleSoupIsTheSameForOneTriangleAChunk) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::random_soup(300, 3, 0.4);
  expect_same_for_chunks(high, test::cube(1.5), matches(64, false, 0.4), {1, 2, 7, 100});
}

TEST(Streaming, OpenSheetsAndHardEdgesSearchAsInOnePiece) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::icosphere(4, 0.5);
  BakeOptions far = options_for(96, false);  // no distance: open sheets of LOW search farther
  expect_same_for_chunks(high, test::plane(1, 1), {far}, {200});
  high = test::icosphere(4, 0.6);
  expect_same_for_chunks(high, test::cube(0.8), {far, matches(96, false, 0.3)[0]}, {200, 1000});
}

/// Finer samples are matched like those of the maps.
TEST(Streaming, MeasuredErrorsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(6000);
  paint(high);
  std::vector<BakeOptions> all = matches(64, true, 0.15);
  all.push_back(all[3]);  // samples that miss, several a texel
  all.back().samples = 2;
  for (BakeOptions& options : all) options.report.errors = true;
  expect_same_for_chunks(high, test::BumpySphere::light(), all,
                         {high.triangles.size(), high.triangles.size() / 7, 100});
  // 16 times as many samples are several bands
  BakeOptions large = options_for(512, false);
  large.report.errors = true;
  high = test::BumpyTorus::dense(5000, true);
  expect_same_for_chunks(high, test::torus(40, 20), {large}, {3000, 700});
}

/// The compared texels of all bands are matched together, so that the high poly
/// is read once more.
TEST(Streaming, MeasuringErrorsReadsEachChunkOnce) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const fs::path file = save_ply(test::BumpySphere::dense(2000), folder);
  const Source source = streamed_source(
      *test::device(), std::make_shared<const ChunkedMesh>(
                           stream_ply(file), ChunkOptions{.triangles = 700, .folder = folder}));
  BakeOptions options = options_for(512, false);
  options.match.ray.rule = RayRule::nearest;  // one search a band
  std::size_t chunks = 0;
  std::string last;
  options.progress = [&](double, std::string_view stage) {
    if (stage.starts_with("matching chunk") && stage != last) ++chunks;
    last = stage;
    return true;
  };
  bake(source, test::BumpySphere::light(), options);
  const std::size_t of_maps = std::exchange(chunks, 0);
  options.report.errors = true;
  const BakeResult result = bake(source, test::BumpySphere::light(), options);
  EXPECT_FALSE(result.report.errors.empty());
  // The samples are four bands and more.
  EXPECT_GT(chunks, of_maps);
  EXPECT_LE(chunks, 3 * of_maps);
}

TEST(Streaming, TheFileIsReusedUntilTheMeshChanges) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  Mesh high = test::BumpySphere::dense(500);
  const fs::path file = save_ply(high, folder);
  const auto open = [&](std::size_t size = 100) {
    return ChunkedMesh(stream_ply(file), {.triangles = size, .folder = cache});
  };
  const auto files = [&] {
    return std::distance(fs::directory_iterator(cache), fs::directory_iterator());
  };
  EXPECT_FALSE(open().was_sorted_before());
  EXPECT_TRUE(open().was_sorted_before());
  EXPECT_FALSE(open(50).was_sorted_before());
  EXPECT_EQ(files(), 2);
  // The same size, another place.
  high.positions[0].x += 0.125F;
  save_ply(high, folder);
  fs::last_write_time(file, fs::file_time_type::clock::now() + std::chrono::seconds(5));
  EXPECT_FALSE(open().was_sorted_before());
  EXPECT_EQ(files(), 3);

  // Files that nobody has used for a month go when another one is written;
  // younger ones stay.
  const auto now = fs::file_time_type::clock::now();
  std::vector<fs::path> all;
  for (const auto& entry : fs::directory_iterator(cache)) all.push_back(entry.path());
  fs::last_write_time(all[0], now - std::chrono::hours(24 * 31));
  fs::last_write_time(all[1], now - std::chrono::hours(24 * 29));
  open(30);
  EXPECT_FALSE(fs::exists(all[0]));
  EXPECT_TRUE(fs::exists(all[1]));
  EXPECT_EQ(files(), 3);
}

TEST(Streaming, ADamagedFileIsWrittenAnew) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const fs::path file = save_ply(test::BumpySphere::dense(500), folder);
  const auto open = [&] {
    return ChunkedMesh(stream_ply(file), {.triangles = 100, .folder = cache}).was_sorted_before();
  };
  EXPECT_FALSE(open());
  const fs::path chunks = fs::directory_iterator(cache)->path();
  const auto size = fs::file_size(chunks);
  fs::resize_file(chunks, size - 1);
  EXPECT_FALSE(open());
  EXPECT_TRUE(open());
  {
    std::fstream change(chunks, std::ios::binary | std::ios::in | std::ios::out);
    change.seekp(static_cast<std::streamoff>(size - 80));
    change.put('!');
  }
  EXPECT_FALSE(open());
  EXPECT_EQ(fs::file_size(chunks), size);
}

TEST(Streaming, CancellingLeavesNoFile) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const fs::path file = save_ply(test::BumpySphere::dense(500), folder);
  std::vector<std::string> stages;
  {
    ProgressGuard guard([&](double, std::string_view stage) {
      stages.emplace_back(stage);
      return stage.find("into") == std::string_view::npos;
    });
    EXPECT_THROW(ChunkedMesh(stream_ply(file), {.triangles = 100, .folder = cache}), Cancelled);
  }
  EXPECT_EQ(stages.back(), "sorting the high poly into 6 chunks");
  EXPECT_TRUE(fs::is_empty(cache));
}

TEST(Streaming, ProgressNamesTheChunkAndCancels) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const fs::path file = save_ply(test::BumpySphere::dense(2000), folder);
  const Source source = streamed_source(
      *test::device(), std::make_shared<const ChunkedMesh>(
                           stream_ply(file), ChunkOptions{.triangles = 300, .folder = folder}));
  BakeOptions options = options_for(64, false);
  std::vector<std::string> chunks;
  options.progress = [&](double, std::string_view stage) {
    // A chunk that takes long is reported again.
    if (stage.starts_with("matching chunk") && (chunks.empty() || stage != chunks.back()))
      chunks.emplace_back(stage);
    return chunks.size() < 3;
  };
  EXPECT_TRUE(bake(source, test::BumpySphere::light(), options).cancelled);
  ASSERT_EQ(chunks.size(), 3U);
  EXPECT_EQ(chunks[1].substr(0, 17), "matching chunk 2 ");
}

TEST(Streaming, WhatNeedsTheWholeMeshIsRefusedByName) {
  BakeOptions options = options_for(64, false);
  EXPECT_TRUE(streaming_obstacle(options).empty());
  options.maps = {MapKind::normal, find_map("id").kind, find_map("curvature").kind};
  EXPECT_NE(streaming_obstacle(options).text().find("the maps id and curvature need"),
            std::string::npos);
  options.maps = {find_map("ao").kind};
  EXPECT_TRUE(streaming_obstacle(options).empty());
  options = options_for(64, false);
  options.match.method = find_match("uv").method;
  EXPECT_NE(streaming_obstacle(options).text().find(
                "match by ray, views, closest, visibility, hybrid or axis"),
            std::string::npos);
  options = options_for(64, false);
  options.match.fallback = {find_match("uv").method};
  EXPECT_FALSE(streaming_obstacle(options).empty());
  options = options_for(64, false);
  options.report.keep_match = true;
  EXPECT_FALSE(streaming_obstacle(options).empty());
  options = options_for(64, true);
  options.maps.push_back(find_map("color").kind);
  EXPECT_TRUE(streaming_obstacle(options).empty());
  options.color.emplace();
  EXPECT_NE(streaming_obstacle(options).text().find("a picture of the high poly needs"),
            std::string::npos);
}

// Only maps that may show the high poly in depth views need all of it.
TEST(Streaming, OcclusionByViewsIsRefusedWhereAMapUsesIt) {
  const auto is_refused = [](const BakeOptions& options) {
    const std::string obstacle = streaming_obstacle(options).text();
    EXPECT_TRUE(obstacle.empty() || obstacle.starts_with("occlusion by views needs the whole"))
        << obstacle;
    return !obstacle.empty();
  };
  BakeOptions plain = options_for(64, false);
  plain.maps = {MapKind::normal};
  MapVariant near;
  near.name = "near";
  for (const OcclusionBy by : {OcclusionBy::views, OcclusionBy::automatic}) {
    BakeOptions options = plain;
    options.occlusion.by = by;
    EXPECT_FALSE(is_refused(options));
    for (const char* const rays : {"shadow", "thickness"}) {
      options.maps = {MapKind::normal, find_map(rays).kind};
      EXPECT_FALSE(is_refused(options)) << rays;
    }
    for (const char* const views : {"ao", "bent_normal"}) {
      options.maps = {MapKind::normal, find_map(views).kind};
      EXPECT_TRUE(is_refused(options)) << views;
      // A variant has the options of its own, or those of the bake.
      BakeOptions varied = plain;
      near.kind = options.maps[1];
      near.occlusion.emplace().by = by;
      varied.variants = {near};
      EXPECT_TRUE(is_refused(varied)) << views;
      varied.variants[0].kind = MapKind::normal;
      EXPECT_FALSE(is_refused(varied)) << views;
      varied.variants[0].kind = near.kind;
      varied.variants[0].occlusion.reset();
      EXPECT_FALSE(is_refused(varied)) << views;
      varied.occlusion.by = by;
      EXPECT_TRUE(is_refused(varied)) << views;
      varied.variants[0].occlusion.emplace();
      EXPECT_FALSE(is_refused(varied)) << views;
    }
    // Views of the low poly alone
    options.occlusion.by_low = true;
    EXPECT_TRUE(is_refused(options));
    options.occlusion.by_high = false;
    EXPECT_FALSE(is_refused(options));
  }
  // What views do not support is always gathered by rays.
  plain.maps = {find_map("ao").kind};
  plain.occlusion.by = OcclusionBy::automatic;
  EXPECT_TRUE(is_refused(plain));
  const auto with = [&](const std::function<void(OcclusionOptions&)>& change) {
    BakeOptions options = plain;
    change(options.occlusion);
    return is_refused(options);
  };
  EXPECT_FALSE(with([](OcclusionOptions& to) { to.distance = Length::share(0.1); }));
  EXPECT_FALSE(with([](OcclusionOptions& to) { to.falloff = OcclusionFalloff::smooth; }));
  EXPECT_FALSE(with([](OcclusionOptions& to) { to.back_faces = false; }));
  EXPECT_FALSE(with([](OcclusionOptions& to) { to.max_error = 1; }));
  EXPECT_FALSE(with([](OcclusionOptions& to) { to.rays = 65; }));
  EXPECT_TRUE(with([](OcclusionOptions& to) { to.rays = 64; }));
}

TEST(Streaming, ColoursWithoutAlphaAreOpaque) {
  Mesh mesh = test::tetrahedron();
  paint(mesh);
  const fs::path folder = test::scratch_folder();
  const std::size_t count = mesh.positions.size();
  std::vector<MeshStream::Color> colors(count);
  stream_ply(save_ply(mesh, folder))->read_colors(0, colors);
  EXPECT_EQ(colors, mesh.colors);
  // With alpha, in another order of the channels.
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                     std::to_string(count) +
                     "\nproperty uchar alpha\nproperty uchar blue\nproperty "
                     "float x\nproperty float "
                     "y\nproperty float z\nproperty uchar red\nproperty uchar "
                     "green\nelement face " +
                     std::to_string(mesh.triangles.size()) +
                     "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t v = 0; v < count; ++v) {
    mesh.colors[v][3] = static_cast<std::uint8_t>(40 * v);
    const MeshStream::Color& c = mesh.colors[v];
    text += {static_cast<char>(c[3]), static_cast<char>(c[2])};
    put(text, mesh.positions[v]);
    text += {static_cast<char>(c[0]), static_cast<char>(c[1])};
  }
  for (const Triangle& t : mesh.triangles) {
    text.push_back(3);
    put(text, t);
  }
  std::ofstream(folder / "alpha.ply", std::ios::binary) << text;
  const auto stream = stream_ply(folder / "alpha.ply");
  stream->read_colors(0, colors);
  EXPECT_EQ(colors, mesh.colors);
  std::vector<Vec3> positions(count);
  stream->read_positions(0, positions);
  for (std::size_t v = 0; v < count; ++v) EXPECT_EQ(positions[v].z, mesh.positions[v].z);
}

TEST(Streaming, FilesThatCannotBeReadInPartsSayWhy) {
  const fs::path folder = test::scratch_folder();
  Mesh mesh = test::tetrahedron();
  const auto write = [&](const std::string& bytes) {
    std::ofstream(folder / "high.ply", std::ios::binary) << bytes;
    return folder / "high.ply";
  };
  const std::string good = ply_of(mesh);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(ply_layout(write(good)).obstacle, "");
  EXPECT_EQ(ply_layout(write(good)).triangles, 4U);
  EXPECT_EQ(ply_layout(write(changed("binary_little", "binary_big"))).obstacle,
            "is not a binary, little-endian PLY");
  EXPECT_EQ(ply_layout(write(changed("float x", "double x"))).obstacle,
            "has coordinates that are not 32-bit floats");
  EXPECT_EQ(
      ply_layout(write(changed("property list uchar int vertex_indices",
                               "property uchar flags\nproperty list uchar int vertex_indices")))
          .obstacle,
      "has faces with more than a list of indices");
  EXPECT_EQ(
      ply_layout(write(changed("uchar int vertex_indices", "ushort int vertex_indices"))).obstacle,
      "has faces with more than a list of indices");
  EXPECT_EQ(ply_layout(write(changed("element face", "property list uchar int near\nelement face")))
                .obstacle,
            "has lists at its vertices");
  for (const char* type : {"char", "ushort", "float"}) {
    std::string colors;
    for (const char* channel : {"red", "green", "blue"})
      colors += "property " + std::string(type) + " " + channel + "\n";
    EXPECT_EQ(ply_layout(write(changed("element face", colors + "element face"))).obstacle,
              "has colours that are not 8-bit")
        << type;
  }
  EXPECT_EQ(ply_layout(write(changed("element face",
                                     "property double nx\nproperty double ny\nproperty double "
                                     "nz\nelement face")))
                .obstacle,
            "has normals that are not 32-bit floats");
  EXPECT_EQ(ply_layout(write("solid x")).obstacle, "is no PLY");
  // What the layout does not tell.
  const auto read = [&](const fs::path& file) {
    return error_of([&] { ChunkedMesh(stream_ply(file), {.folder = folder / "chunks"}); });
  };
  EXPECT_EQ(read(write(good)), "");
  std::string quad = good;
  quad[quad.size() - 13] = 4;
  EXPECT_NE(read(write(quad)).find("face 3: it has 4 corners"), std::string::npos);
  std::string beyond = good;
  beyond[beyond.size() - 4] = 9;
  EXPECT_NE(read(write(beyond)).find("face 3: it refers to vertex 9, but the file has 4"),
            std::string::npos);
  EXPECT_NE(read(write(good.substr(0, good.size() - 1))).find("truncated"), std::string::npos);
  for (Vec3& p : mesh.positions) p.x += 1e5F;
  EXPECT_NE(read(save_ply(mesh, folder)).find("far from the world's origin"), std::string::npos);
}

TEST(Streaming, OutliersAreRefusedSinceTheyMoveTheFrame) {
  const fs::path folder = test::scratch_folder();
  Mesh mesh = test::BumpySphere::dense(5000);
  const auto last = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{1e6F, 0, 0}, {-1e6F, 0, 0}, {0, 1, 0}});
  mesh.triangles.push_back({last, last + 1, last + 2});
  const fs::path file = save_ply(mesh, folder);
  EXPECT_NE(error_of([&] {
              ChunkedMesh(stream_ply(file), {.folder = folder / "chunks"});
            }).find("remove the farthest ones"),
            std::string::npos);
}

TEST(Streaming, SmoothNormalsInPlaceOfTheFilesAreRefused) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh mesh = test::BumpySphere::dense(1500000, true);
  mesh.normal_triangles.clear();
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  Job job;
  job.high = {save_ply(mesh, folder)};
  job.low = test::BumpySphere::light();
  job.bake = options_for(16, false);
  job.in_memory = true;
  job.frame.shading.rule = ShadingRule::smooth;
  const std::string error = error_of([&] {
    leave_memory(std::uint64_t{100} << 20);
    run(*test::device(), job);
  });
  set_memory_limit(0);
  EXPECT_NE(error.find("shading = smooth needs the whole high poly in memory"), std::string::npos)
      << error;
}

TEST(Streaming, AJobStreamsWhereTheMemoryLimitAsksForIt) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const fs::path file = save_ply(test::BumpySphere::dense(1500000), folder);
  Job job;
  job.high = {file};
  job.low = test::BumpySphere::light();
  job.bake = options_for(128, false);
  job.in_memory = true;
  const JobResult whole = run(*test::device(), job);
  EXPECT_EQ(whole.report.find("\"streamed\""), std::string::npos);
  leave_memory(std::uint64_t{440} << 20);
  const JobResult streamed = run(*test::device(), job);
  job.bake.maps.push_back(find_map("curvature").kind);
  const std::string error = error_of([&] {
    leave_memory(std::uint64_t{100} << 20);
    run(*test::device(), job);
  });
  set_memory_limit(0);
  EXPECT_NE(streamed.report.find("\"streamed\""), std::string::npos);
  ASSERT_EQ(whole.maps.size(), streamed.maps.size());
  for (std::size_t m = 0; m < whole.maps.size(); ++m) {
    EXPECT_EQ(whole.maps[m].map.image.pixels, streamed.maps[m].map.image.pixels)
        << whole.maps[m].name;
  }
  EXPECT_NE(error.find("larger than memory, and the map curvature needs the whole high poly"),
            std::string::npos)
      << error;
}

/// Assets need the whole mesh for pictures alone.
TEST(Streaming, AnAssetStreamsWithColoursAndNormals) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = test::BumpySphere::dense(1500000);
  paint(high);
  Job job;
  job.high = {save_ply(high, folder)};
  job.low = test::BumpySphere::light();
  job.bake.width = job.bake.height = 128;
  job.bake.maps = {MapKind::normal, find_map("color").kind};
  job.given = {"--maps"};
  job.out = "game.glb";
  job.in_memory = true;
  job.clean = CleanHigh::none;
  job.frame.shading.rule = ShadingRule::smooth;
  const JobResult whole = run(*test::device(), job);
  const auto streamed = [&](std::uint64_t bytes = std::uint64_t{440} << 20) {
    leave_memory(bytes);
    const JobResult result = run(*test::device(), job);
    set_memory_limit(0);
    EXPECT_NE(result.report.find("\"streamed\""), std::string::npos);
    return result;
  };
  // The JSON of a GLB, and its meshes and pictures
  const auto head = [](const JobResult& result) {
    std::uint32_t length = 0;
    std::memcpy(&length, &result.glb.at(12), sizeof length);
    return std::string(reinterpret_cast<const char*>(&result.glb.at(20)), length);
  };
  const auto body = [&](const JobResult& result) {
    return std::vector<std::byte>(
        result.glb.begin() + 20 + static_cast<std::ptrdiff_t>(head(result).size()),
        result.glb.end());
  };
  const auto pictures = [&](const JobResult& result) {
    const std::string json = head(result);
    std::size_t count = 0;
    for (auto at = json.find("mimeType"); at != json.npos; at = json.find("mimeType", at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(pictures(whole), 2U);
  EXPECT_EQ(body(streamed()), body(whole));
  // The maps that Kiln chooses, and a low poly that it makes
  job.given.clear();
  job.bake.maps = {};
  job.low = JobLow();
  job.low.make.faces = 500;
  const JobResult made = streamed(std::uint64_t{540} << 20);
  EXPECT_EQ(pictures(made), 3U);  // normal, ao and color
  // What needs all of the mesh
  const auto refused = [&](const Job& with) {
    const std::string error = error_of([&] {
      leave_memory(std::uint64_t{100} << 20);
      run(*test::device(), with);
    });
    set_memory_limit(0);
    return error;
  };
  Job other = job;
  other.bake.maps = {find_map("curvature").kind};
  other.given = {"--maps"};
  EXPECT_NE(refused(other).find("the map curvature needs the whole"), std::string::npos);
  other = job;
  other.low = test::BumpySphere::light();
  other.max_bytes = 100000;
  EXPECT_NE(refused(other).find("needs the whole high poly"), std::string::npos) << refused(other);
  other.max_bytes = 0;
  save_image(Image{2, 2, 1, {0, 0, 1, 1}}, folder / "picture.png", {ImageFormat::png8});
  other.transfers = {(folder / "picture.png").string() + ":relief"};
  EXPECT_NE(refused(other).find("needs the whole high poly"), std::string::npos) << refused(other);
}

TEST(Streaming, PicturesOfAPlyAreSeen) {
  const fs::path folder = test::scratch_folder();
  std::string text = ply_of(test::tetrahedron());
  const auto write = [&] {
    std::ofstream(folder / "high.ply", std::ios::binary) << text;
    return ply_layout(folder / "high.ply");
  };
  EXPECT_FALSE(write().has_pictures);
  const std::string line = "comment TextureFile a.png\n";
  text.insert(text.find("element vertex"), line);
  EXPECT_FALSE(write().has_pictures);  // without UVs
  text.insert(text.find("property float y"), "property float s\nproperty float t\n");
  EXPECT_TRUE(write().has_pictures);
  text.erase(text.find(line), line.size());
  EXPECT_FALSE(write().has_pictures);
}

}  // namespace
}  // namespace kiln
