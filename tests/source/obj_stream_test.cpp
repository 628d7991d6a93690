// An OBJ that is larger than memory: its lists are those of a whole read, and
// so are the maps.
#include "asset/obj_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/formatted.h"
#include "base/progress_guard.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/job.h"
#include "kiln/limits.h"
#include "kiln/map.h"
#include "kiln/mesh.h"
#include "kiln/source.h"
#include "source/chunked_mesh.h"
#include "source/high_poly.h"
#include "source/streamed_files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

using test::error_of;
using test::leave_memory;

fs::path write(const std::string& text, const fs::path& file) {
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

std::string numbers(const Vec3& p) { return formatted(" %.7g %.7g %.7g", p.x, p.y, p.z); }

/// How obj_of() writes a mesh.
struct ObjStyle {
  bool normals = false, uvs = false, negative = false, groups = false;
  int colors = 0;  ///< 1: fractions, 2: bytes
  /// Normals are numbered backwards, so that corners have other indices than
  /// their vertices
  bool reversed_normals = false;
};

std::string obj_of(const Mesh& mesh, const ObjStyle& style) {
  const std::size_t count = mesh.positions.size();
  std::string text = "# large\nmtllib a.mtl\no part\n";
  for (std::size_t v = 0; v < count; ++v) {
    text += "v" + numbers(mesh.positions[v]);
    const auto channel = [&](std::size_t k) { return (7 * v + 50 * k) % 256; };
    for (std::size_t k = 0; k < 3 && style.colors != 0; ++k) {
      text += style.colors == 1 ? formatted(" %.6f", static_cast<double>(channel(k)) / 255)
                                : " " + std::to_string(channel(k));
    }
    text += "\n";
  }
  if (style.uvs) text += "vt 0.25 0.5\nvt 1 0\n";
  for (std::size_t v = 0; v < count && style.normals; ++v) {
    const std::size_t of = style.reversed_normals ? count - 1 - v : v;
    text += "vn" + numbers(mesh.normals[of]) + "\n";
  }
  const auto index = [&](std::size_t i) {
    return std::to_string(style.negative ? static_cast<long>(i) - static_cast<long>(count)
                                         : static_cast<long>(i) + 1);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (style.groups && t % 100 == 0) {
      text +=
          "g group" + std::to_string(t / 100) + "\nusemtl m" + std::to_string(t % 3) + "\ns 1\n";
    }
    text += "f";
    for (const std::uint32_t v : mesh.triangles[t]) {
      text += " " + index(v);
      if (style.uvs || style.normals) text += "/" + std::string(style.uvs ? "1" : "");
      if (style.normals) text += "/" + index(style.reversed_normals ? count - 1 - v : v);
    }
    text += t % 50 == 0 ? " \\\n  # a comment\n" : "\r\n";
  }
  return text;
}

template <typename T, typename Read>
std::vector<T> read_list(std::size_t count, const Read& read) {
  std::vector<T> list(count);
  // From the middle on, and what is before it
  const std::size_t first = count / 2;
  read(first, std::span(list).subspan(first));
  read(0, std::span(list).first(first));
  return list;
}

template <typename T>
bool equal_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

/// Expects the lists of load_mesh().
void expect_mesh(const fs::path& file, const fs::path& cache) {
  const Mesh whole = load_mesh(file);
  EXPECT_EQ(obj_layout(file).obstacle, "");
  const auto stream = stream_obj(file, cache);
  EXPECT_EQ(stream->name(), whole.name);
  ASSERT_EQ(stream->vertex_count(), whole.positions.size());
  ASSERT_EQ(stream->triangle_count(), whole.triangles.size());
  ASSERT_EQ(stream->has_normals(), !whole.normals.empty());
  ASSERT_EQ(stream->has_colors(), !whole.colors.empty());
  EXPECT_TRUE(equal_bytes(whole.positions,
                          read_list<Vec3>(whole.positions.size(), [&](auto first, auto to) {
                            stream->read_positions(first, to);
                          })));
  const auto triangles = [&](auto first, auto to) { stream->read_triangles(first, to); };
  EXPECT_EQ(whole.triangles, read_list<Triangle>(whole.triangles.size(), triangles));
  if (stream->has_normals()) {
    ASSERT_TRUE(stream->has_normal_indices());
    ASSERT_EQ(stream->normal_count(), whole.normals.size());
    EXPECT_TRUE(
        equal_bytes(whole.normals, read_list<Vec3>(whole.normals.size(), [&](auto first, auto to) {
                      stream->read_normals(first, to);
                    })));
    const auto corners = [&](auto first, auto to) { stream->read_normal_triangles(first, to); };
    EXPECT_EQ(whole.normal_triangles, read_list<Triangle>(whole.triangles.size(), corners));
  }
  if (stream->has_colors()) {
    EXPECT_EQ(whole.colors,
              read_list<MeshStream::Color>(whole.positions.size(), [&](auto first, auto to) {
                stream->read_colors(first, to);
              }));
  }
}

TEST(ObjStream, ListsAreThoseOfAWholeRead) {
  const fs::path folder = test::scratch_folder();
  const Mesh plain = test::BumpySphere::dense(3000);
  const Mesh shaded = test::BumpyTorus::dense(3000, true);
  const auto check = [&](const Mesh& mesh, const ObjStyle& style, const std::string& name) {
    SCOPED_TRACE(name);
    expect_mesh(write(obj_of(mesh, style), folder / name), folder / "chunks");
  };
  check(plain, {}, "plain.obj");
  check(plain, {.uvs = true, .groups = true}, "groups.obj");
  check(plain, {.negative = true, .colors = 1}, "fractions.obj");
  check(plain, {.colors = 2}, "bytes.OBJ");
  check(shaded, {.normals = true}, "normals.obj");
  check(shaded,
        {.normals = true, .uvs = true, .negative = true, .colors = 2, .reversed_normals = true},
        "all.obj");
}

TEST(ObjStream, LongFilesAreReadInPieces) {
  const fs::path folder = test::scratch_folder();
  // 24 MB: two pieces, and several blocks of each list
  const Mesh mesh = test::BumpyTorus::dense(240000, true);
  const fs::path file = write(
      obj_of(mesh, {.normals = true, .negative = true, .colors = 1, .reversed_normals = true}),
      folder / "long.obj");
  ASSERT_GT(fs::file_size(file), std::uintmax_t{20'000'000});
  expect_mesh(file, folder / "chunks");
}

TEST(ObjStream, LinesThatABackslashJoinsStayInOnePiece) {
  const fs::path folder = test::scratch_folder();
  constexpr std::size_t kPieceBytes = std::size_t{1} << 24;
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n#";
  text.resize(kPieceBytes - 11, '.');
  text += "\nf 1 2 \\\n 3\nf 1 3 2\n";  // The first piece ends behind the
                                        // backslash's line
  expect_mesh(write(text, folder / "joined.obj"), folder / "chunks");
  const std::string error = error_of(
      [&] { stream_obj(write(text + "f 1 2 x\n", folder / "bad.obj"), folder / "chunks"); });
  EXPECT_NE(error.find("line 8: face 2 has \"x\""), std::string::npos) << error;
}

TEST(ObjStream, PolygonsAreCutAsInAWholeRead) {
  const fs::path folder = test::scratch_folder();
  std::string text;
  for (int y = 0; y <= 20; ++y) {
    for (int x = 0; x <= 20; ++x) {
      const double u = 0.05 * x + 0.013 * ((x * 7 + y * 3) % 3), v = 0.05 * y;
      text += formatted("v %.9g %.9g %.9g\nvn %d 1 8\n", u, v, 0.1 * ((x * y) % 4), x - 10);
    }
  }
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) {
      const int a = 21 * y + x + 1, b = a + 1, c = a + 22, d = a + 21;
      text += x % 5 == 0 ? formatted("f %d//%d %d//%d %d//%d\n", a, a, b, b, c, c)
                         : formatted("f %d//%d %d//%d %d//%d %d//%d\n", a, a, b, b, c, c, d, d);
    }
  }
  text += "f 1//1 2//2 3//3 25//25 45//45 44//44 22//22\nf 1//1 2//2\n";
  for (const Triangulation rule :
       {Triangulation::automatic, Triangulation::blender, Triangulation::shortest}) {
    const fs::path file = write(text, folder / "quads.obj");
    const Mesh whole = load_mesh(file, {.triangulation = rule});
    const auto stream = stream_obj(file, folder / "chunks", {.triangulation = rule});
    ASSERT_EQ(stream->triangle_count(), whole.triangles.size());
    std::vector<Triangle> triangles(whole.triangles.size()), normals(whole.triangles.size());
    stream->read_triangles(0, triangles);
    stream->read_normal_triangles(0, normals);
    EXPECT_EQ(triangles, whole.triangles);
    EXPECT_EQ(normals, whole.normal_triangles);
    std::vector<Vec3> list(whole.normals.size());  // Of any length in the file
    stream->read_normals(0, list);
    EXPECT_TRUE(equal_bytes(list, whole.normals));
  }
}

TEST(ObjStream, SamplesOfLinesTellTheLayout) {
  const fs::path folder = test::scratch_folder();
  const auto layout = [&](const Mesh& mesh, const ObjStyle& style) {
    return obj_layout(write(obj_of(mesh, style), folder / "high.obj"));
  };
  const Mesh small = test::BumpySphere::dense(2000), large = test::BumpyTorus::dense(100000, true);
  EXPECT_EQ(layout(small, {}).triangles, small.triangles.size());
  for (const ObjStyle& style :
       {ObjStyle{}, ObjStyle{.normals = true}, ObjStyle{.uvs = true, .colors = 2}}) {
    const ObjLayout found = layout(large, style);
    const auto triangles = static_cast<double>(large.triangles.size());
    EXPECT_NEAR(static_cast<double>(found.triangles), triangles, 0.15 * triangles);
    EXPECT_EQ(found.has_normals, style.normals);
    EXPECT_EQ(found.has_pictures, style.uvs);
    EXPECT_EQ(found.obstacle, "");
  }
}

TEST(ObjStream, MapsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const Mesh low = test::torus(40, 20);
  Mesh mesh = test::BumpyTorus::dense(6000, true);
  mesh.normals[17] = {};  // is computed from the faces around
  for (const ObjStyle& style : {ObjStyle{.normals = true, .colors = 2, .reversed_normals = true},
                                ObjStyle{.negative = true, .groups = true, .colors = 1}}) {
    const fs::path file = write(obj_of(mesh, style), folder / "high.obj");
    fs::last_write_time(
        file, fs::file_time_type::clock::now() + std::chrono::seconds(style.normals ? 1 : 2));
    const Source whole(*test::device(), load_mesh(file));
    BakeOptions options;
    options.width = options.height = 128;
    options.report.recall = 0;
    options.match.max_distance = Length::absolute(0.15);
    options.maps = {MapKind::normal, find_map("height").kind, find_map("vertex_color").kind};
    for (const auto& [method, side] :
         {std::pair(MatchMethod::ray, 128U), std::pair(MatchMethod::closest, 128U),
          std::pair(MatchMethod::ray, 16U)}) {  // Few triangles match
      options.match.method = method;
      options.width = options.height = side;
      const BakeResult expected = bake(whole, low, options);
      for (const std::size_t size : {1000000U, 3000U, 700U, 64U}) {
        const Source source = streamed_source(
            *test::device(), std::make_shared<const ChunkedMesh>(
                                 stream_obj(file, folder / "chunks"),
                                 ChunkOptions{.triangles = size, .folder = folder / "chunks"}));
        const BakeResult result = bake(source, low, options);
        ASSERT_EQ(result.maps.size(), expected.maps.size());
        EXPECT_EQ(result.coverage, expected.coverage);
        for (std::size_t m = 0; m < result.maps.size(); ++m) {
          EXPECT_EQ(result.maps[m].image.pixels, expected.maps[m].image.pixels)
              << size << ' ' << result.maps[m].kind.name;
        }
      }
    }
  }
}

TEST(ObjStream, TheFileIsReusedUntilTheMeshChanges) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const Mesh mesh = test::BumpySphere::dense(2000);
  const fs::path file = write(obj_of(mesh, {}), folder / "high.obj");
  std::size_t parsed = 0;
  const auto open = [&](const ParsingRules& options = {}) {
    parsed = 0;
    ProgressGuard guard([&](double, std::string_view stage) {
      parsed += stage.starts_with("parsing the high poly, piece ") ? 1 : 0;
      return true;
    });
    return stream_obj(file, cache, options)->triangle_count();
  };
  EXPECT_EQ(open(), mesh.triangles.size());
  EXPECT_GE(parsed, 1U);
  EXPECT_EQ(open(), mesh.triangles.size());
  EXPECT_EQ(parsed, 0U);
  open({.triangulation = Triangulation::fan});
  EXPECT_GE(parsed, 1U) << "polygons would be cut in another way";
  // A damaged file
  open();
  for (const auto& entry : fs::directory_iterator(cache)) {
    fs::resize_file(entry.path(), fs::file_size(entry.path()) - 1);
  }
  EXPECT_EQ(open(), mesh.triangles.size());
  EXPECT_GE(parsed, 1U);
  write(obj_of(test::BumpySphere::dense(1000), {}), file);
  EXPECT_LT(open(), mesh.triangles.size());
  // Cancelled: no file
  fs::remove_all(cache);
  {
    ProgressGuard guard([](double, std::string_view) { return false; });
    EXPECT_THROW(stream_obj(file, cache), Cancelled);
  }
  EXPECT_TRUE(!fs::exists(cache) || fs::is_empty(cache));
}

TEST(ObjStream, WhatAWholeReadAloneAllowsIsRefusedByLine) {
  const fs::path folder = test::scratch_folder();
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n";
  const auto error = [&](const std::string& text, const ParsingRules& options = {}) {
    fs::remove_all(folder / "chunks");
    const fs::path file = write(text, folder / "bad.obj");
    return error_of([&] { stream_obj(file, folder / "chunks", options); });
  };
  const auto expect = [&](const std::string& text, const std::string& problem) {
    const std::string found = error(text);
    EXPECT_NE(found.find(problem), std::string::npos) << found;
    EXPECT_TRUE(!fs::exists(folder / "chunks") || fs::is_empty(folder / "chunks"));
  };
  EXPECT_EQ(error(corners + "f 1 2 3\nf 1 3 4\n"), "");
  EXPECT_EQ(error(corners + "f 1//1 2//1 3//1 4//1\n"), "");
  EXPECT_EQ(error(corners + "s off\nf 1 2 3\ns 0\nf 1 3 4\n"), "");
  expect(corners + "f 1 2 3 4\n", "line 6: it has polygons without normals");
  expect(corners + "vn 0 0 0\nf 1//1 2//1 3//1 4//1\n", "line 7: it has polygons, and normals");
  expect(corners + "f 1 2 9\n", "line 6: a face stands before its vertices");
  expect(corners + "f 1//1 2//1 3//2\n", "line 6: a face stands before its vertices");
  expect(corners + "f 1//1 2//1 3//1\nf 1 3 4\n", "line 7: some of its corners have normals");
  expect(corners + "f 1 2 3\nf 1//1 3//1 4//1\n", "line 7: some of its corners have normals");
  expect(corners + "f 1//1 2//1 3\n", "line 6: some of its corners have normals");
  expect(corners + "s 1\nf 1 2 3\ns 2\nf 1 3 4\n", "several smoothing groups, but no normals");
  expect("v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ff102030ff102030ff102030\nf 1 2 3\n", "#MRGB");
  expect(corners + "g skin UCX_part\nf 1 2 3\n", "line 6: it has a collision hull");
  EXPECT_EQ(error(corners + "g skin UCX_part\nf 1 2 3\n", {.keep_hulls = true}), "");
  expect(corners + "f 1 2\n", "no faces");
  expect(corners + "f 1 2 x\n", "line 6: face 0 has \"x\"");
  expect(corners + "f 1 2 -5\n", "line 6: face 0 uses vertex -5");
  expect(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2.1 2.3 0.7\nv 4.2 4.6 1.4\nv 6.3 6.9 "
      "2.1\nf 1 2 3\nf 4 5 6\n",
      "triangles without an area");
  const std::string utf16{'\xFF', '\xFE', 'v', '\0', ' ', '\0'};
  EXPECT_EQ(obj_layout(write(utf16, folder / "wide.obj")).obstacle,
            "is an OBJ that is not in UTF-8");
}

TEST(ObjStream, AJobStreamsWhereTheMemoryLimitAsksForIt) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const Mesh mesh = test::BumpySphere::dense(1500000, true);
  Job job;
  job.high = {write(obj_of(mesh, {.normals = true}), folder / "high.obj")};
  job.low = test::BumpySphere::light();
  job.bake.width = job.bake.height = 128;
  job.bake.maps = {MapKind::normal, find_map("position").kind};
  job.in_memory = true;
  job.clean = CleanHigh::none;
  const JobResult whole = run(*test::device(), job);
  EXPECT_EQ(whole.report.find("\"streamed\""), std::string::npos);
  leave_memory(std::uint64_t{440} << 20);
  const JobResult streamed = run(*test::device(), job);
  job.frame.shading.rule = ShadingRule::smooth;
  const std::string error = error_of([&] {
    leave_memory(std::uint64_t{100} << 20);
    run(*test::device(), job);
  });
  set_memory_limit(0);
  EXPECT_NE(streamed.report.find("\"streamed\": true"), std::string::npos);
  ASSERT_EQ(whole.maps.size(), streamed.maps.size());
  for (std::size_t m = 0; m < whole.maps.size(); ++m) {
    EXPECT_EQ(whole.maps[m].map.image.pixels, streamed.maps[m].map.image.pixels)
        << whole.maps[m].name;
  }
  EXPECT_NE(error.find("shading = smooth needs the whole high poly in memory"), std::string::npos)
      << error;
}

}  // namespace
}  // namespace kiln
