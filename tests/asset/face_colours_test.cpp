// Colours of faces: PLY, OFF, and the 15 bits of STL.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "asset/mesh_files.h"

namespace kiln {
namespace {

using test::mesh_files::load_text;
using test::mesh_files::Loaded;
using test::mesh_files::PlyText;
using Color = std::array<std::uint8_t, 4>;

/// The colour of a triangle whose corners have one; else of zeros.
Color color_of(const Mesh& mesh, std::size_t t) {
  if (mesh.colors.empty()) return {};
  const Triangle& corners = mesh.triangles[t];
  const Color color = mesh.colors[corners[0]];
  for (const std::uint32_t corner : corners) {
    if (mesh.colors[corner] != color) return {};
  }
  return color;
}

const std::vector<float> kStrip{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};  // a square

/// Two triangles that share an edge, with values behind the corners of each.
template <typename T>
std::string square(const std::string& encoding, const std::string& type,
                   const std::vector<std::vector<T>>& colors, const std::string& of_vertices = "",
                   const std::vector<std::uint8_t>& vertex_colors = {}) {
  std::string header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
                       of_vertices + "element face 2\nproperty list uchar int vertex_indices\n";
  for (const char* name : {"red", "green", "blue", "alpha"}) {
    header += "property " + type + " " + name + "\n";
  }
  PlyText ply(encoding, header);
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t k = 0; k < 3; ++k) ply.put(kStrip[3 * v + k]);
    for (std::size_t k = 0; k < 3 && !vertex_colors.empty(); ++k) {
      ply.put(vertex_colors[3 * v + k]);
    }
  }
  const std::array<std::array<std::int32_t, 3>, 2> faces{{{0, 1, 2}, {0, 2, 3}}};
  for (std::size_t f = 0; f < 2; ++f) {
    ply.put(std::uint8_t{3});
    for (const std::int32_t corner : faces[f]) ply.put(corner);
    for (const T channel : colors[f]) ply.put(channel);
  }
  return ply.text();
}

TEST(FaceColours, OfPlyInEveryEncodingAndType) {
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(encoding);
    const Loaded bytes = load_text(
        "c.ply", square<std::uint8_t>(encoding, "uchar", {{255, 0, 0, 255}, {0, 128, 0, 64}}));
    EXPECT_EQ(color_of(bytes.mesh, 0), (Color{255, 0, 0, 255}));
    EXPECT_EQ(color_of(bytes.mesh, 1), (Color{0, 128, 0, 64}));
    // The two corners that both have are there twice, at the end.
    EXPECT_EQ(bytes.mesh.positions.size(), 6U);
    EXPECT_EQ(bytes.mesh.positions[4], bytes.mesh.positions[0]);
    EXPECT_EQ(bytes.mesh.positions[5], bytes.mesh.positions[2]);
    EXPECT_TRUE(bytes.warnings.empty());
    const Loaded words = load_text(
        "c.ply",
        square<std::uint16_t>(encoding, "ushort", {{65535, 0, 0, 65535}, {0, 32896, 0, 65535}}));
    EXPECT_EQ(color_of(words.mesh, 1), (Color{0, 128, 0, 255}));
    const Loaded fractions =
        load_text("c.ply", square<float>(encoding, "float", {{1, 0, 0, 1}, {0, 0.5F, 0, 0.25F}}));
    EXPECT_EQ(color_of(fractions.mesh, 0), (Color{255, 0, 0, 255}));
    EXPECT_EQ(color_of(fractions.mesh, 1), (Color{0, 128, 0, 64}));
    const Loaded large =
        load_text("c.ply", square<float>(encoding, "float", {{255, 0, 0, 255}, {0, 51, 0, 255}}));
    EXPECT_EQ(color_of(large.mesh, 1), (Color{0, 51, 0, 255}));
  }
}

TEST(FaceColours, OneColourSplitsNothing) {
  const Loaded loaded =
      load_text("c.ply", square<std::uint8_t>("ascii", "uchar", {{9, 8, 7, 255}, {9, 8, 7, 255}}));
  EXPECT_EQ(loaded.mesh.positions.size(), 4U);
  EXPECT_EQ(loaded.mesh.colors, std::vector<Color>(4, Color{9, 8, 7, 255}));
}

TEST(FaceColours, OfVerticesCountWhereTheyVary) {
  const std::string rgb = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::vector<std::vector<std::uint8_t>> faces{{255, 0, 0, 255}, {0, 255, 0, 255}};
  const Loaded painted = load_text(
      "c.ply",
      square<std::uint8_t>("ascii", "uchar", faces, rgb, {1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4}));
  EXPECT_EQ(painted.mesh.colors[3], (Color{4, 4, 4, 255}));
  EXPECT_EQ(painted.mesh.positions.size(), 4U);
  EXPECT_EQ(painted.count("face-colors-left-out"), 2U);
  // Programs that write them always write them alike.
  const Loaded plain = load_text("c.ply", square<std::uint8_t>("ascii", "uchar", faces, rgb,
                                                               std::vector<std::uint8_t>(12, 200)));
  EXPECT_EQ(color_of(plain.mesh, 1), (Color{0, 255, 0, 255}));
  EXPECT_TRUE(plain.warnings.empty());
}

TEST(FaceColours, OfOff) {
  const std::string head = "4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  const auto read = [&](const std::string& faces, const std::string& keyword = "OFF\n") {
    return load_text("c.off", keyword + head + faces);
  };
  const Loaded bytes = read("3 0 1 2 255 0 0\n3 0 2 3 0 128 0 64 \n");
  EXPECT_EQ(color_of(bytes.mesh, 0), (Color{255, 0, 0, 255}));
  EXPECT_EQ(color_of(bytes.mesh, 1), (Color{0, 128, 0, 64}));
  EXPECT_TRUE(bytes.warnings.empty());
  const Loaded fractions = read("3 0 1 2 1.0 0.0 0.0\n3 0 2 3 0.0 0.5 0.0 1\n", "");
  EXPECT_EQ(color_of(fractions.mesh, 0), (Color{255, 0, 0, 255}));
  EXPECT_EQ(color_of(fractions.mesh, 1), (Color{0, 128, 0, 255}));
  // A polygon is one colour, however it is cut.
  const Loaded quad = load_text(
      "c.off", "OFF\n" + head.substr(0, 2) + "1" + head.substr(3) + "4 0 1 2 3 10 20 30\n");
  ASSERT_EQ(quad.mesh.triangles.size(), 2U);
  EXPECT_EQ(color_of(quad.mesh, 0), (Color{10, 20, 30, 255}));
  EXPECT_EQ(color_of(quad.mesh, 1), (Color{10, 20, 30, 255}));
  const Loaded one = read("3 0 1 2 # red\n3 0 2 3 0 128 0 # green\n");
  EXPECT_EQ(color_of(one.mesh, 0), (Color{255, 255, 255, 255}));
  EXPECT_EQ(color_of(one.mesh, 1), (Color{0, 128, 0, 255}));
  EXPECT_EQ(one.count("missing-colors"), 1U);
  const Loaded indexed = read("3 0 1 2 7\n3 0 2 3 1\n");
  EXPECT_EQ(indexed.count("color-indices"), 2U);
  EXPECT_TRUE(indexed.mesh.colors.empty());
  EXPECT_TRUE(read("3 0 1 2\n3 0 2 3\n").mesh.colors.empty());
}

/// Two triangles with these two bytes each, which are the last of a triangle's fifty.
std::string stl(const std::string& header, const std::array<std::uint16_t, 2>& bits) {
  std::string text = test::mesh_files::binary_stl(
      {{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}}});
  std::fill_n(text.begin(), 80, '\0');
  text.replace(0, header.size(), header);
  for (std::size_t t = 0; t < 2; ++t) {
    text[84 + 50 * t + 48] = static_cast<char>(bits[t] & 255U);
    text[84 + 50 * t + 49] = static_cast<char>(bits[t] >> 8U);
  }
  return text;
}

constexpr std::uint16_t bits(unsigned lowest, unsigned middle, unsigned highest, bool mark) {
  return static_cast<std::uint16_t>(lowest | middle << 5U | highest << 10U | (mark ? 0x8000U : 0U));
}

// VisCAM and SolidView: the mark says that there is a colour; blue, green, red from the lowest bit.
TEST(FaceColours, OfStlByVisCam) {
  const Loaded loaded =
      load_text("c.stl", stl("made by a test", {bits(1, 16, 31, true), bits(31, 0, 0, true)}));
  EXPECT_EQ(color_of(loaded.mesh, 0), (Color{255, 132, 8, 255}));  // 31, 16, 1 of 31
  EXPECT_EQ(color_of(loaded.mesh, 1), (Color{0, 0, 255, 255}));
  EXPECT_TRUE(loaded.warnings.empty());
  const Loaded half =
      load_text("c.stl", stl("made by a test", {bits(1, 16, 31, false), bits(31, 0, 0, true)}));
  EXPECT_EQ(color_of(half.mesh, 0), (Color{255, 255, 255, 255}));
  EXPECT_EQ(half.count("missing-colors"), 1U);
  EXPECT_TRUE(load_text("c.stl", stl("", {bits(1, 16, 31, false), 0})).mesh.colors.empty());
}

// Materialise Magics: the mark says that the whole's colour counts; red, green, blue from the lowest bit.
TEST(FaceColours, OfStlByMagics) {
  const std::string header = "COLOR=\x0a\x14\x1e\xc8,MATERIAL=";
  const Loaded loaded =
      load_text("c.stl", stl(header, {bits(31, 16, 1, false), bits(31, 31, 31, true)}));
  EXPECT_EQ(color_of(loaded.mesh, 0), (Color{255, 132, 8, 255}));
  EXPECT_EQ(color_of(loaded.mesh, 1), (Color{10, 20, 30, 200}));
  // A colour of the whole alone.
  const Loaded whole = load_text("c.stl", stl(header, {0, 0}));
  EXPECT_EQ(color_of(whole.mesh, 0), (Color{10, 20, 30, 200}));
  EXPECT_EQ(whole.mesh.positions.size(), 4U);
}

// MeshLab writes Magics' header and order of channels, but sets the mark in every triangle.
TEST(FaceColours, OfStlByMeshLab) {
  const std::string meshlab = "COLOR=\x7f\x7f\x7f MATERIAL=\x7f\x7f\x7f ";
  const std::string magics = "COLOR=\x0a\x14\x1e\xc8,MATERIAL=";
  for (const std::string& header : {meshlab, magics}) {
    const Loaded differ =
        load_text("c.stl", stl(header, {bits(31, 16, 1, true), bits(0, 0, 31, true)}));
    EXPECT_EQ(color_of(differ.mesh, 0), (Color{255, 132, 8, 255}));
    EXPECT_EQ(color_of(differ.mesh, 1), (Color{0, 0, 255, 255}));
    EXPECT_TRUE(differ.warnings.empty());
  }
  // One colour for all: MeshLab's header tells that it is meant.
  const Loaded one =
      load_text("c.stl", stl(meshlab, {bits(31, 16, 1, true), bits(31, 16, 1, true)}));
  EXPECT_EQ(color_of(one.mesh, 1), (Color{255, 132, 8, 255}));
  EXPECT_TRUE(one.warnings.empty());
  const Loaded white = load_text("c.stl", stl(meshlab, {0xFFFF, 0xFFFF}));
  EXPECT_EQ(color_of(white.mesh, 0), (Color{255, 255, 255, 255}));
  // Else it is the header's, by the letter, with a warning where the two are not one colour.
  const Loaded doubt =
      load_text("c.stl", stl(magics, {bits(31, 16, 1, true), bits(31, 16, 1, true)}));
  EXPECT_EQ(color_of(doubt.mesh, 0), (Color{10, 20, 30, 200}));
  EXPECT_EQ(doubt.count("stl-colors"), 2U);
  for (const std::uint16_t silent : {bits(31, 31, 31, true), bits(0, 0, 0, true),
                                     bits(1, 2, 4, true)}) {  // of which the last is the header's
    const Loaded sure = load_text("c.stl", stl(magics, {silent, silent}));
    EXPECT_EQ(color_of(sure.mesh, 0), (Color{10, 20, 30, 200}));
    EXPECT_TRUE(sure.warnings.empty());
  }
}

TEST(FaceColours, CornersAreWeldedWhereColoursAgree) {
  const Loaded loaded = load_text("c.stl", stl("", {bits(0, 0, 31, true), bits(0, 31, 0, true)}));
  EXPECT_EQ(loaded.mesh.positions.size(), 6U);
  const Loaded same = load_text("c.stl", stl("", {bits(0, 0, 31, true), bits(0, 0, 31, true)}));
  EXPECT_EQ(same.mesh.positions.size(), 4U);
}

}  // namespace
}  // namespace kiln
