// Files as programs write them: each in its writer's own words, whatever the format's text says.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "asset/mesh_files.h"
#include "kiln/mesh.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::mesh_files::load_text;
using test::mesh_files::Loaded;

/// Contents of a file beside the unit square: at (x, y, 0) the UV is (x, y), the normal (0.6, 0, 0.8), the colour
/// (255, 128, 0).
enum Holds : unsigned { kUvs = 1, kNormals = 2, kColors = 4 };

struct Sample {
  const char* writer;
  const char* name;
  std::string text;
  unsigned holds;
  std::vector<std::string> materials = {};
  std::vector<std::string> groups = {};
  std::vector<std::string> files = {};
};

std::string utf16(const std::string& text, bool big) {
  std::string wide = big ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) wide += big ? std::string{'\0', c} : std::string{c, '\0'};
  return wide;
}

const std::string kStl =
    "solid s\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n "
    "endloop\nendfacet\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 1 0\n  vertex "
    "0 1 "
    "0\n endloop\nendfacet\nendsolid s\n";

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

const std::string kMax =
    "# 3ds Max Wavefront OBJ Exporter v0.97b - (c)2007 guruware\r\n# File Created: "
    "01.02.2026\r\n\r\n"
    "mtllib scene#1.mtl\r\n\r\n#\r\n# object Part #1\r\n#\r\n\r\n"
    "v  0.0000 0.0000 0.0000\r\nv  1.0000 0.0000 0.0000\r\nv  1.0000 1.0000 0.0000\r\n"
    "v  0.0000 1.0000 0.0000\r\n# 4 vertices\r\n\r\nvn 0.6000 0.0000 0.8000\r\n# 1 vertex "
    "normals\r\n\r\n"
    "vt 0.0000 0.0000 0.0000\r\nvt 1.0000 0.0000 0.0000\r\nvt 1.0000 1.0000 0.0000\r\n"
    "vt 0.0000 1.0000 0.0000\r\n# 4 texture coords\r\n\r\ng Part #1\r\nusemtl Material #25\r\ns "
    "1\r\n"
    "f 1/1/1 2/2/1 3/3/1 \r\nusemtl Material #26\r\nf 1/1/1 3/3/1 4/4/1 \r\n# 2 faces\r\n";

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n";
const std::string kPlyFaces =
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n";

std::vector<Sample> samples() {
  return {
      {"3ds Max",
       "max.obj",
       kMax,
       kUvs | kNormals,
       {"Material #25", "Material #26"},
       {"Part #1"},
       {"scene#1.mtl"}},
      {"UTF-16, little endian",
       "wide.obj",
       utf16(kMax, false),
       kUvs | kNormals,
       {"Material #25", "Material #26"},
       {"Part #1"},
       {"scene#1.mtl"}},
      {"UTF-16, big endian",
       "wide.obj",
       utf16(kMax, true),
       kUvs | kNormals,
       {"Material #25", "Material #26"},
       {"Part #1"},
       {"scene#1.mtl"}},
      {"Blender 5",
       "blender.obj",
       "# Blender 5.0.1\n# www.blender.org\nmtllib blender.mtl\no Part_#1\n"
       "v 0.000000 0.000000 0.000000 1.0000 0.5020 0.0000\nv 1 0 0 1.0000 0.5020 0.0000\n"
       "v 1 1 0 1.0000 0.5020 0.0000\nv 0 1 0 1.0000 0.5020 0.0000\nvn 0.6000 0.0000 0.8000\n"
       "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\ns 0\nusemtl Material_#25\nf 1/1/1 2/2/1 3/3/1\n"
       "usemtl metal\nf 1/1/1 3/3/1 4/4/1\n",
       kUvs | kNormals | kColors,
       {"Material_#25", "metal"},
       {"Part_#1"},
       {"blender.mtl"}},
      {"Blender 5", "blender.ply",
       "ply\nformat ascii 1.0\ncomment Created in Blender version 5.0.1\nelement vertex 4\n"
       "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float "
       "ny\n"
       "property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
       "property uchar alpha\nproperty float s\nproperty float t\nelement face 2\n"
       "property list uchar uint vertex_indices\nend_header\n"
       "0 0 0 .6 0 .8 255 128 0 255 0 0\n1 0 0 .6 0 .8 255 128 0 255 1 0\n"
       "1 1 0 .6 0 .8 255 128 0 255 1 1\n0 1 0 .6 0 .8 255 128 0 255 0 1\n3 0 1 2\n3 0 2 3\n",
       kUvs | kNormals | kColors},
      {"Maya",
       "maya.obj",
       "# This file uses centimeters as units for non-parametric coordinates.\n\nmtllib maya.mtl\n"
       "g default\nv 0.000000 0.000000 0.000000\nv 1.000000 0.000000 0.000000\n"
       "v 1.000000 1.000000 0.000000\nv 0.000000 1.000000 0.000000\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 "
       "1\n"
       "vn 0.6 0 0.8\nvn 0.6 0 0.8\nvn 0.6 0 0.8\nvn 0.6 0 0.8\ns off\ng pPlane1\n"
       "usemtl initialShadingGroup\nf 1/1/1 2/2/2 3/3/3 4/4/4\n",
       kUvs | kNormals,
       {"initialShadingGroup"},
       {"pPlane1"},
       {"maya.mtl"}},
      {"ZBrush",
       "zbrush.obj",
       "# File exported by ZBrush version 2026\n# www.zbrush.com\n#Vertex Count 4\n#UV Vertex "
       "Count "
       "4\n#Face Count 1\n#Auto scale x=1.0\n\ng default\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
       "#The following MRGB block contains ZBrush Vertex Color (Polypaint) and masking output as 4 "
       "hexadecimal values per vertex. The vertex color format is MMRRGGBB with up to 64 entries "
       "per "
       "MRGB line.\n#MRGB ffff8000ffff8000FFFF8000\n#MRGB 00ff8000\n"
       "# End of MRGB block \nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\ng patch\nusemtl patch\nf 1/1 2/2 3/3 "
       "4/4\n",
       kUvs | kColors,
       {"patch"},
       {"patch"}},
      {"Unity",
       "unity.obj",
       "mtllib ./unity.mtl\ng Quad\nv 0 0 0 \nv 1 0 0 \nv 1 1 0 \nv 0 1 0 \n\nvn .6 0 .8 \n\n"
       "vt 0 0 \nvt 1 0 \nvt 1 1 \nvt 0 1 \n\nusemtl Default-Material (Instance)\n"
       "f 1/1/1 2/2/1 3/3/1 \nf 1/1/1 3/3/1 4/4/1 \n",
       kUvs | kNormals,
       {"Default-Material (Instance)"},
       {"Quad"},
       {"./unity.mtl"}},
      {"Metashape",
       "metashape.obj",
       "# Agisoft Metashape\nmtllib a.mtl b.mtl\no model\nv 0 0 0 255 128 0\nv 1 0 0 255 128 0\n"
       "v 1 1 0 255 128 0\nv 0 1 0 255 128 0\nvn .6 0 .8\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
       "usemtl Solid\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n",
       kUvs | kNormals | kColors,
       {"Solid"},
       {"model"},
       {"a.mtl", "b.mtl"}},
      {"MeshLab",
       "meshlab.obj",
       "####\n#\n# OBJ File Generated by Meshlab\n#\n####\nmtllib ./meshlab.obj.mtl\n\n"
       "vn 0.9 0 1.2\nvt 0 0\nv 0 0 0 1.000000 0.501961 0.000000\nvn 0.9 0 1.2\nvt 1 0\n"
       "v 1 0 0 1.000000 0.501961 0.000000\nvn 0.9 0 1.2\nvt 1 1\nv 1 1 0 1.000000 0.501961 "
       "0.000000\nvn 0.9 0 1.2\nvt 0 1\nv 0 1 0 1.000000 0.501961 0.000000\n"
       "# 4 vertices, 0 vertices normals\n\nusemtl material_0\nf 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 "
       "4/4/4\n# 2 faces, 4 coords texture\n\n# End of File\n",
       kUvs | kNormals | kColors,
       {"material_0"},
       {},
       {"./meshlab.obj.mtl"}},
      {"MeshLab", "meshlab.ply",
       kPly +
           "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
           "property double quality\nproperty float texture_u\nproperty float texture_v\n" +
           kPlyFaces +
           "0 0 0 255 128 0 255 0 0 0\n1 0 0 255 128 0 255 0 1 0\n1 1 0 255 128 0 255 0 1 1\n"
           "0 1 0 255 128 0 255 0 0 1\n3 0 1 2 \n3 0 2 3 \n",
       kUvs | kColors},
      {"MeshLab, colours before normals", "meshlab.off",
       "NCSTOFF\n4 2 0\n0 0 0 255 128 0 255 0.9 0 1.2 0 0 \n1 0 0 255 128 0 255 0.9 0 1.2 1 0 \n"
       "1 1 0 255 128 0 255 0.9 0 1.2 1 1 \n0 1 0 255 128 0 255 0.9 0 1.2 0 1 \n3 0 1 2 0 255 0\n"
       "3 0 2 3 0 255 0\n",
       kUvs | kNormals | kColors},
      {"Open3D, normals before colours", "open3d.off",
       "CNOFF\n4 2 0\n0 0 0 0.6 0 0.8 255 128 0 255\n1 0 0 0.6 0 0.8 255 128 0 255\n"
       "1 1 0 0.6 0 0.8 255 128 0 255\n0 1 0 0.6 0 0.8 255 128 0 255\n3 0 1 2\n3 0 2 3\n",
       kNormals | kColors},
      {"Open3D", "open3d.ply",
       replaced(kPly, "float", "double") +
           "property double nx\nproperty double ny\nproperty double nz\nproperty uchar red\n"
           "property uchar green\nproperty uchar blue\n" +
           replaced(kPlyFaces, " int ", " uint ") +
           "0 0 0 .6 0 .8 255 128 0\n1 0 0 .6 0 .8 255 128 0\n1 1 0 .6 0 .8 255 128 0\n"
           "0 1 0 .6 0 .8 255 128 0\n3 0 1 2\n3 0 2 3\n",
       kNormals | kColors},
      {"Open3D",
       "open3d.obj",
       "# Created by Open3D \nmtllib open3d.mtl\nv 0 0 0 1 0.501961 0\nvn 0.6 0 0.8\n"
       "v 1 0 0 1 0.501961 0\nvn 0.6 0 0.8\nv 1 1 0 1 0.501961 0\nvn 0.6 0 0.8\nv 0 1 0 1 0.501961 "
       "0\n"
       "vn 0.6 0 0.8\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 0\nvt 1 1\nvt 0 1\nusemtl open3d_0\n"
       "f 1/1/1 2/2/2 3/3/3\nf 1/4/1 3/5/3 4/6/4\n",
       kUvs | kNormals | kColors,
       {"open3d_0"},
       {},
       {"open3d.mtl"}},
      {"Assimp",
       "assimp.obj",
       "# File produced by Open Asset Import Library\n\nmtllib assimp.mtl\n\n"
       "v  0 0 0 1 0.501960814 0\nv  1 0 0 1 0.501960814 0\nv  1 1 0 1 0.501960814 0\n"
       "v  0 1 0 1 0.501960814 0\n\nvt 0 0 0\nvt 1 0 0\nvt 1 1 0\nvt 0 1 0\n\nvn 0.6 0 0.8\n\n"
       "# Mesh 'Object1' with 2 faces\ng Object1\nusemtl $Material_0\nf  1/1/1 2/2/1 3/3/1\n"
       "f  1/1/1 3/3/1 4/4/1\n",
       kUvs | kNormals | kColors,
       {"$Material_0"},
       {"Object1"},
       {"assimp.mtl"}},
      {"trimesh", "trimesh.ply",
       "ply\nformat ascii 1.0\ncomment https://github.com/mikedh/trimesh\nelement vertex 4\n"
       "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float "
       "ny\n"
       "property float nz\nproperty double s\nproperty double t\n" +
           kPlyFaces +
           "0 0 0 .6 0 .8 0 0\n1 0 0 .6 0 .8 1 0\n1 1 0 .6 0 .8 1 1\n0 1 0 .6 0 .8 0 1\n3 0 1 2\n"
           "3 0 2 3\n",
       kUvs | kNormals},
      {"trimesh",
       "trimesh.obj",
       "# https://github.com/mikedh/trimesh\nmtllib material.mtl\nusemtl material_0\n"
       "v 0.00000000 0.00000000 0.00000000\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0.6 0 0.8\nvt 0 0\nvt 1 "
       "0\n"
       "vt 1 1\nvt 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n",
       kUvs | kNormals,
       {"material_0"},
       {},
       {"material.mtl"}},
      {"CloudCompare", "cloudcompare.ply",
       "ply\nformat ascii 1.0\ncomment Created by CloudCompare v2.13\nobj_info Generated by "
       "CloudCompare!\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
       "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n"
       "property float ny\nproperty float nz\nproperty float scalar_Intensity\nelement face 2\n"
       "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int "
       "texnumber\nend_header\n0 0 0 255 128 0 .6 0 .8 7\n1 0 0 255 128 0 .6 0 .8 7\n"
       "1 1 0 255 128 0 .6 0 .8 7\n0 1 0 255 128 0 .6 0 .8 7\n3 0 1 2 6 0 0 1 0 1 1 0\n"
       "3 0 2 3 6 0 0 1 1 0 1 0\n",
       kUvs | kNormals | kColors},
      {"float colours to 1", "fractions.ply",
       kPly + "property float red\nproperty float green\nproperty float blue\n" + kPlyFaces +
           "0 0 0 1 .50196 0\n1 0 0 1 .50196 0\n1 1 0 1 .50196 0\n0 1 0 1.0000001 .50196 0\n3 0 1 "
           "2\n3 0 2 3\n",
       kColors},
      {"float colours to 255", "bytes.ply",
       kPly +
           "property float red\nproperty float green\nproperty float blue\nproperty float alpha\n" +
           kPlyFaces +
           "0 0 0 255 128 0 255\n1 0 0 255 128 0 255\n1 1 0 255 128 0 255\n0 1 0 255 128 0 255\n3 "
           "0 1 "
           "2\n3 0 2 3\n",
       kColors},
      {"faces before vertices, a strange line", "order.ply",
       "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
       "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
       "property float ny\nproperty float nz\nproperty float tu\nproperty float tv\nauthor me\n"
       "end_header\n3 0 1 2\n3 0 2 3\n0 0 0 .6 0 .8 0 0\n1 0 0 .6 0 .8 1 0\n1 1 0 .6 0 .8 1 1\n"
       "0 1 0 .6 0 .8 0 1\n",
       kUvs | kNormals},
      {"r g b a", "rgba.obj",
       "v 0 0 0 1 .502 0 1\nv 1 0 0 1 .502 0 1\nv 1 1 0 1 .502 0 1\nv 0 1 0 1 .502 0 1\nf 1 2 3 "
       "4\n",
       kColors},
      {"STL in capitals", "upper.stl", upper(kStl), 0, {}, {"S"}},
      {"Unity's STL",
       "unity.stl",
       replaced(kStl, "solid s", "Solid Unity Mesh"),
       0,
       {},
       {"Unity Mesh"}},
      {"end loop", "apart.stl", replaced(kStl, "end", "end "), 0, {}, {"s"}},
      {"ENDSOLID alone", "end.stl", replaced(kStl, "endsolid s", "ENDSOLID"), 0, {}, {"s"}},
  };
}

TEST(MeshWriters, EachIsReadAsMeant) {
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(std::string(sample.writer) + ": " + sample.name);
    const Loaded loaded = load_text(sample.name, sample.text);
    const Mesh& mesh = loaded.mesh;
    const bool strange = std::string(sample.name) == "order.ply";
    EXPECT_EQ(loaded.warnings.size(), strange ? 1u : 0u);
    EXPECT_EQ(loaded.count("ignored-header-lines"), strange ? 1u : 0u);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    ASSERT_EQ(mesh.positions.size(), 4u);
    ASSERT_EQ(mesh.uv_triangles.size(), sample.holds & kUvs ? 2u : 0u);
    ASSERT_EQ(mesh.normal_triangles.size(), sample.holds & kNormals ? 2u : 0u);
    ASSERT_EQ(mesh.colors.size(), sample.holds & kColors ? 4u : 0u);
    double area = 0;
    for (std::size_t t = 0; t < 2; ++t) {
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = mesh.positions[mesh.triangles[t][k]];
        EXPECT_EQ(p[k].z, 0);
        if (sample.holds & kUvs) {
          const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k]];
          EXPECT_EQ(uv, (Vec2{p[k].x, p[k].y}));
        }
        if (sample.holds & kNormals) {
          const Vec3& n = mesh.normals[mesh.normal_triangles[t][k]];
          EXPECT_NEAR(n.x, 0.6, 1e-6);
          EXPECT_NEAR(n.z, 0.8, 1e-6);
        }
      }
      area += (double{p[1].x} - p[0].x) * (double{p[2].y} - p[0].y) -
              (double{p[2].x} - p[0].x) * (double{p[1].y} - p[0].y);
    }
    EXPECT_EQ(area, 2);
    for (const auto& color : mesh.colors) {
      EXPECT_EQ(color, (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
    }
    EXPECT_EQ(mesh.material_names, sample.materials);
    if (sample.materials.size() == 2) {
      EXPECT_EQ(mesh.materials, (std::vector<std::uint32_t>{0, 1}));
    }
    if (!sample.groups.empty()) {
      ASSERT_FALSE(mesh.groups.empty());
      EXPECT_EQ(mesh.group_names[mesh.groups[0]], sample.groups[0]);
    }
    EXPECT_EQ(mesh.material_files, sample.files);
  }
}

/// Every union of the letters, in MeshLab's order of header and values and in Geomview's.
TEST(MeshWriters, OffWithAnyLetters) {
  for (unsigned bits = 0; bits < 64; ++bits) {
    const bool st = bits & 1, c = bits & 2, n = bits & 4, four = bits & 8, dim = bits & 16,
               meshlab = bits & 32;
    const std::string letters = meshlab
                                    ? std::string(n ? "N" : "") + (c ? "C" : "") + (st ? "ST" : "")
                                    : std::string(st ? "ST" : "") + (c ? "C" : "") + (n ? "N" : "");
    std::string text =
        letters + (four ? "4" : "") + (dim ? "n" : "") + "OFF\n" + (dim ? "3\n" : "") + "4 1 0\n";
    SCOPED_TRACE(text);
    for (const auto& [x, y] :
         {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
      const std::string normal = n ? " 0 -0.6 0.8" : "", color = c ? " 255 127 63 255" : "";
      text += std::to_string(2 * x) + " " + std::to_string(2 * y) + " 4" + (four ? " 2" : "") +
              (meshlab ? color + normal : normal + color) +
              (st ? " " + std::to_string(x) + " " + std::to_string(y) : "") + "\n";
    }
    const Loaded loaded = load_text("letters.off", text + "4 0 1 2 3\n");
    EXPECT_TRUE(loaded.warnings.empty());
    const Mesh& mesh = loaded.mesh;
    const float scale = four ? 1 : 2;
    EXPECT_EQ(mesh.positions[2], (Vec3{scale, scale, 2 * scale}));
    EXPECT_EQ(mesh.colors.size(), c ? 4u : 0u);
    if (c) EXPECT_EQ(mesh.colors[3], (std::array<std::uint8_t, 4>{255, 127, 63, 255}));
    EXPECT_EQ(mesh.uv_triangles.size(), st ? 2u : 0u);
    if (st) EXPECT_EQ(mesh.uvs[2], (Vec2{1, 1}));
    EXPECT_EQ(mesh.normal_triangles.size(), n ? 2u : 0u);
    if (n) EXPECT_EQ(mesh.normals[0], (Vec3{0, -0.6F, 0.8F}));
  }
  // A colour is never below 0: then the values stand in the other order than the letters say.
  const std::string rest =
      "3 1 0\n0 0 0 0 -1 0 9 8 7 255\n1 0 0 0 -1 0 9 8 7 255\n0 1 0 0 1 0 9 8 7 "
      "255\n3 0 1 2\n";
  for (const std::string letters : {"NCOFF\n", "CNOFF\n"}) {
    const Mesh mesh = load_text("order.off", letters + rest).mesh;
    EXPECT_EQ(mesh.normals[0], (Vec3{0, -1, 0}));
    EXPECT_EQ(mesh.colors[0], (std::array<std::uint8_t, 4>{9, 8, 7, 255}));
  }
}

/// One rule for OBJ, float PLY and COFF: a channel above 1 anywhere in the file means bytes.
TEST(MeshWriters, ColoursAreBytesWhereOneIsAboveOne) {
  using Bytes = std::array<std::uint8_t, 4>;
  const std::string ply =
      kPly + "property float red\nproperty float green\nproperty float blue\n" + kPlyFaces;
  const auto colors = [&](const std::array<std::string, 4>& c) {
    const auto line = [&](std::size_t i, const char* p) {
      return std::string(p) + " " + c[i] + "\n";
    };
    const std::string rows =
        line(0, "0 0 0") + line(1, "1 0 0") + line(2, "1 1 0") + line(3, "0 1 0");
    const Loaded obj =
        load_text("c.obj", "v " + line(0, "0 0 0") + "v " + line(1, "1 0 0") + "v " +
                               line(2, "1 1 0") + "v " + line(3, "0 1 0") + "f 1 2 3 4\n");
    EXPECT_EQ(load_text("c.off", "COFF\n4 1 0\n" + rows + "4 0 1 2 3\n").mesh.colors,
              obj.mesh.colors);
    EXPECT_EQ(load_text("c.ply", ply + rows + "3 0 1 2\n3 0 2 3\n").mesh.colors, obj.mesh.colors);
    return obj;
  };
  EXPECT_EQ(colors({"0 0 0", "0 .5 0", "0 0 1", "1 1 1"}).mesh.colors[1], (Bytes{0, 128, 0, 255}));
  const Loaded dark = colors({"0 0 0", "0 0 0", "0 0 1", "1 20 1"});
  EXPECT_EQ(dark.mesh.colors[2], (Bytes{0, 0, 1, 255}));
  EXPECT_EQ(dark.count("color-scale"), 0u);
  // Brighter than white, or nearly black? Said.
  EXPECT_EQ(colors({"0 0 0", "0 0 0", "0 0 1", "1 1.5 1"}).count("color-scale"), 4u);
  EXPECT_EQ(colors({"0 0 0", "0 0 0", "0 0 1", "1 nan inf"}).mesh.colors[3],
            (Bytes{255, 0, 255, 255}));
}

/// ZBrush's blocks belong to the vertices before them, an object each.
TEST(MeshWriters, PolypaintOfSeveralObjects) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const Loaded loaded =
      load_text("zbrush.obj", triangle + "#MRGB ff010203ff040506ff070809\nf 1 2 3\n" + triangle +
                                  "f 4 5 6\n" + triangle +
                                  "#MRGB 000a0b0c000d0e0f00101112\nf 7 8 9\n#MRGB 0011zz22\n");
  const std::vector<std::array<std::uint8_t, 4>> wanted{
      {1, 2, 3, 255},       {4, 5, 6, 255},       {7, 8, 9, 255},
      {255, 255, 255, 255}, {255, 255, 255, 255}, {255, 255, 255, 255},
      {10, 11, 12, 255},    {13, 14, 15, 255},    {16, 17, 18, 255}};
  EXPECT_EQ(loaded.mesh.colors, wanted);
  EXPECT_EQ(loaded.count("missing-colors"), 3u);
  EXPECT_EQ(loaded.count("bad-polypaint"), 1u);
  EXPECT_EQ(load_text("few.obj", triangle + "#MRGB ff010203ff040506ff070809ff0a0b0c\nf 1 2 3\n")
                .count("bad-polypaint"),
            1u);
}

TEST(MeshWriters, NamesMayHoldWhatStartsComments) {
  const Loaded loaded = load_text(
      "hash.obj",
      "mtllib \"my #1.mtl\" b.mtl my c.MTL\n#o no\nv 0 0 0 #x\nv 1 0 0 # y\nv 0 1 0\n  # indented\n"
      "g #1\nusemtl a # b\ns 1 # smooth\nf 1 2 3 # face\no C# part\nusemtl Material #2\nf 1 2 3\n");
  const Mesh& mesh = loaded.mesh;
  EXPECT_TRUE(loaded.warnings.empty());
  EXPECT_EQ(mesh.material_files, (std::vector<std::string>{"my #1.mtl", "b.mtl", "my c.MTL"}));
  EXPECT_EQ(mesh.material_names, (std::vector<std::string>{"a # b", "Material #2"}));
  EXPECT_EQ(mesh.group_names, (std::vector<std::string>{"#1", "C# part"}));
  // As Kiln writes it again.
  const std::filesystem::path file = test::scratch_folder() / "again.obj";
  save_obj(mesh, file);
  EXPECT_EQ(load_mesh(file).material_names, mesh.material_names);
  // Microsoft's words for what is not finite are no comments.
  const Loaded bad = load_text(
      "ind.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -1.#IND00\nv 0 0 1.#INF\nf 1 2 3\nf 1 2 4 5\n");
  EXPECT_EQ(bad.count("non-finite-vertices"), 2u);
}

TEST(MeshWriters, PlyUvsByAnyName) {
  for (const auto& [u, v] :
       {std::pair("tu", "tv"), std::pair("s0", "t0"), std::pair("u0", "v0"), std::pair("s", "t"),
        std::pair("u", "v"), std::pair("texture_u", "texture_v"),
        std::pair("texcoord_u", "texcoord_v"), std::pair("tex_s", "tex_t")}) {
    const std::string text = kPly + "property float " + u + "\nproperty float " + v + "\n" +
                             kPlyFaces +
                             "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n3 0 1 2\n3 0 2 3\n";
    const Loaded loaded = load_text("uv.ply", text);
    EXPECT_TRUE(loaded.warnings.empty());
    EXPECT_EQ(loaded.mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}})) << u;
  }
  // The first of two sets counts; one without its other half is none. Both are said.
  const std::string body =
      "0 0 0 0 0 7 7 9\n1 0 0 1 0 7 7 9\n1 1 0 1 1 7 7 9\n0 1 0 0 1 7 7 9\n3 0 1 2\n"
      "3 0 2 3\n";
  const Loaded two =
      load_text("uv.ply", kPly +
                              "property float s\nproperty float t\nproperty float u\n"
                              "property float v\nproperty float nx\n" +
                              kPlyFaces + body);
  EXPECT_EQ(two.mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(two.count("unused-properties"), 3u);
  EXPECT_TRUE(two.mesh.normals.empty());
}

/// Other people's small files.
TEST(MeshWriters, TheCases) {
  KILN_REQUIRE_DATA("cases");
  const std::filesystem::path cases = *test::shared_data("cases");
  const auto colors = [&](const char* name) {
    return test::mesh_files::load(cases / "col255" / name).mesh.colors;
  };
  using Bytes = std::array<std::uint8_t, 4>;
  EXPECT_EQ(colors("col255.obj"), std::vector<Bytes>(4, {255, 128, 0, 255}));
  EXPECT_EQ(colors("f255.off"), std::vector<Bytes>(4, {255, 128, 0, 255}));
  EXPECT_EQ(colors("f255.ply"), std::vector<Bytes>(4, {255, 128, 0, 255}));
  EXPECT_EQ(colors("rgba.obj"), std::vector<Bytes>(4, {255, 128, 64, 255}));
  const auto hash = [&](const char* name) {
    return test::mesh_files::load(cases / "hash" / name).mesh;
  };
  EXPECT_EQ(hash("hash.obj").material_names,
            (std::vector<std::string>{"Material #25", "Material #26"}));
  EXPECT_EQ(hash("group.obj").group_names, (std::vector<std::string>{"Part #1", "Part #2"}));
  EXPECT_EQ(hash("object.obj").object_names, (std::vector<std::string>{"Part #1", "Part #2"}));
  EXPECT_EQ(hash("lib.obj").material_files, (std::vector<std::string>{"scene#1.mtl"}));
  for (unsigned bits = 0; bits < 16; ++bits) {
    const auto bit = [bits](unsigned k) { return std::to_string(bits >> k & 1); };
    const std::string name = "off_c" + bit(0) + "n" + bit(1) + "t" + bit(2) + "f" + bit(3) + ".off";
    SCOPED_TRACE(name);
    const Mesh mesh = test::mesh_files::load(cases / "off" / name).mesh;
    ASSERT_EQ(mesh.triangles.size(), 2u);
    if (bits & 1) EXPECT_EQ(mesh.colors, std::vector<Bytes>(4, {255, 127, 63, 255}));
    if (bits & 2) EXPECT_EQ(mesh.normals, std::vector<Vec3>(4, {0, 0, 1}));
    if (bits & 4) EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  }
  for (const char* name : {"n_fv.ply", "n_vf.ply"}) {
    const Mesh mesh = test::mesh_files::load(cases / "plyorder" / name).mesh;
    ASSERT_FALSE(mesh.normal_triangles.empty()) << name;
    for (const Triangle& t : mesh.normal_triangles) {
      EXPECT_NEAR(mesh.normals[t[0]].x, 0.5, 1e-6);
      EXPECT_NEAR(mesh.normals[t[0]].z, std::sqrt(0.75), 1e-6);
    }
  }
  EXPECT_EQ(test::mesh_files::load(cases / "plyorder" / "j_facefirst.ply").mesh.uv_triangles.size(),
            2u);
  for (const char* name :
       {"up.stl", "endup.stl", "unity.stl", "endsp.stl", "lowc.stl", "block.stl"}) {
    EXPECT_GE(test::mesh_files::load(cases / "stl" / name).mesh.triangles.size(), 2u) << name;
  }
}

}  // namespace
}  // namespace kiln
