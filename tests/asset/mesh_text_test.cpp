// Text meshes whose lines end by CR alone, and what the documentation says of missing UVs.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "asset/mesh_reader.h"
#include "io/file/text_scanner.h"
#include "kiln/mesh.h"

namespace kiln {
namespace {

Mesh parse(const std::string& text, MeshFormat format) {
  std::vector<Warning> warnings;
  return parse_mesh({"mesh", text, &warnings}, format);
}

std::string with_ends(std::string text, const std::string& end) {
  for (std::size_t at = text.find('\n'); at != text.npos; at = text.find('\n', at + end.size())) {
    text.replace(at, 1, end);
  }
  return text;
}

std::string message(const std::string& text, MeshFormat format) {
  try {
    parse(text, format);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  ADD_FAILURE() << "was read";
  return {};
}

const std::string kObj =
    "# a comment\ng some group\nv 0 0 0\nv 1 0 \\\n0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    "f 1/1 2/2 3/3\n";

TEST(MeshText, EveryLineEndGivesTheSameMesh) {
  const Mesh wanted = parse(kObj, MeshFormat::obj);
  ASSERT_EQ(wanted.triangles.size(), 1u);
  ASSERT_EQ(wanted.uvs.size(), 3u);
  for (const std::string end : {"\r", "\r\n"}) {
    const Mesh mesh = parse(with_ends(kObj, end), MeshFormat::obj);
    EXPECT_EQ(mesh.positions, wanted.positions);
    EXPECT_EQ(mesh.triangles, wanted.triangles);
    EXPECT_EQ(mesh.uvs, wanted.uvs);
    EXPECT_EQ(mesh.group_names, wanted.group_names);
  }
  const std::string off = "OFF # by hand\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(parse(with_ends(off, "\r"), MeshFormat::off).positions, wanted.positions);
  const std::string stl =
      "solid by hand\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid by hand\n";
  EXPECT_EQ(parse(with_ends(stl, "\r"), MeshFormat::stl).triangles.size(), 1u);
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(parse(with_ends(ply, "\r"), MeshFormat::ply).positions, wanted.positions);
}

TEST(MeshText, LinesAreCountedByAnyEnd) {
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    const std::string text = message(with_ends("v 0 0 0\n\nv 1 x 0\n", end), MeshFormat::obj);
    EXPECT_NE(text.find("line 3: \"x\" is not a number"), std::string::npos) << text;
  }
  // Ends that are mixed: each counts.
  const std::string text = message("v 0 0 0\rv 1 0 0\nv 0 1 0\r\nv 1 x 0\n", MeshFormat::obj);
  EXPECT_NE(text.find("line 4"), std::string::npos) << text;
}

TEST(MeshText, ScannerKnowsItsLines) {
  TextScanner scan("a b\r\rc # d\re\\\r\nf\r\n\ng", '#', true);
  std::vector<std::string> words;
  for (std::string_view word = scan.token(); !word.empty(); word = scan.token()) {
    words.push_back(std::string(word) + std::to_string(scan.line()));
  }
  EXPECT_EQ(words, (std::vector<std::string>{"a1", "b1", "c3", "e4", "f5", "g7"}));
}

// kiln/mesh.h: what stands for a missing UV is no place on the map.
TEST(MeshText, MissingUvsAreNaN) {
  const Mesh mesh =
      parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 1 2 3\n",
            MeshFormat::obj);
  ASSERT_EQ(mesh.uv_triangles.size(), 2u);
  for (const std::uint32_t corner : mesh.uv_triangles[1]) {
    EXPECT_TRUE(std::isnan(mesh.uvs[corner].x) && std::isnan(mesh.uvs[corner].y));
  }
  for (const std::uint32_t corner : mesh.uv_triangles[0]) {
    EXPECT_TRUE(std::isfinite(mesh.uvs[corner].x));
  }
}

}  // namespace
}  // namespace kiln
