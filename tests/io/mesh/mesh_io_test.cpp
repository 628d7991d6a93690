// Reading and writing meshes: every format and variant, and every way a file can be bad.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "io/mesh/mesh_reader.h"
#include "io/mesh/polygon.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/mesh_check.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

struct Loaded {
  Mesh mesh;
  std::vector<Warning> warnings;

  std::uint64_t count(const std::string& code) const {
    std::uint64_t sum = 0;
    for (const Warning& warning : warnings) {
      if (warning.code == code) sum += warning.count;
    }
    return sum;
  }
  std::array<double, 3> world(std::size_t i) const {
    const Vec3& p = mesh.positions[i];
    return {mesh.origin[0] + double{p.x}, mesh.origin[1] + double{p.y},
            mesh.origin[2] + double{p.z}};
  }
};

fs::path write_file(const std::string& name, const std::string& content) {
  const fs::path path = test::scratch_folder() / name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

Loaded load(const fs::path& path) {
  Loaded result;
  result.mesh = load_mesh(path, &result.warnings);
  EXPECT_EQ(test::broken_promise(result.mesh), "") << path;
  return result;
}

Loaded load_text(const std::string& name, const std::string& content) {
  return load(write_file(name, content));
}

/// Loading must fail with an Error(input) whose message holds the path and each of `words`.
void expect_bad(const fs::path& path, const std::vector<std::string>& words) {
  try {
    load_mesh(path);
    ADD_FAILURE() << path << " was read";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::input) << message;
    EXPECT_NE(message.find(path.string()), std::string::npos) << message;
    for (const std::string& word : words) {
      EXPECT_NE(message.find(word), std::string::npos) << "no \"" << word << "\" in: " << message;
    }
  }
}

void expect_bad_text(const std::string& name, const std::string& content,
                     const std::vector<std::string>& words) {
  expect_bad(write_file(name, content), words);
}

// ---- a PLY writer for tests: any type, order and encoding ---------------------------------------

class PlyText {
 public:
  PlyText(std::string encoding, const std::string& header) : encoding_(std::move(encoding)) {
    text_ = "ply\nformat " + encoding_ + " 1.0\n" + header + "end_header\n";
  }
  template <typename T>
  PlyText& put(T value) {
    if (encoding_ == "ascii") {
      char digits[40];
      std::snprintf(digits, sizeof digits, "%.17g ", static_cast<double>(value));
      text_ += digits;
    } else {
      char bytes[sizeof(T)];
      std::memcpy(bytes, &value, sizeof(T));
      const bool big = encoding_ == "binary_big_endian";
      if (big != (std::endian::native == std::endian::big)) std::reverse(bytes, bytes + sizeof(T));
      text_.append(bytes, sizeof(T));
    }
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string encoding_, text_;
};

const std::vector<std::array<double, 3>> pyramid{
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
const std::vector<std::vector<std::uint32_t>> pyramid_faces{
    {0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
const std::vector<Triangle> pyramid_triangles{{0, 3, 2}, {0, 2, 1}, {0, 1, 4},
                                              {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

template <typename Real, typename Count, typename Index>
std::string pyramid_ply(const std::string& encoding, const std::string& real,
                        const std::string& count, const std::string& index) {
  PlyText ply(encoding, "comment made by a test\nelement vertex 5\nproperty " + real +
                            " x\nproperty " + real + " y\nproperty " + real +
                            " z\nelement face 5\nproperty list " + count + " " + index +
                            " vertex_indices\n");
  for (const auto& p : pyramid) {
    for (const double value : p) ply.put(static_cast<Real>(value));
  }
  for (const auto& face : pyramid_faces) {
    ply.put(static_cast<Count>(face.size()));
    for (const std::uint32_t vertex : face) ply.put(static_cast<Index>(vertex));
  }
  return ply.text();
}

void expect_pyramid(const Loaded& loaded) {
  EXPECT_TRUE(loaded.warnings.empty()) << loaded.warnings[0].message;
  EXPECT_EQ(loaded.mesh.triangles, pyramid_triangles);
  ASSERT_EQ(loaded.mesh.positions.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(loaded.world(i), pyramid[i]);
}

TEST(MeshIo, ReadsEveryPlyVariant) {
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(encoding);
    const auto read = [](const std::string& text) { expect_pyramid(load_text("p.ply", text)); };
    read(pyramid_ply<float, std::uint8_t, std::int32_t>(encoding, "float", "uchar", "int"));
    read(pyramid_ply<float, std::uint8_t, std::uint32_t>(encoding, "float32", "uint8", "uint32"));
    read(pyramid_ply<float, std::int32_t, std::int32_t>(encoding, "float", "int", "int"));
    read(pyramid_ply<float, std::uint32_t, std::uint32_t>(encoding, "float", "uint", "uint"));
    read(pyramid_ply<float, std::uint16_t, std::uint16_t>(encoding, "float", "ushort", "uint16"));
    read(pyramid_ply<double, std::uint8_t, std::int32_t>(encoding, "double", "uchar", "int"));
    read(pyramid_ply<double, std::int8_t, std::int8_t>(encoding, "float64", "char", "int8"));
  }
}

TEST(MeshIo, ReadsPlyHeadersWithAnyLineEnding) {
  for (const std::string ending : {"\r\n", "\r"}) {
    std::string text = pyramid_ply<float, std::uint8_t, std::int32_t>("binary_little_endian",
                                                                      "float", "uchar", "int");
    const std::size_t end = text.find("end_header\n") + 11;
    std::string header;
    for (const char c : text.substr(0, end)) header += c == '\n' ? ending : std::string(1, c);
    expect_pyramid(load_text("p.ply", header + text.substr(end)));
  }
}

/// With everything a vertex can have. `double` coordinates take the other of the two decoders.
template <typename Real>
Loaded full_ply(const std::string& encoding, const std::string& real) {
  PlyText ply(encoding, "element vertex 3\nproperty " + real + " x\nproperty " + real +
                            " y\nproperty " + real +
                            " z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                            "property float u\nproperty float v\nproperty uchar red\n"
                            "property uchar green\nproperty uchar blue\nproperty uchar alpha\n"
                            "element face 2\nproperty list uchar int vertex_indices\n");
  for (std::uint8_t i = 0; i < 3; ++i) {
    ply.put(static_cast<Real>(i == 1)).put(static_cast<Real>(i == 2)).put(static_cast<Real>(0.5));
    ply.put(0.0f).put(i == 1 ? -2.0f : 0.0f).put(i == 1 ? 0.0f : 3.0f);
    ply.put(0.25f * i).put(1.0f - 0.25f * i);
    ply.put(i).put(static_cast<std::uint8_t>(10 + i)).put(static_cast<std::uint8_t>(255));
    ply.put(static_cast<std::uint8_t>(100 + i));
  }
  ply.put(std::uint8_t{3}).put(0).put(1).put(2).put(std::uint8_t{3}).put(1).put(0).put(2);
  return load_text("full.ply", ply.text());
}

TEST(MeshIo, KeepsPlyNormalsUvsAndColors) {
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const bool wide : {false, true}) {
      SCOPED_TRACE(encoding + (wide ? " double" : " float"));
      const Loaded loaded =
          wide ? full_ply<double>(encoding, "double") : full_ply<float>(encoding, "float");
      const Mesh& mesh = loaded.mesh;
      EXPECT_TRUE(loaded.warnings.empty());
      EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 0, 2}}));
      EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0.5f}, {1, 0, 0.5f}, {0, 1, 0.5f}}));
      EXPECT_EQ(mesh.normals, (std::vector<Vec3>{{0, 0, 1}, {0, -1, 0}, {0, 0, 1}}));
      EXPECT_EQ(mesh.normal_triangles, mesh.triangles);
      EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 1}, {0.25f, 0.75f}, {0.5f, 0.5f}}));
      EXPECT_EQ(mesh.uv_triangles, mesh.triangles);
      const std::vector<std::array<std::uint8_t, 4>> colors{
          {0, 10, 255, 100}, {1, 11, 255, 101}, {2, 12, 255, 102}};
      EXPECT_EQ(mesh.colors, colors);
    }
  }
}

TEST(MeshIo, KeepsPlyUvsPerCorner) {
  PlyText ply("binary_little_endian",
              "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 1\nproperty list uchar int vertex_indices\nproperty uchar flags\n"
              "property list uchar float texcoord\n");
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f})
    ply.put(value);
  ply.put(std::uint8_t{4}).put(0).put(1).put(2).put(3).put(std::uint8_t{9}).put(std::uint8_t{8});
  for (const float value : {0.f, .1f, .2f, .3f, .4f, .5f, .6f, .7f}) ply.put(value);
  const Loaded loaded = load_text("wedge.ply", ply.text());
  EXPECT_EQ(loaded.mesh.uvs, (std::vector<Vec2>{{0, .1f}, {.2f, .3f}, {.4f, .5f}, {.6f, .7f}}));
  EXPECT_EQ(loaded.mesh.uv_triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(MeshIo, SkipsPlyElementsAndPropertiesItDoesNotUse) {
  const std::string text =
      "ply\nformat ascii 1.0\nobj_info x\nelement camera 1\nproperty list uchar float view\n"
      "property float f\nelement face 1\nproperty uchar material\n"
      "property list uchar int vertex_index\nelement vertex 3\nproperty float confidence\n"
      "property float x\nproperty list uchar int extra\nproperty float y\nproperty float z\n"
      "element edge 1\nproperty int a\nend_header\n2 1 1 50\n7 3 0 1 2\n"
      "9 0 0 0 0\n9 1 2 5 5 0 0\n9 0 1 5 1 0\n";
  const Loaded loaded = load_text("odd.ply", text);
  EXPECT_EQ(loaded.mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(MeshIo, ReadsTheSamplePyramids) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(test::test_data("mesh"))) {
    SCOPED_TRACE(entry.path());
    const Mesh mesh = load(entry.path()).mesh;
    EXPECT_EQ(mesh.positions.size(), 5u);
    EXPECT_EQ(mesh.triangles.size(), 6u);
    EXPECT_EQ(mesh.name, entry.path().stem().string());
    ++files;
  }
  EXPECT_GE(files, 9);
}

// ---- OBJ ---------------------------------------------------------------------------------------

const std::string hard_edge =
    "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5 0\nvn 0 0 2\nvn 0 -1 0\n"
    "o thing\ng floor\ns off\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng wall\nf -5/1/-1 -1/5/-1 "
    "-4/2/-1\n";

TEST(MeshIo, KeepsObjWedgesAndGroups) {
  const Loaded loaded = load_text("edge.obj", hard_edge);
  const Mesh& mesh = loaded.mesh;
  EXPECT_TRUE(loaded.warnings.empty());
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 4, 1}}));
  EXPECT_EQ(mesh.uv_triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 4, 1}}));
  EXPECT_EQ(mesh.normals, (std::vector<Vec3>{{0, 0, 1}, {0, -1, 0}}));
  EXPECT_EQ(mesh.normal_triangles, (std::vector<Triangle>{{0, 0, 0}, {0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(mesh.group_names, (std::vector<std::string>{"thing", "floor", "wall"}));
  EXPECT_EQ(mesh.groups, (std::vector<std::uint32_t>{1, 1, 2}));
  EXPECT_EQ(mesh.object_names, (std::vector<std::string>{"thing"}));
  EXPECT_EQ(mesh.objects, (std::vector<std::uint32_t>{0, 0, 0}));
  EXPECT_EQ(mesh.material_names, (std::vector<std::string>{"m"}));
  EXPECT_EQ(mesh.materials, (std::vector<std::uint32_t>{0, 0, 0}));
  EXPECT_EQ(mesh.material_files, (std::vector<std::string>{"none.mtl"}));
}

TEST(MeshIo, NamesOfObjTrianglesRunApart) {
  const Mesh mesh = load_text("names.obj",
                              "mtllib a b.mtl\nmtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                              "f 1 2 3\nusemtl red paint\nf 1 2 4\no door\nf 1 2 3 4\n"
                              "usemtl blue\ng knob\nf 2 3 4\nusemtl red paint\nf 1 3 4\n")
                        .mesh;
  EXPECT_EQ(mesh.material_names, (std::vector<std::string>{"default", "red paint", "blue"}));
  EXPECT_EQ(mesh.materials, (std::vector<std::uint32_t>{0, 1, 1, 1, 2, 1}));
  EXPECT_EQ(mesh.object_names, (std::vector<std::string>{"default", "door"}));
  EXPECT_EQ(mesh.objects, (std::vector<std::uint32_t>{0, 0, 1, 1, 1, 1}));
  EXPECT_EQ(mesh.group_names, (std::vector<std::string>{"default", "door", "knob"}));
  EXPECT_EQ(mesh.groups, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(mesh.material_files, (std::vector<std::string>{"a b.mtl", "c.mtl"}));
}

TEST(MeshIo, ReadsObjColorsContinuationsForwardReferencesAndCrLf) {
  const Loaded loaded = load_text(
      "odd.obj",
      "f 1 2 \\\r\n 3\r\nv 0 0 0 1 0 0\r\nv 1 0 0 0 0.5 2 # note\r\n\r\nv +0 1e0 0 1 0 0 1\r\n");
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  const std::vector<std::array<std::uint8_t, 4>> colors{
      {255, 0, 0, 255}, {0, 128, 255, 255}, {0, 0, 255, 255}};
  EXPECT_EQ(loaded.mesh.colors, colors);
}

TEST(MeshIo, IgnoresAByteOrderMark) {
  EXPECT_EQ(load_text("bom.obj", "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
                .mesh.positions.size(),
            3u);
}

TEST(MeshIo, KeepsUvsThatAreNotFinite) {
  const Loaded loaded = load_text(
      "uv.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 0 1e99\nvt 1 1\nf 1/1 2/2 3/3\n");
  EXPECT_EQ(loaded.count("non-finite-uvs"), 2u);
  EXPECT_EQ(loaded.mesh.uvs[1].y, std::numeric_limits<float>::infinity());
}

TEST(MeshIo, CompletesPartialObjAttributesAndSaysSo) {
  const Loaded loaded = load_text("partial.obj",
                                  "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0.5 0.5\nvn 0 0 1\n"
                                  "f 1 2 4\ng late\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2 4\ncurv 0 1\n");
  const Mesh& mesh = loaded.mesh;
  EXPECT_EQ(loaded.count("missing-uvs"), 2u);
  EXPECT_EQ(loaded.count("missing-normals"), 2u);
  EXPECT_EQ(loaded.count("missing-colors"), 3u);
  EXPECT_EQ(loaded.count("ignored-statements"), 1u);
  EXPECT_TRUE(std::isnan(mesh.uvs[mesh.uv_triangles[0][0]].x)) << "nothing is baked there";
  EXPECT_EQ(loaded.count("non-finite-uvs"), 0u);
  EXPECT_EQ(mesh.normals[mesh.normal_triangles[2][1]], (Vec3{0, 0, 0}));
  EXPECT_EQ(mesh.group_names, (std::vector<std::string>{"default", "late"}));
  EXPECT_EQ(mesh.groups, (std::vector<std::uint32_t>{0, 1, 1}));
}

// ---- STL and OFF -------------------------------------------------------------------------------

std::string binary_stl(const std::vector<std::array<Vec3, 3>>& triangles,
                       const char* start = "binary") {
  std::string text(80, ' ');
  text.replace(0, std::strlen(start), start);
  const auto put = [&text](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<std::uint32_t>(triangles.size()));
  for (const auto& triangle : triangles) {
    put(Vec3{});
    for (const Vec3& corner : triangle) put(corner);
    put(std::uint16_t{0});
  }
  return text;
}

TEST(MeshIo, WeldsStlCornersAndKeepsDegenerateTriangles) {
  const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0}, d{1, 1, 0}, minus_zero{-0.0f, 0, -0.0f};
  // A header that starts with "solid" does not make it ASCII.
  const Loaded binary = load_text(
      "b.stl", binary_stl({{a, b, c}, {b, b, c}, {d, c, b}, {minus_zero, b, d}}, "solid x"));
  EXPECT_EQ(binary.mesh.positions, (std::vector<Vec3>{a, b, c, d}));
  EXPECT_EQ(binary.mesh.triangles,
            (std::vector<Triangle>{{0, 1, 2}, {1, 1, 2}, {3, 2, 1}, {0, 1, 3}}));
  EXPECT_EQ(binary.count("degenerate-triangles"), 1u);

  const Loaded ascii = load_text("a.stl",
                                 "solid part one\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 "
                                 "0\n  vertex 1 0 0\n  vertex 0 1 0\n"
                                 " endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 "
                                 "0\nvertex 1 1 0\nvertex 0 1 0\n"
                                 "endloop\nendfacet\nendsolid part one\n");
  EXPECT_EQ(ascii.mesh.positions.size(), 4u);
  EXPECT_EQ(ascii.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(ascii.mesh.group_names, (std::vector<std::string>{"part one"}));
}

TEST(MeshIo, WeldsManyStlCorners) {
  // A grid, more vertices than the welder's first table holds: each appears once.
  std::vector<std::array<Vec3, 3>> triangles;
  const int n = 60;
  const auto at = [](int x, int y) {
    return Vec3{static_cast<float>(x) / 7, static_cast<float>(y) / 7, 0};
  };
  for (int x = 0; x < n; ++x) {
    for (int y = 0; y < n; ++y) {
      triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  EXPECT_EQ(load_text("grid.stl", binary_stl(triangles)).mesh.positions.size(),
            static_cast<std::size_t>((n + 1) * (n + 1)));
  // Unconnected triangles share nothing: the table has to grow.
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (Vec3& corner : triangles[t]) corner.z = static_cast<float>(t);
  }
  EXPECT_EQ(load_text("soup.stl", binary_stl(triangles)).mesh.positions.size(),
            3 * triangles.size());
}

TEST(MeshIo, ReadsOffWithItsVariants) {
  const Loaded plain =
      load_text("a.off", "OFF\n# c\n3 1 0 # d\n0 0 0\n\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n");
  EXPECT_EQ(plain.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_TRUE(plain.mesh.colors.empty());
  EXPECT_EQ(load_text("b.off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2").mesh.triangles.size(), 1u);
  const Loaded colored =
      load_text("c.off", "COFF 3 1\n0 0 0 255 0 7\n1 0 0 0.5 0 1.0 0.2\n0 1 0\n3 0 1 2\n");
  const std::vector<std::array<std::uint8_t, 4>> colors{
      {255, 0, 7, 255}, {128, 0, 255, 51}, {255, 255, 255, 255}};
  EXPECT_EQ(colored.mesh.colors, colors);
  EXPECT_EQ(colored.count("missing-colors"), 1u);
  const Loaded full = load_text("d.off",
                                "STCNOFF\n3 1 0\n0 0 0 0 0 4 1 1 1 0 0.5\n1 0 0 0 0 1 1 1 1 1 1\n"
                                "0 1 0 0 1 0 1 1 1 0 0\n3 0 1 2\n");
  EXPECT_EQ(full.mesh.uvs, (std::vector<Vec2>{{0, 0.5f}, {1, 1}, {0, 0}}));
  EXPECT_EQ(full.mesh.normals, (std::vector<Vec3>{{0, 0, 1}, {0, 0, 1}, {0, 1, 0}}));
}

// ---- rules that all formats share ---------------------------------------------------------------

TEST(MeshIo, KeepsNonManifoldFaces) {
  // Four faces on one edge, one of them twice, and one turned.
  const std::string faces = "3 0 1 2\n3 0 1 3\n3 0 1 4\n3 1 0 2\n3 0 1 2\n";
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n";
  PlyText ply("binary_little_endian",
              "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 5\nproperty list uchar int vertex_indices\n");
  for (const float value : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0}) ply.put(value);
  const std::vector<Triangle> expected{{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 2}, {0, 1, 2}};
  for (const Triangle& face : expected) {
    ply.put(std::uint8_t{3});
    for (const std::uint32_t vertex : face) ply.put(static_cast<std::int32_t>(vertex));
  }
  EXPECT_EQ(load_text("fan.ply", ply.text()).mesh.triangles, expected);
  EXPECT_EQ(load_text("fan.off", "OFF\n5 5 0\n" + vertices + faces).mesh.triangles, expected);
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
    sum += 0.5 * ((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x));
  }
  return sum;
}

TEST(MeshIo, SplitsConcavePolygonsWithoutOverlap) {
  // An arrowhead concave at each of its corners in turn, and a comb. Every triangle keeps the
  // polygon's orientation, and the areas add up: no overlap, no gap.
  const std::vector<std::array<double, 2>> arrow{{0, 0}, {2, -1}, {1, 0}, {2, 1}};
  for (std::size_t start = 0; start < 4; ++start) {
    std::string text;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& p = arrow[(start + i) % 4];
      text += "v " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " 0\n";
    }
    const Loaded loaded = load_text("arrow.obj", text + "f 1 2 3 4\n");
    ASSERT_EQ(loaded.mesh.triangles.size(), 2u);
    EXPECT_TRUE(loaded.warnings.empty());
    EXPECT_NEAR(area_of(loaded.mesh), 1, 1e-6);
    for (const Triangle& triangle : loaded.mesh.triangles) {
      Mesh one = loaded.mesh;
      one.triangles = {triangle};
      EXPECT_GT(area_of(one), 0.1);
    }
  }
  std::string comb, face = "f";
  double area = 0;
  const int teeth = 20;
  for (int i = 0; i < teeth; ++i) {  // along the bottom, up and down
    comb += "v " + std::to_string(2 * i) + " 0 0\nv " + std::to_string(2 * i + 1) + " 5 0\n";
  }
  comb +=
      "v " + std::to_string(2 * teeth) + " 0 0\nv " + std::to_string(2 * teeth) + " 6 0\nv 0 6 0\n";
  for (int i = 0; i < 2 * teeth + 3; ++i) face += " " + std::to_string(i + 1);
  area = 2 * teeth * 6 - teeth * 5;
  const Loaded loaded = load_text("comb.obj", comb + face + "\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), static_cast<std::size_t>(2 * teeth + 1));
  EXPECT_NEAR(area_of(loaded.mesh), area, 1e-4);
  for (const Triangle& triangle : loaded.mesh.triangles) {
    Mesh one = loaded.mesh;
    one.triangles = {triangle};
    EXPECT_GE(area_of(one), 0);
  }
}

TEST(MeshIo, SplitsHopelessPolygonsAsFansAndSaysSo) {
  // Crosses itself; no ear anywhere near the end. Wedges follow the corners.
  const Loaded loaded =
      load_text("bow.obj",
                "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                "vt 0 0\nvt 1 1\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3 4/4\nf 1/1 2/2 5/1\n");
  ASSERT_EQ(loaded.mesh.triangles.size(), 3u);
  EXPECT_EQ(loaded.count("fan-split-polygons"), 1u);
  EXPECT_EQ(loaded.mesh.triangles[0], loaded.mesh.uv_triangles[0]);
  EXPECT_EQ(loaded.mesh.triangles[1], loaded.mesh.uv_triangles[1]);
}

TEST(MeshIo, SplitsHugePolygonsInBoundedTime) {
  // A spiral star that has few ears at a time.
  std::vector<std::array<double, 3>> corners;
  for (int i = 0; i < 60000; ++i) {
    const double angle = i * 0.37, radius = i % 2 == 0 ? 1.0 : 0.2 + 0.0001 * (i % 777);
    corners.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  std::vector<Triangle> triangles;
  triangulate(corners, triangles);
  EXPECT_EQ(triangles.size(), corners.size() - 2);
}

TEST(MeshIo, KeepsDetailFarFromTheOrigin) {
  const std::vector<std::array<double, 3>> points{{1000000.123, -2000000.456, 0.001},
                                                  {1000000.124, -2000000.456, 0.001},
                                                  {1000000.123, -2000000.455, 0.0017}};
  const double size = 0.001;
  const auto check = [&](const Loaded& loaded) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        // 1e-6 of the object, beside what the decimal number loses as a double (2^-53 of 2e6).
        EXPECT_NEAR(loaded.world(i)[k], points[i][k], 1e-6 * size + 2.4e-10);
      }
    }
    EXPECT_LT(std::abs(loaded.mesh.positions[0].x), 0.1f);
  };
  char text[512];
  std::string lines;
  for (const auto& p : points) {
    std::snprintf(text, sizeof text, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
    lines += text;
  }
  const Loaded off = load_text("far.off", "OFF\n3 1 0\n" + lines + "3 0 1 2\n");
  check(off);
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    PlyText ply(encoding,
                "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
                "element face 1\nproperty list uchar int vertex_indices\n");
    for (const auto& p : points) ply.put(p[0]).put(p[1]).put(p[2]);
    ply.put(std::uint8_t{3}).put(0).put(1).put(2);
    check(load_text("far.ply", ply.text()));
  }
  // Out and back in.
  const fs::path saved = test::scratch_folder() / "far.obj";
  save_obj(off.mesh, saved);
  const Loaded again = load(saved);
  check(again);
  EXPECT_EQ(again.mesh.origin, off.mesh.origin);
  EXPECT_EQ(again.mesh.triangles, off.mesh.triangles);
}

TEST(MeshIo, LeavesNearMeshesAtTheOrigin) {
  const Loaded loaded = load_text("near.obj", "v 10 10 10\nv 11 10 10\nv 10 11 10\nf 1 2 3\n");
  EXPECT_EQ(loaded.mesh.origin, (std::array<double, 3>{}));
  EXPECT_EQ(loaded.mesh.positions[1], (Vec3{11, 10, 10}));
}

TEST(MeshIo, ReadsHugeAndTinyCoordinates) {
  for (const std::string scale : {"1e30", "1e-30", "3e38"}) {
    const Loaded loaded =
        load_text("s.obj", "v 0 0 0\nv " + scale + " 0 0\nv 0 " + scale + " 0\nf 1 2 3\n");
    EXPECT_EQ(loaded.mesh.positions[1].x, std::stof(scale));
    EXPECT_TRUE(loaded.warnings.empty()) << scale;
  }
  expect_bad_text("s.obj", "v 0 0 0\nv 1e39 0 0\nv 0 1e39 0\nf 1 2 3\n", {"range", "Scale"});
  expect_bad_text("s.obj", "v -1e308 0 0\nv 1e308 0 0\nv 0 1e308 0\nf 1 2 3\n", {"range", "Scale"});
  expect_bad_text("s.obj", "v 0 0 0\nv 1e-45 0 0\nv 0 1e-45 0\nf 1 2 3\n", {"below", "Scale"});
}

TEST(MeshIo, KeepsNonFiniteVertices) {
  const std::string body = "0 0 0\n1 0 0\n0 1 0\nnan 0 0\n0 -inf 0\n",
                    faces = "3 0 1 2\n3 0 1 3\n3 0 4 2\n";
  const auto check = [](const Loaded& loaded) {
    EXPECT_EQ(loaded.count("non-finite-vertices"), 2u);
    ASSERT_EQ(loaded.mesh.positions.size(), 5u);
    EXPECT_EQ(loaded.mesh.triangles.size(), 3u);
    EXPECT_TRUE(std::isnan(loaded.mesh.positions[3].x));
    EXPECT_EQ(loaded.mesh.positions[4].y, -std::numeric_limits<float>::infinity());
    EXPECT_EQ(loaded.mesh.positions[2], (Vec3{0, 1, 0}));
  };
  check(load_text("n.off", "OFF\n5 3 0\n" + body + faces));
  const std::string header =
      "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 3\nproperty list uchar int vertex_indices\n";
  check(load_text("n.ply", PlyText("ascii", header).text() + body + faces));
  PlyText binary("binary_little_endian", header);
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  for (const float value :
       {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, nan, 0.f, 0.f, 0.f, -inf, 0.f}) {
    binary.put(value);
  }
  for (const Triangle& face : {Triangle{0, 1, 2}, Triangle{0, 1, 3}, Triangle{0, 4, 2}}) {
    binary.put(std::uint8_t{3});
    for (const std::uint32_t vertex : face) binary.put(vertex);
  }
  check(load_text("n.ply", binary.text()));
}

TEST(MeshIo, KeepsDegenerateTrianglesAndLeavesOutShortFaces) {
  const Loaded loaded = load_text(
      "d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\nf 1 2 4\nf 1 2\nf 3\n");
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 0, 1}, {0, 1, 3}}));
  EXPECT_EQ(loaded.count("degenerate-triangles"), 2u);
  EXPECT_EQ(loaded.count("short-faces"), 2u);
  for (const Warning& warning : loaded.warnings) {
    if (warning.code == "degenerate-triangles") {
      EXPECT_NE(warning.message.find("line 6"), std::string::npos) << warning.message;
    }
  }
}

// ---- bad files ----------------------------------------------------------------------------------

TEST(MeshIo, RefusesPathsThatAreNotFiles) {
  const fs::path folder = test::scratch_folder();
  expect_bad(folder / "none.ply", {"no such file", "Check"});
  fs::create_directory(folder / "folder.obj");
  expect_bad(folder / "folder.obj", {"directory", "Name"});
  ASSERT_EQ(mkfifo((folder / "pipe.ply").c_str(), 0600), 0);
  expect_bad(folder / "pipe.ply", {"regular file", "Copy"});
  if (geteuid() != 0) {  // root may read everything
    const fs::path locked = write_file("locked.ply", "ply\n");
    fs::permissions(locked, fs::perms::none);
    expect_bad(locked, {"cannot be opened", "permission"});
  }
}

TEST(MeshIo, RefusesWrongAndUnknownExtensions) {
  const std::string ply = pyramid_ply<float, std::uint8_t, std::int32_t>("binary_little_endian",
                                                                         "float", "uchar", "int");
  expect_bad_text("a.obj", ply, {"OBJ", "looks like PLY", "Rename", ".ply"});
  expect_bad_text("a.stl", ply, {"looks like PLY", "Rename"});
  expect_bad_text("a.ply", hard_edge, {"looks like OBJ", "Rename", ".obj"});
  expect_bad_text("a.ply", binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}}),
                  {"looks like STL"});
  expect_bad_text("a.obj", "OFF\n3 1 0\n", {"looks like OFF"});
  expect_bad_text("a.obj", "glTF\2", {"glTF", "Export"});
  expect_bad_text("a.fbx", "Kaydara FBX Binary", {".fbx", "FBX", ".ply", ".obj", ".stl", ".off"});
  expect_bad_text("mesh", ply, {"no extension", "PLY", ".obj"});
  EXPECT_EQ(load_text("UPPER.PLY", ply).mesh.triangles.size(), 6u);
}

TEST(MeshIo, RefusesEmptyFilesAndGarbage) {
  std::string garbage;
  std::uint32_t state = 1;
  for (int i = 0; i < 5000; ++i) {
    state = state * 1664525u + 1013904223u;
    garbage += static_cast<char>(state >> 24);
  }
  for (const std::string extension : {"ply", "obj", "stl", "off"}) {
    expect_bad_text("e." + extension, "", {"empty", "Export"});
    expect_bad_text("g." + extension, garbage, {"xport"});
    expect_bad_text("w." + extension, " \n\n", {"xport"});
  }
}

TEST(MeshIo, RefusesTruncatedFiles) {
  // Cut anywhere, a file gives an error or, where only the last line's end is missing, the mesh.
  const auto cut = [](const std::string& name, const std::string& text, std::size_t tail) {
    for (std::size_t size = 0; size + tail < text.size(); ++size) {
      const MeshInput input{name, std::string_view(text).substr(0, size)};
      const MeshFormat format = name.ends_with("ply")   ? MeshFormat::ply
                                : name.ends_with("stl") ? MeshFormat::stl
                                                        : MeshFormat::off;
      try {
        parse_mesh(input, format);
        ADD_FAILURE() << name << " cut to " << size << " bytes was read";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
        EXPECT_EQ(std::string(error.what()).find(name), 0u);
      }
    }
  };
  for (const std::string encoding : {"binary_little_endian", "binary_big_endian"}) {
    cut("f.ply", pyramid_ply<float, std::uint8_t, std::int32_t>(encoding, "float", "uchar", "int"),
        0);
    cut("d.ply",
        pyramid_ply<double, std::uint8_t, std::int32_t>(encoding, "double", "uchar", "int"), 0);
  }
  cut("a.ply", pyramid_ply<float, std::uint8_t, std::int32_t>("ascii", "float", "uchar", "int"), 1);
  cut("b.stl", binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}}), 0);
  cut("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 1);
  expect_bad_text("t.ply",
                  pyramid_ply<float, std::uint8_t, std::int32_t>("binary_little_endian", "float",
                                                                 "uchar", "int")
                      .substr(0, 260),
                  {"truncated", "Copy"});
  expect_bad_text("t.obj", "v 0 0 0\nv 1 0\n", {"line 2", "missing", "export"});
  expect_bad_text("t.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
                  {"line 5", "truncated", "Copy"});
}

TEST(MeshIo, RefusesCountsThatTheFileCannotHold) {
  const std::string tail = "\nproperty float x\nproperty float y\nproperty float z\nelement face ";
  const std::string list =
      "\nproperty list uchar int vertex_indices\nend_header\n0 0 0 12345678901234567890\n";
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    const std::string start = "ply\nformat " + format + " 1.0\nelement vertex ";
    expect_bad_text("c.ply", start + "4000000000" + tail + "1" + list,
                    {"4000000000", "vertex", "truncated"});
    expect_bad_text("c.ply", start + "1" + tail + "4000000000" + list,
                    {"4000000000", "face", "truncated"});
    expect_bad_text("c.ply", start + "9223372036854775807" + tail + "1" + list, {"truncated"});
    expect_bad_text("c.ply", start + "99999999999999999999" + tail + "1" + list,
                    {"count", "line 3"});
    expect_bad_text("c.ply", start + "-1" + tail + "1" + list, {"count", "line 3"});
  }
  std::string stl = binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}});
  stl[83] = '\x7f';
  expect_bad_text("c.stl", stl, {"promises", "truncated", "again"});
  expect_bad_text("c.off", "OFF\n4000000000 1 0\n0 0 0\n", {"4000000000", "truncated"});
  expect_bad_text("c.off", "OFF\n1 4000000000 0\n0 0 0\n", {"4000000000", "truncated"});
  expect_bad_text("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
                  {"face 0", "line 6"});
}

TEST(MeshIo, RefusesIndicesOutOfRange) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1 2 3\n";
  expect_bad_text("i.obj", obj + "f 1 2 9\n", {"line 7", "vertex 9", "are 3"});
  expect_bad_text("i.obj", obj + "f 0 1 2\n", {"line 7", "face 1", "vertex 0", "count from 1"});
  expect_bad_text("i.obj", obj + "f -4 1 2\n", {"line 7", "vertex -4"});
  expect_bad_text("i.obj", obj + "f 1/2 2/1 3/1\n", {"line 7", "texture coordinate 2"});
  expect_bad_text("i.obj", obj + "f 1//7 2//1 3//1\n", {"line 7", "normal 7"});
  expect_bad_text("i.obj", obj + "f 1 x 3\n", {"line 7", "\"x\"", "export"});
  expect_bad_text("i.obj", obj + "f 1 99999999999999999999 3\n", {"line 7"});
  expect_bad_text("i.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n",
                  {"line 7", "face 1", "vertex 3", "are 3", "export"});
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const std::int32_t bad : {3, -1, 2147483647}) {
      PlyText ply(encoding,
                  "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 2\nproperty list uchar int vertex_indices\n");
      for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) ply.put(value);
      ply.put(std::uint8_t{3}).put(0).put(1).put(2).put(std::uint8_t{3}).put(0).put(1).put(bad);
      expect_bad_text("i.ply", ply.text(), {"face 1", std::to_string(bad), "are 3", "xport"});
    }
  }
}

TEST(MeshIo, RefusesMeshesWithoutASurface) {
  const std::string points =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string body = "0 0 0\n1 1 1\n";
  expect_bad_text("p.ply", PlyText("ascii", points).text() + body,
                  {"no faces", "2 points", "surface"});
  expect_bad_text(
      "p.ply",
      PlyText("ascii", points + "element face 0\nproperty list uchar int vertex_indices\n").text() +
          body,
      {"no faces", "surface"});
  expect_bad_text(
      "p.ply",
      PlyText("ascii", points + "element tristrips 1\nproperty list int int vertex_indices\n")
              .text() +
          body + "0\n",
      {"no faces", "surface"});
  expect_bad_text("p.obj", "v 0 0 0\nv 1 0 0\n", {"no faces", "surface"});
  expect_bad_text("p.off", "OFF\n2 0 0\n0 0 0\n1 0 0\n", {"no faces", "surface"});
  expect_bad_text("p.stl", "solid x\nendsolid x\n", {"no faces"});
  expect_bad_text("p.stl", binary_stl({}), {"no faces"});
  expect_bad_text("d.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n",
                  {"line 4", "degenerate", "xport"});
  expect_bad_text("d.obj", "v nan 0 0\nv inf 0 0\nv 0 0 -inf\nf 1 2 3\n", {"NaN", "xport"});
  expect_bad_text("d.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"degenerate", "xport"});
}

TEST(MeshIo, RefusesBadWordsWithTheirLine) {
  expect_bad_text("w.ply",
                  "ply\nformat ascii 1.0\nelement vertex 1\nproperty floaty x\nend_header\n",
                  {"line 4", "floaty", "xport"});
  expect_bad_text("w.ply", "ply\nformat text 1.0\nend_header\n", {"line 2", "text"});
  expect_bad_text("w.ply", "ply\nformat ascii 1.0\nelement face 1\nend_header\n", {"vertex"});
  expect_bad_text("w.ply",
                  pyramid_ply<float, std::uint8_t, std::int32_t>("ascii", "float", "uchar", "int")
                      .replace(200, 1, "?"),
                  {"line", "?", "xport"});
  expect_bad_text("w.off", "OFF BINARY\n", {"binary", "Convert"});
  expect_bad_text("w.off", "4OFF\n3 1 0\n", {"dimensions"});
  expect_bad_text("w.off", "OFF\n3 1 0\n0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n",
                  {"line 4", "vertex 1", "zero"});
  expect_bad_text("w.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n",
                  {"line 4", "zero"});
  expect_bad_text("w.obj", "v 0 zero 0\n", {"line 1", "zero", "Correct"});
}

TEST(MeshIo, SurvivesWhatFuzzersFound) {
  const std::array<std::pair<const char*, MeshFormat>, 4> formats{{{"ply", MeshFormat::ply},
                                                                   {"obj", MeshFormat::obj},
                                                                   {"stl", MeshFormat::stl},
                                                                   {"off", MeshFormat::off}}};
  int files = 0;
  for (const auto& [name, format] : formats) {
    for (const auto& entry : fs::directory_iterator(test::test_data("fuzz") / name)) {
      SCOPED_TRACE(entry.path());
      std::stringstream content;
      content << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      const std::string bytes = content.str();
      try {
        EXPECT_EQ(test::broken_promise(parse_mesh({entry.path().string(), bytes}, format)), "");
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
      }
      ++files;
    }
  }
  EXPECT_GE(files, 4);
}

// ---- writing ------------------------------------------------------------------------------------

TEST(MeshIo, WritesWhatItReads) {
  Mesh mesh = load_text("edge.obj", hard_edge).mesh;
  mesh.positions[1] = {0.1f, -3.4e38f, 1e-30f};
  mesh.positions[2] = {1.0f / 3, 16777217.0f, 1.17549435e-38f};
  mesh.normals[0] = {0.6f, 0, -0.8f};
  mesh.uvs[1] = {0.1f, 1.0f / 7};
  mesh.colors.assign(mesh.positions.size(), {1, 127, 254, 255});
  const fs::path path = test::scratch_folder() / "out.obj";
  save_obj(mesh, path);
  const Mesh again = load(path).mesh;
  EXPECT_EQ(again.name, "out");
  EXPECT_EQ(again.origin, mesh.origin);
  EXPECT_EQ(again.positions, mesh.positions);
  EXPECT_EQ(again.triangles, mesh.triangles);
  EXPECT_EQ(again.uvs, mesh.uvs);
  EXPECT_EQ(again.uv_triangles, mesh.uv_triangles);
  EXPECT_EQ(again.normals, mesh.normals);
  EXPECT_EQ(again.normal_triangles, mesh.normal_triangles);
  EXPECT_EQ(again.colors, mesh.colors);
  EXPECT_EQ(again.groups, mesh.groups);
  EXPECT_EQ(again.group_names, mesh.group_names);
  EXPECT_EQ(again.materials, mesh.materials);
  EXPECT_EQ(again.material_names, mesh.material_names);
}

TEST(MeshIo, WritesAndReadsAnyFiniteMesh) {
  const fs::path path = test::scratch_folder() / "any.obj";
  EXPECT_TRUE(rc::check("positions and triangles come back bit by bit", [&path] {
    Mesh mesh;
    // Any finite float that is not too large beside the others to keep the mesh near its origin.
    const auto any_float =
        rc::gen::map(rc::gen::arbitrary<std::uint32_t>(), [](std::uint32_t bits) {
          const float value = std::bit_cast<float>(bits);
          return std::isfinite(value) && std::abs(value) < 1e30f ? value : 0.5f;
        });
    for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
      mesh.positions.push_back({*any_float, *any_float, *any_float});
    }
    // A triangle around all of them: some area, and a box around the world's origin.
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{-1e31f, -1e31f, 0}, {1e31f, 0, 0}, {0, 1e31f, 1}});
    mesh.triangles.push_back({n, n + 1, n + 2});
    for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
      const auto index = rc::gen::inRange<std::uint32_t>(0, n + 3);
      mesh.triangles.push_back({*index, *index, *index});
    }
    save_obj(mesh, path);
    const Mesh again = load_mesh(path);
    RC_ASSERT(again.positions == mesh.positions);
    RC_ASSERT(again.triangles == mesh.triangles);
  }));
}

TEST(MeshIo, WritesNothingOrAll) {
  Mesh mesh = load_text("edge.obj", hard_edge).mesh;
  const fs::path folder = test::scratch_folder(), path = folder / "out.obj";
  save_obj(mesh, path);
  mesh.triangles[0][0] = 99;
  EXPECT_THROW(save_obj(mesh, path), Error);
  EXPECT_EQ(load(path).mesh.triangles.size(), 3u);  // the old file is still there
  mesh.triangles[0][0] = 0;
  mesh.group_names[1] = "two\nlines # and \\";
  save_obj(mesh, path);
  EXPECT_EQ(load(path).mesh.group_names[1], "two_lines _ and _");
  try {
    save_obj(mesh, folder / "missing" / "out.obj");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::output);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST(MeshIo, ReadsTheBunny) {
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Loaded high = load(*test::shared_data("bunny_high.ply"));
  EXPECT_EQ(high.mesh.triangles.size(), 69451u);
  EXPECT_EQ(high.mesh.positions.size(), 35947u);
  EXPECT_TRUE(high.warnings.empty());
  const Loaded low = load(*test::shared_data("bunny_low.obj"));
  EXPECT_EQ(low.mesh.triangles.size(), 2083u);
  EXPECT_EQ(low.mesh.uv_triangles.size(), 2083u);
  const fs::path path = test::scratch_folder() / "bunny.obj";
  save_obj(high.mesh, path);
  const Loaded again = load(path);
  EXPECT_EQ(again.mesh.positions, high.mesh.positions);
  EXPECT_EQ(again.mesh.triangles, high.mesh.triangles);
}

}  // namespace
}  // namespace kiln
