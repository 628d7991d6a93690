// Reading meshes: every format and its variants.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "asset/mesh_files.h"
#include "asset/stl_triangles.h"
#include "kiln/mesh.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::mesh_files::binary_stl;
using test::mesh_files::expect_bad_text;
using test::mesh_files::hard_edge;
using test::mesh_files::load;
using test::mesh_files::load_text;
using test::mesh_files::Loaded;
using test::mesh_files::PlyText;
using test::mesh_files::pyramid;
using test::mesh_files::pyramid_ply;

// ---- PLY ----------------------------------------------------------------------------------------

const std::vector<Triangle> pyramid_triangles{{0, 3, 2}, {0, 2, 1}, {0, 1, 4},
                                              {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

void expect_pyramid(const Loaded& loaded) {
  EXPECT_TRUE(loaded.warnings.empty()) << loaded.warnings[0].message.text();
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

/// 70,000 faces, so that threads share them, over 300 vertices with all that these may have.
std::string many_faces(const std::string& encoding, std::uint32_t quad, std::uint32_t wrong) {
  constexpr std::uint32_t kVertices = 300, kFaces = 70000;
  PlyText ply(encoding,
              "element vertex 300\nproperty uchar red\nproperty float y\nproperty double x\n"
              "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
              "property short spare\nproperty float s\nproperty float t\nproperty uchar green\n"
              "property uchar blue\nelement face 70000\nproperty list uchar uint vertex_index\n");
  for (std::uint32_t v = 0; v < kVertices; ++v) {
    const auto f = [&](double factor) {
      return static_cast<float>(std::fmod(factor * (v + 1), 7.0));
    };
    ply.put(static_cast<std::uint8_t>(v)).put(f(2.3)).put(double{f(3.1)} + 1e-9).put(f(1.7));
    ply.put(0.6F).put(0.0F).put(v % 2 == 0 ? 0.8F : -0.8F);
    ply.put(std::int16_t{-7}).put(f(0.11)).put(f(0.13));
    ply.put(static_cast<std::uint8_t>(v / 2)).put(static_cast<std::uint8_t>(v / 3));
  }
  for (std::uint32_t i = 0; i < kFaces; ++i) {
    const bool four = i == quad;
    ply.put(static_cast<std::uint8_t>(four ? 4 : 3));
    for (std::uint32_t k = 0; k < (four ? 4U : 3U); ++k) {
      const std::uint32_t vertex = (i + k * (1 + i / kVertices % 90)) % kVertices;
      ply.put(i == wrong && k == 2 ? kVertices : vertex);
    }
  }
  return ply.text();
}

TEST(MeshIo, BinaryPlyOfManyFacesIsThatOfText) {
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  for (const std::uint32_t quad : {kNone, 0U, 69'999U}) {
    SCOPED_TRACE(quad);
    const Mesh text = load_text("many.ply", many_faces("ascii", quad, kNone)).mesh;
    ASSERT_EQ(text.triangles.size(), quad == kNone ? 70000 : 70001);
    ASSERT_FALSE(text.uv_triangles.empty());
    ASSERT_FALSE(text.normal_triangles.empty());
    ASSERT_EQ(text.colors.size(), 300);
    for (const std::string encoding : {"binary_little_endian", "binary_big_endian"}) {
      SCOPED_TRACE(encoding);
      const Mesh mesh = load_text("many.ply", many_faces(encoding, quad, kNone)).mesh;
      EXPECT_EQ(mesh.origin, text.origin);
      EXPECT_EQ(mesh.positions, text.positions);
      EXPECT_EQ(mesh.triangles, text.triangles);
      EXPECT_EQ(mesh.uv_triangles, text.uv_triangles);
      EXPECT_EQ(mesh.normal_triangles, text.normal_triangles);
      EXPECT_EQ(mesh.normals, text.normals);
      EXPECT_EQ(mesh.colors, text.colors);
      EXPECT_EQ(mesh.uvs, text.uvs);
    }
  }
}

TEST(MeshIo, NamesTheFaceOfABinaryPlyWhoseVertexIsMissing) {
  for (const std::uint32_t wrong : {0U, 69'999U}) {
    expect_bad_text("many.ply", many_faces("binary_little_endian", 0xFFFFFFFFU, wrong),
                    {"face " + std::to_string(wrong) + " uses vertex 300"});
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
      "f 1 2 \\\r\n 3\r\nv 0 0 0 1 0 0\r\nv 1 0 0 0 0.5 1 # note\r\n\r\nv +0 1e0 0 0 0 1 0.2\r\n");
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  const std::vector<std::array<std::uint8_t, 4>> colors{
      {255, 0, 0, 255}, {0, 128, 255, 255}, {0, 0, 255, 51}};
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

/// Nouns, verbs and examples of messages agree with one and with many.
TEST(MeshIo, MessagesAgreeWithTheirCounts) {
  const auto message = [](const std::string& name, const std::string& text, const char* code) {
    for (const Warning& warning : load_text(name, text).warnings) {
      if (warning.code == code) return std::string(warning.message.text());
    }
    return std::string();
  };
  const std::string face = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto ends_with = [](const std::string& text, const std::string& end) {
    EXPECT_TRUE(text.ends_with(end)) << text;
  };
  ends_with(message("a.obj", face + "curv 0 1\n", "ignored-statements"),
            "1 statement of a kind that Kiln does not use (\"line 5: curv\") was ignored.");
  ends_with(
      message("a.obj", face + "curv 0 1\ncurv 0 1\n", "ignored-statements"),
      "2 statements of kinds that Kiln does not use (\"line 5: curv\" for one) were ignored.");
  const std::string one = message("a.obj", face + "#MRGB 0011zz22\n", "bad-polypaint"),
                    two = message("a.obj", face + "#MRGB 0011zz22\n#MRGB 0011zz33\n",
                                  "bad-polypaint");
  EXPECT_NE(one.find("1 colour in its #MRGB"), std::string::npos) << one;
  ends_with(one, "or belongs to no vertex, and was ignored.");
  EXPECT_NE(two.find("2 colours in its #MRGB"), std::string::npos) << two;
  ends_with(two, "or belong to no vertex, and were ignored.");
}

// ---- STL and OFF -------------------------------------------------------------------------------

/// Cinema 4D writes the index 0 where a corner has no normal.
TEST(MeshIo, IndicesOfZeroAreNone) {
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.5 0\nvt 1 0\nvt 1 1\nvn 0 1 0\n";
  const Loaded half = load_text("z.obj", obj + "f 1/1/1 2/2/1 3/3/1\nf 1/1/0 3/2/0 4/3/0\n");
  EXPECT_EQ(half.count("zero-indices"), 3U);
  EXPECT_EQ(half.count("missing-normals"), 1U);
  EXPECT_EQ(half.mesh.normals[half.mesh.normal_triangles[0][1]], (Vec3{0, 1, 0}));
  EXPECT_EQ(half.mesh.normals[half.mesh.normal_triangles[1][1]], Vec3{});
  const Loaded none = load_text("z.obj", obj + "f 1/1/0 2/2/0 3/3/0\n");
  EXPECT_TRUE(none.mesh.normal_triangles.empty());
  EXPECT_EQ(none.mesh.uvs[none.mesh.uv_triangles[0][0]], (Vec2{0.5F, 0}));
  EXPECT_EQ(none.count("zero-indices"), 3U);
  const Loaded uvs = load_text("z.obj", obj + "f 1/0/1 2/0/1 3/0/1\nf 1/1/1 3/2/1 4/0/1\n");
  EXPECT_EQ(uvs.count("zero-indices"), 4U);
  EXPECT_EQ(uvs.count("missing-uvs"), 2U);
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

/// Memory is checked before the table grows: for twice as many slots as vertices, and for vertices that will follow.
TEST(MeshIo, WelderChecksMemoryBeforeItGrows) {
  using Position = std::array<float, 3>;
  std::vector<Position> positions;
  std::size_t checks = 0;
  CornerWelder<Position> welder(positions, 5, [&](std::size_t slots, std::size_t vertices) {
    ++checks;
    EXPECT_GE(slots, 2 * vertices);
    EXPECT_GT(vertices, positions.size());
  });
  EXPECT_EQ(checks, 1U);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    EXPECT_EQ(welder.add({static_cast<float>(i), 0, 0}), i);
    EXPECT_EQ(welder.add({static_cast<float>(i / 2), -0.0F, 0}), i / 2);
  }
  EXPECT_GE(checks, 5U);
}

TEST(MeshIo, ReadsOffWithItsVariants) {
  const Loaded plain =
      load_text("a.off", "OFF\n# c\n3 1 0 # d\n0 0 0\n\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n");
  EXPECT_EQ(plain.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(plain.mesh.colors, (std::vector<std::array<std::uint8_t, 4>>(3, {255, 0, 0, 255})));
  EXPECT_EQ(load_text("b.off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2").mesh.triangles.size(), 1u);
  const Loaded colored =
      load_text("c.off", "COFF 3 1\n0 0 0 255 0 7\n1 0 0 128.0 0 255 51\n0 1 0\n3 0 1 2\n");
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

// ---- a scan -------------------------------------------------------------------------------------

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
