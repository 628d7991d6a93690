// Mesh files at the edges of their formats' rules: what is read where few files go, and what is said of what is not.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "kiln/asset.h"
#include "kiln/material.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using mesh_files::binary_stl;
using mesh_files::expect_bad_text;
using mesh_files::load;
using mesh_files::load_text;
using mesh_files::Loaded;
using nlohmann::json;
using Color = std::array<std::uint8_t, 4>;

std::string warning_of(const Loaded& loaded, const std::string& code) {
  for (const Warning& warning : loaded.warnings) {
    if (warning.code == code) return warning.message.text();
  }
  return {};
}

constexpr const char* kXyz = "property float x\nproperty float y\nproperty float z\n";
constexpr const char* kFace = "property list uchar int vertex_indices\n";

/// A PLY of four vertices and two faces. \param more  properties of vertices
std::string ply(const std::string& more, const std::string& rows, const std::string& faces,
                const std::string& of_faces = kFace, const std::string& ending = "\n") {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 4\n" + std::string(kXyz) + more +
                     "element face 2\n" + of_faces + "end_header\n" + rows + faces;
  for (std::size_t at = 0; ending != "\n" && (at = text.find('\n', at)) != text.npos;
       at += ending.size()) {
    text.replace(at, 1, ending);
  }
  return text;
}
constexpr const char* kRows = "0 0 0\n1 0 0\n1 2 0\n0 2 3\n";
constexpr const char* kFaces = "3 0 1 2\n3 0 2 3\n";

TEST(PlyEdges, HeadersOfEveryLineEnding) {
  for (const std::string ending : {"\n", "\r\n", "\r"}) {
    const Loaded loaded = load_text("a.ply", ply("", kRows, kFaces, kFace, ending));
    EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(loaded.world(3), (std::array<double, 3>{0, 2, 3}));
    EXPECT_TRUE(loaded.warnings.empty());
  }
}

TEST(PlyEdges, BadHeadersAreNamedByTheirLine) {
  const std::string start = "ply\nformat ascii 1.0\n";
  const std::string vertices = "element vertex 4\n" + std::string(kXyz);
  expect_bad_text("h.ply", start + vertices + "element vertex 4\n" + kXyz + "end_header\n",
                  {"line 7: element \"vertex\" occurs twice."});
  expect_bad_text("h.ply", start + "property float x\n" + vertices + "end_header\n",
                  {"line 3: a property comes before any element."});
  for (const char* type : {"float", "double", "text"}) {
    expect_bad_text("h.ply",
                    start + vertices + "element face 1\nproperty list " + type +
                        " int vertex_indices\nend_header\n",
                    {"line 8: \"" + std::string(type) +
                     "\" is not an integer type, which the length of a list needs."});
  }
  expect_bad_text(
      "h.ply",
      start + vertices + "element face 1\nproperty list uchar float vertex_indices\nend_header\n",
      {"line 8: vertex indices must be of an integer type."});
  expect_bad_text("h.ply", "ply\n" + vertices + "end_header\n",
                  {"line 6: the header has no \"format\" line."});
  expect_bad_text("h.ply", start + vertices + "property float y\nelement face 0\nend_header\n",
                  {"header: its vertices have more than one property \"y\"."});
  expect_bad_text("h.ply",
                  start + "element vertex 4\nproperty float x\nproperty float z\n" +
                      "element face 0\nend_header\n",
                  {"header: its vertices have no property \"y\"."});
  const std::string two = std::string(kFace) + "property list uchar int vertex_index\n";
  expect_bad_text("h.ply", ply("", kRows, kFaces, two),
                  {"header: its faces need exactly one list \"vertex_indices\"."});
}

TEST(PlyEdges, PropertiesWithoutTheirSetAreCounted) {
  const Loaded one = load_text(
      "a.ply", ply("property float ny\n", "0 0 0 1\n1 0 0 1\n1 2 0 1\n0 2 3 1\n", kFaces));
  EXPECT_EQ(one.count("unused-properties"), 1U);
  EXPECT_NE(warning_of(one, "unused-properties")
                .find("header: 1 property of its vertices occurs twice, or without the others of "
                      "its set (\"ny\"), and was ignored."),
            std::string::npos)
      << warning_of(one, "unused-properties");
  EXPECT_TRUE(one.mesh.normals.empty());
  const Loaded three =
      load_text("a.ply", ply("property uchar green\nproperty uchar alpha\nproperty float v\n",
                             "0 0 0 9 9 1\n1 0 0 9 9 1\n1 2 0 9 9 1\n0 2 3 9 9 1\n", kFaces));
  EXPECT_EQ(three.count("unused-properties"), 3U);
  EXPECT_NE(warning_of(three, "unused-properties").find("header: 3 properties of its vertices"),
            std::string::npos);
  EXPECT_TRUE(three.mesh.colors.empty());
  EXPECT_TRUE(three.mesh.uvs.empty());
}

TEST(PlyEdges, ListsOfVerticesAndScalarsOfFacesArePassedOver) {
  const std::string faces = "7 3 0 1 2 0.5\n8 3 0 2 3 0.25\n";
  const std::string rows = "0 0 0 2 5 6\n1 0 0 0\n1 2 0 1 9\n0 2 3 3 1 2 3\n";
  const Loaded loaded = load_text(
      "a.ply", ply("property list uchar float more\n", rows, faces,
                   "property int number\n" + std::string(kFace) + "property float weight\n"));
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(loaded.world(2), (std::array<double, 3>{1, 2, 0}));
  EXPECT_EQ(loaded.world(3), (std::array<double, 3>{0, 2, 3}));
}

TEST(PlyEdges, LengthsAndIndicesAreWholeNumbers) {
  expect_bad_text("l.ply", ply("", kRows, "3 0 1 2\n-1 0 2 3\n"),
                  {"face 1 has a list of length -1"});
  expect_bad_text("l.ply", ply("", kRows, "3 0 1 2\n2.5 0 2 3\n"),
                  {"face 1 has a list of length 2.5"});
  expect_bad_text("l.ply", ply("", kRows, "3 0 1 2\n3 0 2.5 3\n"),
                  {"face 1 uses vertex 2.5, but there are 4, numbered from 0"});
  expect_bad_text("l.ply", ply("", kRows, "3 0 1 2\n3 0 4 3\n"),
                  {"face 1 uses vertex 4, but there are 4, numbered from 0"});
}

TEST(PlyEdges, NumbersOfPicturesAreWholeAndNotNegative) {
  const std::string text =
      "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile \"b c.png\"\n"
      "element vertex 4\n" +
      std::string(kXyz) + "property float s\nproperty float t\nelement face 4\n" + kFace +
      "property float texnumber\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 2 0 1 1\n0 2 3 0 1\n"
      "3 0 1 2 0\n3 0 2 3 1\n3 1 2 3 -1\n3 0 1 3 0.5\n";
  const Loaded loaded = load_text("t.ply", text);
  ASSERT_EQ(loaded.mesh.materials.size(), 4U);
  const auto name = [&](std::size_t t) {
    return loaded.mesh.material_names[loaded.mesh.materials[t]];
  };
  EXPECT_EQ(name(0), "a");
  EXPECT_EQ(name(1), "b c");
  EXPECT_EQ(name(2), name(3));
  EXPECT_NE(name(2), "a");
  EXPECT_NE(name(2), "b c");
  EXPECT_EQ(loaded.count("texture-numbers"), 2U);
  EXPECT_NE(warning_of(loaded, "texture-numbers").find("2 faces (face 2 for one)"),
            std::string::npos)
      << warning_of(loaded, "texture-numbers");
}

TEST(OffEdges, KeywordsAreLettersOnceEach) {
  const std::string body = "3 1 0\n";
  const std::string plain = "0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n";
  EXPECT_EQ(load_text("a.off", "off\n" + body + plain).mesh.triangles.size(), 1U);
  EXPECT_EQ(load_text("a.off", "nOFF 3\n" + body + plain).mesh.triangles.size(), 1U);
  EXPECT_EQ(load_text("a.off", body + plain).world(2), (std::array<double, 3>{0, 2, 0}));
  for (const char* word : {"COOFF", "CCOFF", "QOFF", "SOFF", "TOFF", "NCNOFF", "4n4OFF"}) {
    expect_bad_text("k.off", std::string(word) + "\n" + body + plain,
                    {"line 1: \"" + std::string(word) + "\" is not the keyword of an OFF file."});
  }
  const Loaded scaled =
      load_text("h.off", "4OFF\n" + body + "0 0 0 2\n2 0 0 2\n0 2 6 2\n3 0 1 2\n");
  EXPECT_EQ(scaled.world(1), (std::array<double, 3>{1, 0, 0}));
  EXPECT_EQ(scaled.world(2), (std::array<double, 3>{0, 1, 3}));
}

TEST(OffEdges, CountsAndRowsAreRefusedWithTheirLine) {
  for (const char* counts : {"-3 1 0", "3 -1 0", "3", "x 1 0"}) {
    expect_bad_text("c.off", "OFF\n" + std::string(counts) + "\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                    {"line 2: the numbers of vertices and faces are missing."});
  }
  expect_bad_text("v.off", "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n",
                  {"line 4: vertex 1 has \"\""});
  expect_bad_text("v.off", "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0\n0 1 0 0 0 1\n3 0 1 2\n",
                  {"line 4: vertex 1 has \"\""});
  expect_bad_text("v.off", "STOFF\n3 1 0\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 1\n3 0 1 2\n",
                  {"line 5: vertex 2 has no texture coordinate."});
  expect_bad_text("f.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n-3 0 1 2\n",
                  {"line 7: face 1 has \"-3\" where its number of corners belongs."});
  expect_bad_text("f.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 x 2\n",
                  {"line 7: face 1 has \"x\" where a vertex index belongs."});
  expect_bad_text("f.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 -2\n",
                  {"line 7: face 1 uses vertex -2, but there are 3, numbered from 0."});
}

TEST(OffEdges, UvsAndColoursOfEveryNumberOfChannels) {
  const Loaded loaded = load_text(
      "a.off",
      "STCOFF\n3 1 0\n0 0 0 255 0 51 0.25 0.5\n1 0 0 0 102 0 0.75 0.5\n0 2 0 0 0 153 0 1\n"
      "3 0 1 2\n");
  EXPECT_EQ(loaded.mesh.colors,
            (std::vector<Color>{{255, 0, 51, 255}, {0, 102, 0, 255}, {0, 0, 153, 255}}));
  ASSERT_EQ(loaded.mesh.uvs.size(), 3U);
  EXPECT_EQ(loaded.mesh.uvs[0], (Vec2{0.25F, 0.5F}));
  EXPECT_EQ(loaded.mesh.uvs[1], (Vec2{0.75F, 0.5F}));
}

TEST(OffEdges, IndicesOfColoursAreCounted) {
  for (const int count : {1, 3}) {
    std::string text = "OFF\n3 4 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 2 10 20 30\n";
    for (int i = 0; i < 3; ++i) {
      text += "3 0 1 2" + std::string(i + 1 > 3 - count ? " 7\n" : " 40 50 60\n");
    }
    const Loaded loaded = load_text("i.off", text);
    EXPECT_EQ(loaded.count("color-indices"), static_cast<std::uint64_t>(count));
    const std::string start = count == 1 ? "1 face has an index" : "3 faces have an index";
    EXPECT_NE(warning_of(loaded, "color-indices").find(start), std::string::npos)
        << warning_of(loaded, "color-indices");
    EXPECT_NE(warning_of(loaded, "color-indices")
                  .find("(face " + std::to_string(4 - count) + " for example)"),
              std::string::npos);
  }
}

TEST(StlEdges, TextIsRefusedWithItsLine) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 "
      "0\nendloop\nendfacet\n";
  expect_bad_text("a.stl", "solid\n" + facet + "vertex 0 0 0\n",
                  {"line 9: a vertex lies outside of any facet."});
  expect_bad_text("a.stl", "solid\n" + facet + "facet normal 0 0 1\nfacet normal 0 0 1\n",
                  {"line 10: a facet starts inside another."});
  expect_bad_text("a.stl", "solid\n" + facet + "endfacet\n", {"line 9: endfacet without facet."});
  expect_bad_text("a.stl", "solid\n" + facet + "facet\nouter loop\nvertex 0 0\n",
                  {"line 11: a vertex must have three numbers, but there is \"\"."});
  expect_bad_text("a.stl", "solid\n" + facet + "outer ring\n",
                  {"line 9: \"ring\" is not a keyword of an ASCII STL file."});
}

/// Facets of more corners are cut, ones of fewer counted; a blank in "end loop" does not matter.
TEST(StlEdges, FacetsOfAnyNumberOfCorners) {
  const Loaded loaded = load_text(
      "a.stl",
      "solid first\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 2 0\n"
      "vertex 0 2 0\nend loop\nend facet\nend solid\nsolid second\nfacet\nouter loop\n"
      "vertex 0 0 3\nvertex 1 0 3\nendloop\nendfacet\nFACET\nOUTER LOOP\nVERTEX 0 0 3\n"
      "VERTEX 1 0 3\nVERTEX 0 1 3\nENDLOOP\nENDFACET\nendsolid second\n");
  ASSERT_EQ(loaded.mesh.triangles.size(), 3U);
  ASSERT_EQ(loaded.mesh.groups.size(), 3U);
  EXPECT_EQ(loaded.mesh.group_names[loaded.mesh.groups[0]], "first");
  EXPECT_EQ(loaded.mesh.group_names[loaded.mesh.groups[1]], "first");
  EXPECT_EQ(loaded.mesh.group_names[loaded.mesh.groups[2]], "second");
  EXPECT_EQ(loaded.mesh.positions.size(), 4U + 3U);
}

TEST(StlEdges, BytesAfterTheEndAreCounted) {
  const std::string text = binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 2, 0}}});
  for (const std::size_t extra : {1U, 7U}) {
    const Loaded loaded = load_text("a.stl", text + std::string(extra, 'x'));
    EXPECT_EQ(loaded.count("trailing-bytes"), extra);
    EXPECT_NE(warning_of(loaded, "trailing-bytes")
                  .find(extra == 1 ? "1 byte after the last triangle was ignored."
                                   : "7 bytes after the last triangle were ignored."),
              std::string::npos);
    EXPECT_EQ(loaded.mesh.triangles.size(), 1U);
  }
}

TEST(ObjEdges, NumbersThatAreNoneAreRefusedWithTheirLine) {
  const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  expect_bad_text("a.obj", start + "v 0 1 2 0.5 x 1\n", {"line 4: \"x\" is not a number."});
  expect_bad_text("a.obj", start + "vt 0.5 x\n", {"line 4: \"x\" is not a number."});
  expect_bad_text("a.obj", start + "vt\n",
                  {"line 4: a number is missing (a texture coordinate has u and v)."});
  expect_bad_text("a.obj", start + "vn 0 1\n",
                  {"line 4: a number is missing (a normal has three numbers)."});
}

TEST(ObjEdges, ColoursHaveThreeOrFourChannels) {
  const Loaded loaded =
      load_text("a.obj",
                "v 0 0 0 1 0 0.2\nv 1 0 0 0.4 0.6 0.8 0.2\nv 0 2 0 0 1 0\nvt 0.25\nvt 1 0.5\n"
                "f 1/1 2/2 3/2\n");
  EXPECT_EQ(loaded.mesh.colors,
            (std::vector<Color>{{255, 0, 51, 255}, {102, 153, 204, 51}, {0, 255, 0, 255}}));
  EXPECT_EQ(loaded.mesh.uvs[0], (Vec2{0.25F, 0})) << "v is 0 where it is left out";
  EXPECT_EQ(load_text("w.obj", "v 0 0 0 1\nv 1 0 0 2\nv 0 1 0 1\nf 1 2 3\n").mesh.colors.size(), 0U)
      << "a weight is no colour";
}

TEST(ObjEdges, MaterialFilesHaveBlanksAndQuotes) {
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto files = [&](const std::string& line) {
    return load_text("a.obj", "mtllib" + line + "\n" + faces).mesh.material_files;
  };
  using Files = std::vector<std::string>;
  EXPECT_EQ(files(" a.mtl"), (Files{"a.mtl"}));
  EXPECT_EQ(files(" a b.mtl c.MTL\td.mtl"), (Files{"a b.mtl", "c.MTL", "d.mtl"}));
  EXPECT_EQ(files(" \"a b.mtl\" \"c.mtl\""), (Files{"a b.mtl", "c.mtl"}));
  EXPECT_EQ(files(" plain name"), (Files{"plain name"}));
  EXPECT_EQ(files(" \"open.mtl"), (Files{"\"open.mtl"}));
}

TEST(ObjEdges, PolypaintStandsBeforeEachObject) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const Loaded loaded =
      load_text("a.obj", triangle +
                             "#MRGB ff102030ff405060ff708090\nf 1 2 3\nv 0 0 5\nv 1 0 5\n"
                             "v 0 1 5\n#MRGB  ffa0b0c0\n#MRGB ffd0e0f0ff010203\nf 4 5 6\n");
  EXPECT_EQ(loaded.mesh.colors, (std::vector<Color>{{0x10, 0x20, 0x30, 255},
                                                    {0x40, 0x50, 0x60, 255},
                                                    {0x70, 0x80, 0x90, 255},
                                                    {0xA0, 0xB0, 0xC0, 255},
                                                    {0xD0, 0xE0, 0xF0, 255},
                                                    {0x01, 0x02, 0x03, 255}}));
}

TEST(ObjEdges, ZeroIndicesAreCounted) {
  const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
  const Loaded one = load_text("a.obj", start + "f 1/0 2/1 3/1\n");
  EXPECT_EQ(one.count("zero-indices"), 1U);
  EXPECT_NE(warning_of(one, "zero-indices").find("line 6: 1 corner has 0 for the index of a "),
            std::string::npos)
      << warning_of(one, "zero-indices");
  const Loaded more = load_text("a.obj", start + "f 1//1 2//1 3//1\nf 1//0 2//0 3//1\n");
  EXPECT_EQ(more.count("zero-indices"), 2U);
  EXPECT_NE(warning_of(more, "zero-indices")
                .find("line 7: 2 corners (this is the first) have 0 for the index of a normal"),
            std::string::npos)
      << warning_of(more, "zero-indices");
}

/// Three triangles of three groups, objects and materials.
Mesh written_mesh() {
  Mesh mesh;
  mesh.name = "thing";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}};
  mesh.uvs = {{0, 0}, {1, 0}, {0.5F, 1}};
  mesh.uv_triangles = {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}};
  mesh.normals = {{0, 0, 1}};
  mesh.normal_triangles = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  mesh.groups = mesh.objects = mesh.materials = {0, 2, 1};
  mesh.group_names = {"g0", "g1", "g2"};
  mesh.object_names = {"o0", "o1", "o2"};
  mesh.material_names = {"m0", "", "m\\2\x7F\n"};
  mesh.colors.assign(4, {1, 2, 3, 4});
  return mesh;
}

TEST(ObjEdges, WritersRefuseMeshesThatDoNotHoldTogether) {
  const fs::path path = scratch_folder() / "out.obj";
  const auto refusal = [&](void (*change)(Mesh&)) -> std::string {
    Mesh mesh = written_mesh();
    change(mesh);
    try {
      save_obj(mesh, path);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      const std::string text = error.what(), start = "save_obj: mesh \"thing\" has ",
                        end = "; build it so that every attribute is empty or complete.";
      if (!text.starts_with(start) || !text.ends_with(end)) return text;
      return text.substr(start.size(), text.size() - start.size() - end.size());
    }
    return "";
  };
  EXPECT_EQ(refusal([](Mesh&) {}), "");
  fs::remove(path);
  const std::string differs = " that differs from that of its triangles";
  EXPECT_EQ(refusal([](Mesh& m) { m.uv_triangles.pop_back(); }),
            "a number of uv_triangles" + differs);
  EXPECT_EQ(refusal([](Mesh& m) { m.normal_triangles.pop_back(); }),
            "a number of normal_triangles" + differs);
  EXPECT_EQ(refusal([](Mesh& m) { m.groups.push_back(0); }), "a number of groups" + differs);
  EXPECT_EQ(refusal([](Mesh& m) { m.objects.push_back(0); }), "a number of objects" + differs);
  EXPECT_EQ(refusal([](Mesh& m) { m.materials.push_back(0); }), "a number of materials" + differs);
  EXPECT_EQ(refusal([](Mesh& m) { m.colors.pop_back(); }),
            "a number of colors that differs from that of its positions");
  EXPECT_EQ(refusal([](Mesh& m) { m.triangles[1][2] = 4; }), "a vertex index out of range");
  EXPECT_EQ(refusal([](Mesh& m) { m.uv_triangles[1][2] = 3; }), "a UV index out of range");
  EXPECT_EQ(refusal([](Mesh& m) { m.normal_triangles[1][2] = 1; }), "a normal index out of range");
  EXPECT_EQ(refusal([](Mesh& m) { m.groups[1] = 3; }), "a group index out of range");
  EXPECT_EQ(refusal([](Mesh& m) { m.objects[1] = 3; }), "an object index out of range");
  EXPECT_EQ(refusal([](Mesh& m) { m.materials[1] = 3; }), "a material index out of range");
  EXPECT_FALSE(fs::exists(path));
}

TEST(ObjEdges, NamesAreWrittenSoThatLinesStayWhole) {
  Mesh mesh = written_mesh();
  mesh.material_files = {"a\\b\nc.mtl", "", "d.mtl"};
  const fs::path path = scratch_folder() / "out.obj";
  save_obj(mesh, path);
  const std::string text = read_file(path);
  EXPECT_NE(text.find("\nmtllib a/bc.mtl\nmtllib d.mtl\n"), std::string::npos) << text;
  EXPECT_NE(text.find("usemtl default\n"), std::string::npos) << text;
  EXPECT_NE(text.find("usemtl m_2__\n"), std::string::npos) << text;
  const Mesh back = load(path).mesh;
  ASSERT_EQ(back.materials.size(), 3U);
  EXPECT_EQ(back.material_names[back.materials[0]], "m0");
  EXPECT_EQ(back.material_names[back.materials[1]], "m_2__");
  EXPECT_EQ(back.material_names[back.materials[2]], "default");
  EXPECT_EQ(back.object_names[back.objects[1]], "o2");
}

/// A file's first bytes say what it is where its name does not.
TEST(MeshEdges, FilesOfOtherKindsAreNamed) {
  const auto padded = [](std::string start) { return start + std::string(200, '\0'); };
  for (const auto& [text, kind] : std::vector<std::pair<std::string, std::string>>{
           {"ply\r\n", "PLY"},
           {"; FBX 7.4.0 project file", "FBX"},
           {padded("BLENDER-v300"), "a Blender scene"},
           {padded("\x89PNG\r\n\x1a\n"), "a PNG image"},
           {padded("\x76\x2f\x31\x01"), "an OpenEXR image"},
           {padded("PK\x03\x04"), "a ZIP archive"},
           {padded("\x1f\x8b"), "a gzip archive"},
           {"STCOFF\n3 1 0\n", "OFF"},
           {"{\"asset\": {}}", "JSON (glTF?)"},
           {"<html></html>", "XML or HTML"},
           {"# by hand\nvt 0 0\n", "OBJ"},
           {"SOLID a\nFACET normal 0 0 1\n", "STL"}}) {
    expect_bad_text("a.max", text, {kind});
  }
}

/// JSON of a square whose one member is changed.
std::string changed(const std::function<void(json&)>& change) {
  GltfMaker maker = gltf_square();
  change(maker.json);
  return maker.glb();
}

TEST(GltfEdges, MembersOfWrongKindsAreNamedByTheirPlace) {
  struct Case {
    std::function<void(json&)> change;
    std::string text;
  };
  for (const auto& [change, text] : std::vector<Case>{
           {[](json& j) { j.erase("asset"); }, "asset: it has no version"},
           {[](json& j) { j["asset"] = json::object(); }, "asset: it has no version"},
           {[](json& j) { j["asset"]["version"] = "1.0"; }, "asset: it is glTF 1.0"},
           {[](json& j) { j["asset"]["version"] = 2; }, "asset.version: it is not a text"},
           {[](json& j) { j["meshes"] = 7; }, "meshes: it is not a list"},
           {[](json& j) { j["meshes"][0]["primitives"][0]["attributes"] = {1}; },
            "attributes: it is not an object"},
           {[](json& j) { j["accessors"][1]["count"] = -1; },
            "accessors[1].count: it is not a non-negative integer"},
           {[](json& j) { j["accessors"][1]["count"] = 1.5; },
            "accessors[1].count: it is not a non-negative integer"},
           {[](json& j) { j["accessors"][1]["count"] = 1e17; },
            "accessors[1].count: it is not a non-negative integer"},
           {[](json& j) { j["accessors"][1]["normalized"] = 1; },
            "accessors[1].normalized: it is neither true nor false"},
           {[](json& j) { j["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 0; },
            "accessors[0]: it is of type \"VEC3\", where VEC2 belongs"},
           {[](json& j) {
              j["accessors"][2]["type"] = "VEC2";
              j["accessors"][2]["count"] = 3;
            },
            "accessors[2]: it is of type \"VEC2\", where SCALAR belongs"},
           {[](json& j) { j["accessors"][2]["componentType"] = 5122; },
            "accessors[2]: it has indices that are no unsigned integers"},
           {[](json& j) { j["accessors"][1]["bufferView"] = 3; },
            "accessors[1].bufferView: it is 3, but there are only 3 in bufferViews"},
           {[](json& j) { j["bufferViews"][1].erase("buffer"); },
            "bufferViews[1]: it names no buffer"},
           {[](json& j) { j["bufferViews"][1]["byteLength"] = 4096; },
            "bufferViews[1]: it takes 4096 bytes from byte 48 on, but buffers[0] has only 92"},
           {[](json& j) {
              j["buffers"] = {{{"byteLength", 92}}, {{"byteLength", 92}}};
              j["bufferViews"][1]["buffer"] = 1;
            },
            "buffers[1]: it has neither a URI nor the binary chunk of a GLB"},
           {[](json& j) {
              j["buffers"] = {{{"byteLength", 92}}, {{"byteLength", 9}, {"uri", ""}}};
              j["bufferViews"][1]["buffer"] = 1;
            },
            "buffers[1].uri: \"\" is not a file in the folder of the glTF file"},
           {[](json& j) {
              j["buffers"] = {{{"byteLength", 92}}, {{"byteLength", 9}, {"uri", "a%00b"}}};
              j["bufferViews"][1]["buffer"] = 1;
            },
            "buffers[1].uri: "},
           {[](json& j) {
              j["buffers"] = {{{"byteLength", 92}}, {{"byteLength", 9}, {"uri", "data:x"}}};
              j["bufferViews"][1]["buffer"] = 1;
            },
            "buffers[1].uri: its data URI has no data"},
           {[](json& j) {
              j["buffers"] = {{{"byteLength", 92}},
                              {{"byteLength", 9}, {"uri", "data:;base64,AB!C"}}};
              j["bufferViews"][1]["buffer"] = 1;
            },
            "buffers[1].uri: its data is not valid base64"},
           {[](json& j) {
              j["extensionsRequired"] = {"VRM_x", "KHR_texture_basisu"};
            },
            "extensionsRequired[1]: it needs the extension KHR_texture_basisu, which Kiln does "
            "not read"},
           {[](json& j) { j["meshes"][0]["primitives"][0]["mode"] = 7; }, "mode"}}) {
    expect_bad_text("a.glb", changed(change), {text});
  }
}

TEST(GltfEdges, ContainersAreCheckedByTheByte) {
  const std::string good = gltf_square().glb();
  const auto with = [&](std::size_t at, std::uint32_t value) {
    std::string text = good;
    std::memcpy(text.data() + at, &value, 4);
    return text;
  };
  expect_bad_text("a.glb", with(4, 1), {"byte 4: it is binary glTF of version 1"});
  expect_bad_text(
      "a.glb", with(8, static_cast<std::uint32_t>(good.size() + 1)),
      {"byte 8: the file is truncated: it should have " + std::to_string(good.size() + 1) +
       " bytes, but has " + std::to_string(good.size())});
  expect_bad_text("a.glb", with(8, 19), {"byte 8: its length of 19 is too short"});
  expect_bad_text("a.glb", with(16, 0x004E4942), {"byte 16: its first chunk is not JSON"});
  expect_bad_text("a.glb", with(12, 1U << 30U),
                  {"byte 12: a chunk should have 1073741824 bytes, but only " +
                   std::to_string(good.size() - 20) + " are left"});
  for (const std::size_t extra : {1U, 9U}) {
    const Loaded loaded = load_text("a.glb", good + std::string(extra, 'x'));
    EXPECT_EQ(loaded.count("trailing-bytes"), extra);
    EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
  }
}

/// Buffers as base64 of both alphabets and as percent-encoded bytes, the second of two.
TEST(GltfEdges, DataUrisHoldTheirBytes) {
  // UVs whose bytes are 3F 80 00 00 and such: all written out.
  // In base64 the first is "----" and the fourth begins with "____".
  const float first = std::bit_cast<float>(0x3EBEEFFBU), fourth = std::bit_cast<float>(0x3EFFFFFFU);
  const std::vector<float> uvs = {first, 1, 1, fourth, 1, 0, 0, -1.9921875F};
  std::string bytes(reinterpret_cast<const char*>(uvs.data()), uvs.size() * 4), percent, base64;
  const char* const digits = "0123456789abcdef";
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    const auto digit = [&](unsigned v) {
      return static_cast<char>(i % 2 == 0 ? std::toupper(digits[v]) : digits[v]);
    };
    percent += std::string("%") + digit(byte >> 4U) + digit(byte & 15U);
  }
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : bytes) {
    bits = bits << 8U | static_cast<unsigned char>(c);
    for (count += 8; count >= 6;) base64 += alphabet[bits >> (count -= 6) & 63U];
  }
  if (count > 0) base64 += alphabet[bits << (6 - count) & 63U];
  for (const std::string& uri :
       {"data:application/octet-stream;base64," + base64 + "==", "data:," + percent}) {
    const Loaded loaded =
        load_text("a.glb", changed([&](json& j) {
                    j["buffers"] = {{{"byteLength", 92}}, {{"byteLength", 32}, {"uri", uri}}};
                    j["bufferViews"][1] = {{"buffer", 1}, {"byteLength", 32}};
                  }));
    ASSERT_EQ(loaded.mesh.uvs.size(), 4U) << uri;
    EXPECT_EQ(loaded.mesh.uvs[0], (Vec2{first, 0}));
    EXPECT_EQ(loaded.mesh.uvs[1], (Vec2{1, 1 - fourth}));
    EXPECT_EQ(loaded.mesh.uvs[3], (Vec2{0, 1 + 1.9921875F}));
  }
}

/// Names of files are percent-encoded; what is no escape stays as it is.
TEST(GltfEdges, NamesOfBuffersAreDecoded) {
  const GltfMaker maker = gltf_square();
  const fs::path folder = scratch_folder();
  for (const auto& [uri, name] :
       std::vector<std::pair<std::string, std::string>>{{"a%20b%2eBIN", "a b.BIN"},
                                                        {"100%.bin", "100%.bin"},
                                                        {"%zz%4", "%zz%4"},
                                                        {"%4G.bin", "%4G.bin"},
                                                        {"%G4.bin", "%G4.bin"},
                                                        {"x%4A%4a", "xJJ"}}) {
    std::ofstream(folder / name, std::ios::binary) << maker.binary();
    json text = maker.json;
    text["buffers"] = {{{"byteLength", maker.binary().size()}, {"uri", uri}}};
    std::ofstream(folder / "a.gltf") << text.dump();
    EXPECT_EQ(load(folder / "a.gltf").mesh.triangles.size(), 2U) << uri;
    fs::remove(folder / name);
  }
}

TEST(GltfEdges, SparseElementsHaveUnsignedPlacesWithin) {
  const auto sparse = [](int type, std::uint32_t second) {
    GltfMaker maker = gltf_square();
    const std::size_t places =
        type == 5121   ? maker.add_view<std::uint8_t>({1, static_cast<std::uint8_t>(second)})
        : type == 5123 ? maker.add_view<std::uint16_t>({1, static_cast<std::uint16_t>(second)})
                       : maker.add_view<std::uint32_t>({1, second});
    const std::size_t values = maker.add_view<float>({5, 6, 7, 8, 9, 10});
    maker.json["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", places}, {"componentType", type}}},
        {"values", {{"bufferView", values}}}};
    return maker.glb();
  };
  for (const int type : {5121, 5123, 5125}) {
    const Loaded loaded = load_text("s.glb", sparse(type, 3));
    EXPECT_EQ(loaded.world(0), (std::array<double, 3>{0, 0, 0}));
    EXPECT_EQ(loaded.world(1), (std::array<double, 3>{5, 6, 7}));
    EXPECT_EQ(loaded.world(2), (std::array<double, 3>{1, 1, 0}));
    EXPECT_EQ(loaded.world(3), (std::array<double, 3>{8, 9, 10}));
    expect_bad_text("s.glb", sparse(type, 4),
                    {"accessors[0].sparse.indices: it refers to element 4, but there are only 4"});
  }
  for (const int type : {5120, 5122, 5126}) {
    expect_bad_text("s.glb", sparse(type, 3),
                    {"accessors[0].sparse.indices: it has indices that are no unsigned integers"});
  }
}

TEST(GltfEdges, IndicesBeyondTheVerticesAreCounted) {
  expect_bad_text("i.glb", changed([](json& j) { j["accessors"][0]["count"] = 3; }), {"3"});
  GltfMaker one;
  const std::size_t positions = one.add<float>("VEC3", {0, 0, 0});
  const std::size_t indices = one.add<std::uint16_t>("SCALAR", {0, 0, 9});
  one.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}});
  expect_bad_text("i.glb", one.glb(),
                  {"accessors[1]: its index 2 is 9, but there is only 1 vertex"});
  GltfMaker two;
  const std::size_t more = two.add<float>("VEC3", {0, 0, 0, 1, 1, 1});
  const std::size_t wrong = two.add<std::uint32_t>("SCALAR", {0, 1, 2});
  two.add_mesh({{"attributes", {{"POSITION", more}}}, {"indices", wrong}});
  expect_bad_text("i.glb", two.glb(),
                  {"accessors[1]: its index 2 is 2, but there are only 2 vertices"});
}

}  // namespace
}  // namespace kiln::test
