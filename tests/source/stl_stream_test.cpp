// An STL that is larger than memory: its joined vertices are those of a whole read, and so are the maps.
#include "asset/stl_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
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
using test::put;

std::string stl_of(const Mesh& mesh, const std::string& head = "binary") {
  std::string text = head;
  text.resize(80);
  put(text, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    put(text, Vec3{});
    for (const std::uint32_t v : t) put(text, mesh.positions[v]);
    put(text, std::uint16_t{0});
  }
  return text;
}

void put_float(std::ostream& to, float value) {
  std::array<char, sizeof value> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  to.write(bytes.data(), bytes.size());
}

fs::path write(const std::string& bytes, const fs::path& file) {
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

/// How text_of() writes a mesh.
struct TextStyle {
  const char* end_of_line = "\n";
  bool upper_case = false, indented = false;
  int digits = 9;
};

std::string text_of(const Mesh& mesh, const TextStyle& style = {}) {
  std::string text = "solid a part\n";
  const std::string indent = style.indented ? "\t  " : "";
  for (const Triangle& t : mesh.triangles) {
    text += indent + "facet normal 0 0 1\n" + indent + "outer loop\n";
    for (const std::uint32_t v : t) {
      text += indent + "vertex";
      for (const float value : {mesh.positions[v].x, mesh.positions[v].y, mesh.positions[v].z}) {
        text += formatted(" %.*g", style.digits, static_cast<double>(value));
      }
      text += "\n";
    }
    text += indent + (t[0] % 2 == 0 ? "endloop\n" : "end loop\n") + indent +
            (t[0] % 3 == 0 ? "end facet\n" : "endfacet\n");
  }
  text += "endsolid a part\n";
  if (style.upper_case) {
    for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  std::string lines;
  for (const char c : text) c == '\n' ? lines += style.end_of_line : lines += c;
  return lines;
}

/// Expects the vertices and triangles of load_mesh().
void expect_mesh(const fs::path& file, const fs::path& cache) {
  const Mesh whole = load_mesh(file);
  ASSERT_EQ(stl_layout(file).obstacle, "");
  if (!stl_layout(file).is_text) {
    ASSERT_EQ(stl_layout(file).triangles, whole.triangles.size());
  }
  const auto stream = stream_stl(file, cache);
  EXPECT_EQ(stream->name(), whole.name);
  EXPECT_FALSE(stream->has_normals());
  EXPECT_FALSE(stream->has_colors());
  ASSERT_EQ(stream->vertex_count(), whole.positions.size());
  ASSERT_EQ(stream->triangle_count(), whole.triangles.size());
  std::vector<Vec3> positions(whole.positions.size());
  std::vector<Triangle> triangles(whole.triangles.size());
  stream->read_positions(0, positions);
  stream->read_triangles(0, triangles);
  EXPECT_EQ(triangles, whole.triangles);
  EXPECT_EQ(std::memcmp(positions.data(), whole.positions.data(), positions.size() * sizeof(Vec3)),
            0);
  // From the middle on
  const std::size_t first = positions.size() / 2;
  std::vector<Vec3> part(positions.size() - first);
  stream->read_positions(first, part);
  EXPECT_EQ(std::memcmp(part.data(), &positions[first], part.size() * sizeof(Vec3)), 0);
  std::vector<Triangle> last(1);
  stream->read_triangles(triangles.size() - 1, last);
  EXPECT_EQ(last[0], triangles.back());
}

/// Zeros of both signs, values that are no numbers, triangles without area, and vertices that no others share.
Mesh odd_mesh() {
  Mesh mesh = test::BumpySphere::dense(3000);
  mesh.positions[0] = {0.0F, -0.0F, 0.5F};
  mesh.positions[1] = {-0.0F, 0.0F, 0.5F};
  mesh.positions[2] = {std::numeric_limits<float>::quiet_NaN(), 0, 0};
  mesh.triangles.push_back({5, 5, 6});
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i < 9000; ++i) {
    mesh.positions.push_back({0.001F * static_cast<float>(i % 97), 0.002F * static_cast<float>(i),
                              static_cast<float>(i % 3)});
  }
  // Vertices that differ in z alone
  for (int i = 0; i < 6000; ++i)
    mesh.positions.push_back({0.25F, 0.25F, 0.0005F * static_cast<float>(i)});
  for (std::uint32_t i = 0; i < 15000; i += 3) {
    mesh.triangles.push_back({first + i, first + i + 1, first + i + 2});
  }
  return mesh;
}

TEST(StlStream, JoinsVerticesAsAWholeReadDoes) {
  const fs::path folder = test::scratch_folder();
  expect_mesh(write(stl_of(odd_mesh()), folder / "odd.stl"), folder / "chunks");
  expect_mesh(write(stl_of(test::tetrahedron()), folder / "small.STL"), folder / "chunks");
  // Several pieces; every vertex is shared
  expect_mesh(write(stl_of(test::BumpySphere::dense(600000)), folder / "large.stl"),
              folder / "chunks");
}

TEST(StlStream, TextsAreParsedAsInAWholeRead) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  Mesh odd = odd_mesh();
  odd.positions[7].z = 1e-42F;
  const Mesh small = test::BumpySphere::dense(3000);
  expect_mesh(write(text_of(odd), folder / "odd.stl"), cache);
  expect_mesh(
      write(text_of(small, {.end_of_line = "\r\n", .upper_case = true}), folder / "dos.stl"),
      cache);
  expect_mesh(write(text_of(small, {.end_of_line = "\r", .indented = true}), folder / "mac.stl"),
              cache);
  // Corners that are equal in the file are joined; those that rounding makes equal are not
  std::string text = "\n solid\n";
  for (const char* const x : {"1", "1.00000000001", "1.0", "-0", "0"}) {
    text +=
        std::string("facet\nvertex 0 0 0\nvertex 1 1 0 vertex ") + x + " 0 1\nendloop endfacet\n";
  }
  expect_mesh(write(text, folder / "near.stl"), cache);
  EXPECT_EQ(stream_stl(folder / "near.stl", cache)->vertex_count(), 5U);
  // Facets that have fewer corners than three are left out
  text += "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 9 9\nendloop\nendfacet\n";
  expect_mesh(write(text, folder / "short.stl"), cache);
}

TEST(StlStream, LongTextsAreReadInPieces) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const Mesh mesh = test::BumpySphere::dense(100000);
  for (const char* const end : {"\n", "\r"}) {
    const std::string text = text_of(mesh, {.end_of_line = end});
    const fs::path file = write(text, folder / (std::to_string(end[0]) + ".stl"));
    ASSERT_GT(text.size(), std::size_t{17'000'000});  // Two pieces
    expect_mesh(file, cache);
    // Errors name the line, in the last piece, too
    write(text + "vertex 1 2 3", folder / "bad.stl");
    const std::string error = error_of([&] { stream_stl(folder / "bad.stl", cache); });
    EXPECT_NE(error.find("line " + std::to_string(7 * mesh.triangles.size() + 3) +
                         ": a vertex lies outside of any facet"),
              std::string::npos)
        << error;
  }
  std::string text = "solid a\n";
  text.resize(std::size_t{33} << 20, ' ');
  EXPECT_NE(error_of([&] {
              stream_stl(write(text, folder / "line.stl"), cache);
            }).find("a line of more than 16777216 bytes"),
            std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(cache), fs::directory_iterator()), 2);
}

/// A piece may end between the two characters that end a line, and inside a facet.
TEST(StlStream, LinesAreCutBehindTheirEnds) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  constexpr std::size_t kPieceBytes = std::size_t{1} << 24;
  const std::string facet = text_of(test::tetrahedron(), {.end_of_line = "\r\n"}).substr(14);
  for (const std::size_t before : {0U, 1U, 2U, 30U}) {
    std::string text = "solid ";
    const std::size_t first_line = facet.find('\r') + 1;
    text.resize(kPieceBytes - before - first_line - 2, 'x');
    text += "\r\n" + facet + "facet\r\nvertex 1 2\r\n";
    const fs::path file = write(text, folder / "cut.stl");
    const std::string error = error_of([&] { stream_stl(file, cache); });
    EXPECT_EQ(error, error_of([&] { load_mesh(file); }));
    EXPECT_NE(error.find("line 32: a vertex must have three numbers"), std::string::npos) << error;
  }
}

TEST(StlStream, TextsAreRefusedByLine) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const std::string good = "solid a\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n";
  const auto error = [&](const std::string& text, const ParsingRules& rules = {}) {
    fs::remove_all(cache);
    const std::string found =
        error_of([&] { stream_stl(write(text, folder / "bad.stl"), cache, rules); });
    EXPECT_EQ(found.empty(), fs::exists(cache) && !fs::is_empty(cache));
    return found;
  };
  const auto expect = [&](const std::string& text, const std::string& problem) {
    const std::string found = error(text);
    EXPECT_NE(found.find(problem), std::string::npos) << found;
  };
  EXPECT_EQ(error(good), "");
  expect(good + "facet\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendfacet\n",
         "line 12: it has polygons without normals");
  expect("solid UCX_a\n" + good, "line 1: it has a collision hull");
  EXPECT_EQ(error("solid UCX_a\n" + good, {.keep_hulls = true}), "");
  expect("solid a\n", "no faces of three corners");
  expect(good + "facet\n", "the file ends inside a facet");
  expect(good + "facet\nfacet\n", "line 8: a facet starts inside another");
  expect(good + "endfacet\n", "line 7: endfacet without facet");
  expect(good + "facets\n", "line 7: \"facets\" is not a keyword");
  expect(good + "facet\nvertex 2.1 2.3 0.7\nvertex 4.2 4.6 1.4\nvertex 6.3 6.9 2.1\nendfacet\n",
         "triangles without an area");
}

TEST(StlStream, SamplesOfATextTellItsTriangles) {
  const fs::path folder = test::scratch_folder(), file = folder / "high.stl";
  const Mesh small = test::BumpySphere::dense(2000), large = test::BumpySphere::dense(60000);
  const auto triangles = [&](const Mesh& mesh, const TextStyle& style) {
    const StlLayout layout = stl_layout(write(text_of(mesh, style), file));
    EXPECT_TRUE(layout.is_text);
    EXPECT_EQ(layout.obstacle, "");
    return static_cast<double>(layout.triangles);
  };
  for (const TextStyle& style : {TextStyle{}, TextStyle{.end_of_line = "\r", .upper_case = true},
                                 TextStyle{.indented = true, .digits = 17}}) {
    EXPECT_EQ(triangles(small, style), static_cast<double>(small.triangles.size()));
    const auto count = static_cast<double>(large.triangles.size());
    EXPECT_NEAR(triangles(large, style), count, 0.02 * count);
  }
}

TEST(StlStream, MapsAreTheSameForAllChunks) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const Mesh low = test::BumpySphere::light();
  for (const bool is_text : {false, true}) {
    const Mesh high = test::BumpySphere::dense(6000);
    const fs::path file =
        write(is_text ? text_of(high) : stl_of(high), folder / (is_text ? "text.stl" : "high.stl"));
    const Source whole(*test::device(), load_mesh(file));
    BakeOptions options;
    options.width = options.height = 128;
    options.report.recall = 0;
    options.match.max_distance = Length::absolute(0.15);
    options.maps = {MapKind::normal, find_map("height").kind, find_map("position").kind};
    for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views}) {
      options.match.method = method;
      const BakeResult expected = bake(whole, low, options);
      for (const std::size_t size : {100U, 900U, 7000U}) {
        const Source source = streamed_source(
            *test::device(), std::make_shared<const ChunkedMesh>(
                                 stream_stl(file, folder / "chunks"),
                                 ChunkOptions{.triangles = size, .folder = folder / "chunks"}));
        const BakeResult result = bake(source, low, options);
        ASSERT_EQ(result.maps.size(), expected.maps.size());
        EXPECT_EQ(result.coverage, expected.coverage);
        for (std::size_t m = 0; m < result.maps.size(); ++m) {
          EXPECT_EQ(result.maps[m].image.pixels, expected.maps[m].image.pixels) << size << ' ' << m;
        }
      }
    }
  }
}

TEST(StlStream, TheFileIsReusedUntilTheMeshChanges) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  Mesh mesh = test::BumpySphere::dense(500);
  const fs::path file = write(stl_of(mesh), folder / "high.stl");
  const auto first_x = [&] {
    std::vector<Vec3> positions(1);
    stream_stl(file, cache)->read_positions(0, positions);
    return positions[0].x;
  };
  const float x = first_x();
  const auto files = [&] {
    return std::distance(fs::directory_iterator(cache), fs::directory_iterator());
  };
  ASSERT_EQ(files(), 1);
  const fs::path joined = fs::directory_iterator(cache)->path();
  // A file that is used again is not written again, and counts as used
  const auto month = std::chrono::hours(24 * 29);
  fs::last_write_time(joined, fs::file_time_type::clock::now() - month);
  EXPECT_EQ(first_x(), x);
  EXPECT_LT(fs::file_time_type::clock::now() - fs::last_write_time(joined), month / 2);
  // Damaged files are written anew: cut short, and with another vertex
  const auto size = fs::file_size(joined);
  fs::resize_file(joined, size - 1);
  EXPECT_EQ(first_x(), x);
  EXPECT_EQ(fs::file_size(joined), size);
  {
    std::fstream change(joined, std::ios::binary | std::ios::in | std::ios::out);
    change.seekp(static_cast<std::streamoff>(12 * mesh.triangles.size()));
    put_float(change, x + 1);
  }
  EXPECT_EQ(first_x(), x);
  // Another mesh of the same size
  for (Vec3& p : mesh.positions) p.x += 0.125F;
  write(stl_of(mesh), file);
  fs::last_write_time(file, fs::file_time_type::clock::now() + std::chrono::seconds(5));
  EXPECT_EQ(first_x(), mesh.positions[mesh.triangles[0][0]].x);
  EXPECT_EQ(files(), 2);
  // Files that no run has used for a month are removed when another one is written
  fs::last_write_time(joined, fs::file_time_type::clock::now() - std::chrono::hours(24 * 31));
  write(stl_of(test::tetrahedron()), file);
  first_x();
  EXPECT_FALSE(fs::exists(joined));
}

TEST(StlStream, CancellingLeavesNoFile) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const fs::path file = write(stl_of(test::BumpySphere::dense(600000)), folder / "high.stl");
  std::vector<std::string> stages;
  {
    ProgressGuard guard([&](double, std::string_view stage) {
      stages.emplace_back(stage);
      return stage.find("piece 2") == std::string_view::npos;
    });
    EXPECT_THROW(stream_stl(file, cache), Cancelled);
  }
  EXPECT_EQ(stages.back(), "joining the high poly's vertices, piece 2 of 3");
  EXPECT_TRUE(fs::is_empty(cache));
}

TEST(StlStream, WhatIsNotReadInPartsIsRefused) {
  const fs::path folder = test::scratch_folder(), cache = folder / "chunks";
  const std::string good = stl_of(test::tetrahedron());
  const fs::path file = folder / "high.stl";
  EXPECT_EQ(stl_layout(write(good + "more", file)).obstacle, "has bytes after its last triangle");
  EXPECT_EQ(stl_layout(write("solid a\n" + std::string(9000, ' '), file)).triangles, 0U);
  EXPECT_EQ(stl_layout(write(good.substr(0, good.size() - 1), file)).triangles, 0U);
  EXPECT_EQ(stl_layout(write("x", file)).triangles, 0U);
  // Some programs begin the header of a binary file with "solid"
  EXPECT_EQ(stl_layout(write(stl_of(test::tetrahedron(), "solid x"), file)).obstacle, "");
  EXPECT_EQ(error_of([&] { stream_stl(file, cache); }), "");
  std::string colored = good;
  colored.back() = static_cast<char>(0x80);
  write(colored, file);
  EXPECT_NE(error_of([&] { stream_stl(file, cache); }).find("triangle 3: it has a colour"),
            std::string::npos);
  write(stl_of(test::tetrahedron(), "COLOR=abcd"), file);
  EXPECT_NE(error_of([&] { stream_stl(file, cache); }).find("header: it has a colour"),
            std::string::npos);
}

TEST(StlStream, AJobStreamsOrNamesTheRemedy) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const Mesh high = test::BumpySphere::dense(1500000);
  Job job;
  job.high = {write(stl_of(high), folder / "high.stl")};
  job.low = test::BumpySphere::light();
  job.bake.width = job.bake.height = 128;
  job.bake.maps = {MapKind::normal};
  job.in_memory = true;
  job.frame.shading.rule = ShadingRule::smooth;
  const JobResult whole = run(*test::device(), job);
  leave_memory(std::uint64_t{440} << 20);
  const JobResult streamed = run(*test::device(), job);
  set_memory_limit(0);
  EXPECT_EQ(whole.report.find("\"streamed\""), std::string::npos);
  EXPECT_NE(streamed.report.find("\"streamed\""), std::string::npos);
  EXPECT_EQ(whole.maps[0].map.image.pixels, streamed.maps[0].map.image.pixels);
  // A text
  job.high = {write(text_of(test::BumpySphere::dense(300000)), folder / "text.stl")};
  const JobResult whole_text = run(*test::device(), job);
  leave_memory(std::uint64_t{290} << 20);
  const JobResult streamed_text = run(*test::device(), job);
  set_memory_limit(0);
  EXPECT_EQ(whole_text.report.find("\"streamed\""), std::string::npos);
  EXPECT_NE(streamed_text.report.find("\"streamed\""), std::string::npos);
  EXPECT_EQ(whole_text.maps[0].map.image.pixels, streamed_text.maps[0].map.image.pixels);
  // What cannot be read in parts is refused
  job.high = {write(stl_of(high) + "more", folder / "more.stl")};
  leave_memory(std::uint64_t{40} << 20);
  const std::string error = error_of([&] { run(*test::device(), job); });
  set_memory_limit(0);
  EXPECT_NE(error.find("is larger than memory, and it has bytes after its last"), std::string::npos)
      << error;
  EXPECT_NE(error.find("write it as a binary, little-endian PLY of triangles, or as a binary STL"),
            std::string::npos)
      << error;
}

}  // namespace
}  // namespace kiln
