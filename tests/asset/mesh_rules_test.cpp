// Reading meshes: the rules that all formats share, of polygons, places and degenerate faces.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "asset/mesh_files.h"
#include "kiln/mesh.h"
#include "mesh/polygon.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::mesh_files::expect_bad_text;
using test::mesh_files::load;
using test::mesh_files::load_text;
using test::mesh_files::Loaded;
using test::mesh_files::PlyText;

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

/// A roof of two quads over the edge 1 2, whose normals are (0, -1, 1) and (0, 1, 1) before they are unit. The
/// second's vertices at that edge are copies.
std::string roof(const std::string& first, const std::string& second) {
  return "v 0 -1 0\nv 0 0 1\nv 1 0 1\nv 1 -1 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\n" + first +
         "f 1 4 3 2\n" + second + "f 7 8 6 5\n";
}

TEST(MeshIo, SmoothingGroupsMakeHardEdges) {
  const float half = std::sqrt(0.5F);
  const auto normals_of = [&](const std::string& first, const std::string& second) {
    return load_text("roof.obj", roof(first, second)).mesh;
  };
  for (const auto& [first, second] : std::vector<std::array<std::string, 2>>{
           {"s 1\n", "s 2\n"}, {"s 1\n", "s off\n"}, {"", "s 3\n"}, {"s 0\n", "s 1\n"}}) {
    const Mesh mesh = normals_of(first, second);
    ASSERT_EQ(mesh.normal_triangles.size(), 4U) << first << second;
    for (std::size_t t = 0; t < 4; ++t) {
      for (const std::uint32_t corner : mesh.normal_triangles[t]) {
        EXPECT_NEAR(mesh.normals[corner].y, t < 2 ? -half : half, 1e-6) << first << second << t;
        EXPECT_NEAR(mesh.normals[corner].z, half, 1e-6) << first << second << t;
      }
    }
  }
  // A group that all share, or none, says nothing of edges: normals are computed when they are needed.
  for (const char* all : {"", "s 1\n", "s off\n"}) {
    EXPECT_TRUE(normals_of(all, "").normal_triangles.empty()) << all;
    EXPECT_TRUE(normals_of(all, all).normal_triangles.empty()) << all;
  }
  // Within a group, the copies at the edge share a normal with what they are copies of.
  const Mesh mesh = load_text("roof.obj", roof("s 1\n", "s 1\n") + "s 2\nf 1 2 5\n").mesh;
  ASSERT_EQ(mesh.normal_triangles.size(), 5U);
  for (const std::size_t t : {0U, 1U, 2U, 3U}) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& n = mesh.normals[mesh.normal_triangles[t][k]];
      const bool ridge = mesh.positions[mesh.triangles[t][k]].z > 0.5F;
      EXPECT_NEAR(n.y, ridge ? 0 : t < 2 ? -half : half, 1e-6) << t << k;
    }
  }
  EXPECT_NEAR(mesh.normals[mesh.normal_triangles[4][0]].x, -1, 1e-6);
  // Normals of the file come before groups.
  const Mesh own = load_text("roof.obj",
                             "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\ns 1\nf 1//1 2//1 3//1\n"
                             "s 2\nf 2//1 4//1 3//1\n")
                       .mesh;
  EXPECT_EQ(own.normals.size(), 1U);
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

constexpr std::array<std::array<double, 3>, 4> kFar = {{{500000.30, 4500000.30, 300.0},
                                                        {500001.10, 4500000.30, 300.0},
                                                        {500001.10, 4500001.10, 300.2},
                                                        {500000.30, 4500001.10, 300.2}}};

std::string lines_of_far(const std::string& before) {
  std::string lines;
  for (const auto& p : kFar) {
    char text[128];
    std::snprintf(text, sizeof text, "%.2f %.2f %.1f\n", p[0], p[1], p[2]);
    lines += before + text;
  }
  return lines;
}

TEST(MeshIo, PutsTheOriginWhereTrianglesAre) {
  const std::string v = lines_of_far("v ");
  const Mesh plain = load_text("far.obj", v + "f 1 2 3 4\n").mesh;
  EXPECT_EQ(plain.origin, (std::array<double, 3>{500000, 4500000, 300}));
  const auto check = [&](const std::string& name, const std::string& content) {
    const Loaded loaded = load_text(name, content);
    EXPECT_EQ(loaded.mesh.origin, plain.origin) << content;
    for (std::size_t i = 0; i < kFar.size(); ++i) {
      EXPECT_EQ(loaded.mesh.positions[i], plain.positions[i]) << content;
    }
    EXPECT_EQ(loaded.count("coarse-coordinates"), 0U) << content;
  };
  check("a.obj", v + "v 0 0 0\nf 1 2 3 4\n");
  check("p.obj", v + "v 0 0 0\nf 1 2 3 4\np 5\n");
  check("l.obj", v + "v 0 0 0\nv 1e20 0 0\nf 1 2 3 4\nl 5 6\n");
  // Faces without area: a point, a line, a line by decimals that doubles do not hold.
  check("f.obj", v + "v 0 0 0\nf 1 2 3 4\nf 5 5 5\n");
  check("s.obj", v + "v 0 0 0\nf 1 2 3 4\nf 1 5 1\n");
  check("t.obj", v + "v 0.1 0.3 0.7\nv 0.2 0.6 1.4\nv 0.3 0.9 2.1\nf 1 2 3 4\nf 5 6 7\n");
  // One that single precision would make large.
  check("u.obj", v + "v 0.1 0.3 0.7\nv 100000.1 300000.3 700000.7\nv 200000.2 600000.6 1400001.4\n"
                     "f 1 2 3 4\nf 5 6 7\n");
  const std::string off = lines_of_far("");
  check("a.off", "OFF\n5 1 0\n" + off + "0 0 0\n4 0 1 2 3\n");
  check("f.off", "OFF\n5 2 0\n" + off + "0 0 0\n4 0 1 2 3\n3 4 4 4\n");
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    PlyText ply(encoding,
                "element vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
                "element face 2\nproperty list uchar int vertex_indices\n");
    for (const auto& p : kFar) {
      // As OBJ's decimals are read.
      for (const double x : p) ply.put(x);
    }
    ply.put(0.0).put(0.0).put(0.0);
    ply.put(std::uint8_t{4}).put(0).put(1).put(2).put(3);
    ply.put(std::uint8_t{3}).put(4).put(4).put(0);
    check("a.ply", ply.text());
  }
  std::string stl = "solid far\n";
  const auto facet = [&](const std::vector<std::string>& corners) {
    stl += "facet normal 0 0 1\nouter loop\n";
    for (const std::string& corner : corners) stl += "vertex " + corner + "\n";
    stl += "endloop\nendfacet\n";
  };
  const std::string a = "500000.30 4500000.30 300.0", b = "500001.10 4500000.30 300.0",
                    c = "500001.10 4500001.10 300.2", d = "500000.30 4500001.10 300.2";
  facet({a, b, c});
  facet({a, c, d});
  facet({"0 0 0", "0 0 0", "0 0 0"});
  check("a.stl", stl + "endsolid far\n");
}

TEST(MeshIo, SaysWhereCoordinatesAreTooCoarse) {
  // A wavy sheet of cells of 0.8 by 0.8, in floats: a PLY of them, and text.
  std::string body;
  PlyText ply("binary_little_endian",
              "element vertex 400\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 361\nproperty list uchar int vertex_indices\n");
  for (int i = 0; i < 400; ++i) {
    const int x = i % 20, y = i / 20;
    const auto at = [](double value) { return static_cast<float>(value); };
    const std::array<float, 3> p = {at(500000.3 + 0.8 * x), at(4500000.3 + 0.8 * y),
                                    at(300 + 0.3 * std::sin(x * y))};
    for (const float value : p) ply.put(value);
    char text[128];
    std::snprintf(text, sizeof text, "v %.9g %.9g %.9g\n", double{p[0]}, double{p[1]},
                  double{p[2]});
    body += text;
  }
  for (int i = 0; i < 380; ++i) {
    if (i % 20 == 19) continue;
    ply.put(std::uint8_t{4}).put(i).put(i + 1).put(i + 21).put(i + 20);
    body += "f " + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + ' ' +
            std::to_string(i + 22) + ' ' + std::to_string(i + 21) + '\n';
  }
  for (const Loaded& loaded : {load_text("c.ply", ply.text()), load_text("c.obj", body)}) {
    EXPECT_EQ(loaded.count("coarse-coordinates"), 1U);
    for (const Warning& warning : loaded.warnings) {
      if (warning.code != "coarse-coordinates") continue;
      for (const char* word : {"c.", "near 4500", "steps of 0.5", "double precision"}) {
        EXPECT_NE(warning.message.text().find(word), std::string::npos) << warning.message.text();
      }
    }
  }
  // In double precision, but beside a corner that keeps it from an origin of its own.
  const Loaded held = load_text("h.obj", lines_of_far("v ") + "v 0 0 0\nf 1 2 3 4\nf 1 2 5\n");
  EXPECT_EQ(held.count("coarse-coordinates"), 1U);
  for (const Warning& warning : held.warnings) {
    if (warning.code != "coarse-coordinates") continue;
    EXPECT_NE(warning.message.text().find("Vertex 4 at (0, 0, 0)"), std::string::npos)
        << warning.message.text();
  }
}

/// Whatever uses the mesh. At 1e20 the triangle has no area within the rounding of its corners.
TEST(MeshIo, NamesVerticesFarFromAllOthers) {
  std::string body;
  for (int i = 0; i < 400; ++i) {
    body += "v " + std::to_string(i % 20) + ' ' + std::to_string(i / 20) + ' ' +
            std::to_string(i * i % 7) + '\n';
  }
  for (int i = 0; i < 380; ++i) {
    if (i % 20 == 19) continue;
    body += "f " + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + ' ' +
            std::to_string(i + 22) + ' ' + std::to_string(i + 21) + '\n';
  }
  EXPECT_EQ(load_text("near.obj", body + "v 10000 1 1\nf 1 2 401\n").count("coarse-coordinates"),
            0U);
  for (const char* far : {"1e7", "-1e8", "1e20", "3e37"}) {
    const Loaded loaded =
        load_text("far.obj", body + "v 1 " + std::string(far) + " 1\nf 1 2 401\n");
    ASSERT_EQ(loaded.count("coarse-coordinates"), 1U) << far;
    for (const Warning& warning : loaded.warnings) {
      if (warning.code != "coarse-coordinates") continue;
      EXPECT_NE(warning.message.text().find("Vertex 400 at (1, "), std::string::npos)
          << warning.message.text();
      EXPECT_NE(warning.message.text().find("move or remove it"), std::string::npos)
          << warning.message.text();
    }
  }
}

TEST(MeshIo, TellsWhatRoundingFlattens) {
  // Beside a used corner at 0 the small square keeps half a metre: its sides are 0.01.
  const Loaded loaded =
      load_text("r.obj",
                "v 500000.11 4500000.11 300\nv 500000.12 4500000.11 300\nv 500000.12 4500000.12 "
                "300\nv 500000.11 4500000.12 300\nv 0 0 0\nv 0 9 0\nf 1 2 3 4\nf 1 5 6\nf 1 1 2\n");
  EXPECT_EQ(loaded.count("rounded-triangles"), 2U);
  EXPECT_EQ(loaded.count("degenerate-triangles"), 1U);
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
      EXPECT_NE(warning.message.text().find("line 6"), std::string::npos) << warning.message.text();
    }
  }
}

}  // namespace
}  // namespace kiln
