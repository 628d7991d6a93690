// Bakes from a high poly in chunks, compared with bakes that hold all of it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "asset/ply_stream.h"
#include "kiln/bake.h"
#include "kiln/map.h"
#include "kiln/mesh.h"
#include "source/chunked_mesh.h"
#include "source/high_poly.h"
#include "source/streamed_files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {

inline void paint(Mesh& mesh) {
  std::mt19937 random(7);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const auto bits = random();
    mesh.colors.push_back({static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8U),
                           static_cast<std::uint8_t>(bits >> 16U), 255});
  }
}

/// Appends a mesh, moved.
inline void add(Mesh& to, const Mesh& other, const Vec3& by) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  for (const Vec3& p : other.positions)
    to.positions.push_back({p.x + by.x, p.y + by.y, p.z + by.z});
  for (const Triangle& t : other.triangles) {
    to.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// Sheets that lie on one another, some of them twice, with vertices where
/// texels' centres are: nearly every search has several equal results.
inline Mesh sheets() {
  Mesh mesh;
  Mesh sheet = plane(12, 12);
  sheet.normals.clear();
  Mesh turned = sheet;
  std::reverse(turned.triangles.begin(), turned.triangles.end());
  for (Triangle& t : turned.triangles) t = {t[1], t[2], t[0]};
  add(mesh, sheet, {0, 0, 0.01F});
  add(mesh, turned, {0, 0, 0.01F});
  add(mesh, sheet, {0, 0, -0.01F});
  add(mesh, turned, {0.01F, 0, 0.012F});
  for (Triangle t : sheet.triangles) {  // the backs of the first sheet, on its own vertices
    std::swap(t[0], t[1]);
    mesh.triangles.push_back(t);
  }
  mesh.triangles.push_back({0, 0, 1});  // no area
  return mesh;
}

inline BakeOptions options_for(std::uint32_t size, bool colors) {
  BakeOptions options;
  options.width = options.height = size;
  options.maps = {MapKind::normal};
  for (const char* const name : {"normal_object", "height", "position", "distance", "displacement",
                                 "slope", "wireframe", "provenance", "mask"}) {
    options.maps.push_back(find_map(name).kind);
  }
  if (colors) options.maps.push_back(find_map("vertex_color").kind);
  options.report.recall = 0;
  return options;
}

inline void expect_same_views(const std::optional<ViewReport>& expected,
                              const std::optional<ViewReport>& views, const std::string& what) {
  ASSERT_EQ(expected.has_value(), views.has_value()) << what;
  if (!views) return;
  EXPECT_EQ(expected->directions, views->directions) << what;
  EXPECT_EQ(expected->coverage, views->coverage) << what;
  EXPECT_EQ(expected->size, views->size) << what;
  EXPECT_EQ(expected->pixel, views->pixel) << what;
  EXPECT_EQ(expected->undersampled, views->undersampled) << what;
  EXPECT_EQ(expected->height_field, views->height_field) << what;
}

inline void expect_same(const BakeResult& expected, const BakeResult& result,
                        const std::string& what) {
  ASSERT_EQ(expected.maps.size(), result.maps.size()) << what;
  EXPECT_EQ(expected.coverage, result.coverage) << what;
  EXPECT_EQ(expected.report.missed, result.report.missed) << what;
  EXPECT_EQ(expected.report.samples, result.report.samples) << what;
  // Summed band by band, and bands of a streamed high poly have more samples.
  EXPECT_DOUBLE_EQ(expected.report.mean_abs_distance, result.report.mean_abs_distance) << what;
  expect_same_views(expected.report.views, result.report.views, what);
  ASSERT_EQ(expected.report.errors.size(), result.report.errors.size()) << what;
  for (std::size_t e = 0; e < result.report.errors.size(); ++e) {
    const MapError &a = expected.report.errors[e], &b = result.report.errors[e];
    EXPECT_EQ(a.kind.name, b.kind.name) << what;
    EXPECT_EQ(a.texels, b.texels) << what << ", " << a.kind.name;
    EXPECT_EQ(a.mean, b.mean) << what << ", " << a.kind.name;
    EXPECT_EQ(a.rms, b.rms) << what << ", " << a.kind.name;
    EXPECT_EQ(a.p95, b.p95) << what << ", " << a.kind.name;
    EXPECT_EQ(a.max, b.max) << what << ", " << a.kind.name;
  }
  for (std::size_t m = 0; m < expected.maps.size(); ++m) {
    const std::vector<float>&a = expected.maps[m].image.pixels, &b = result.maps[m].image.pixels;
    ASSERT_EQ(a.size(), b.size()) << what;
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0)
        << what << ", " << expected.maps[m].kind.name;
    ASSERT_EQ(expected.maps[m].ranges.size(), result.maps[m].ranges.size()) << what;
    for (std::size_t c = 0; c < result.maps[m].ranges.size(); ++c) {
      EXPECT_EQ(expected.maps[m].ranges[c].low, result.maps[m].ranges[c].low) << what;
      EXPECT_EQ(expected.maps[m].ranges[c].high, result.maps[m].ranges[c].high) << what;
    }
  }
}

/// Bakes from a file in one piece, and in chunks of several sizes.
inline void expect_same_for_chunks(const Mesh& high, const Mesh& low,
                                   const std::vector<BakeOptions>& all_options,
                                   const std::vector<std::size_t>& sizes) {
  const std::filesystem::path folder = scratch_folder();
  const std::filesystem::path file = save_ply(high, folder);
  const Source whole(*device(), load_mesh(file));
  std::vector<BakeResult> expected;
  for (const BakeOptions& options : all_options) expected.push_back(bake(whole, low, options));
  for (const std::size_t size : sizes) {
    const auto chunks = std::make_shared<const ChunkedMesh>(
        stream_ply(file), ChunkOptions{.triangles = size, .folder = folder / "chunks"});
    EXPECT_GE(chunks->size() * size,
              high.triangles.size() - chunks->summary().unsearchable_triangles);
    const Source source = streamed_source(*device(), chunks);
    EXPECT_EQ(source.stats().triangles, whole.stats().triangles);
    EXPECT_EQ(source.stats().skipped_triangles, whole.stats().skipped_triangles);
    EXPECT_EQ(source.stats().diagonal, whole.stats().diagonal);
    for (std::size_t o = 0; o < all_options.size(); ++o) {
      expect_same(expected[o], bake(source, low, all_options[o]),
                  std::to_string(size) + " triangles a chunk, options " + std::to_string(o));
    }
  }
}

/// A plane whose UVs are a strip of `width` of the map's width: bands of whole rows have few samples each.
inline Mesh strip(float width) {
  Mesh mesh = plane(2, 2);
  for (Vec2& uv : mesh.uvs) uv.x = 0.5F + (uv.x - 0.5F) * width;
  return mesh;
}

}  // namespace kiln::test
