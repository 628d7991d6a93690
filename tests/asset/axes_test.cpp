// Files that say their axes and unit meet in metres with Y up; what others are in is said where they are read.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "asset/assimp.h"
#include "asset/fbx.h"
#include "asset/fbx_files.h"
#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using mesh_files::write_file;
using Place = std::array<double, 3>;

/// A tetrahedron that no turn maps onto itself, in metres with Y up, wound to face outwards.
const std::vector<Place> kCorners = {{0, 0, 0}, {1, 0, 0.25}, {0, 2, 0.5}, {0.125, 0, 4}};
const std::vector<int> kFaces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vec3 &a = mesh.positions[i], &b = mesh.positions[j], &c = mesh.positions[k];
    sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) +
           double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
           double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
  }
  return sum / 6;
}

/// Numbers of a text file and the unit cost two roundings of single precision, of 4 metres.
constexpr double kRounding = 4 * 0x1p-22;

void expect_corners(const Mesh& mesh) {
  ASSERT_EQ(mesh.positions.size(), kCorners.size());
  ASSERT_EQ(mesh.triangles.size(), 4U);
  for (const Place& wanted : kCorners) {
    EXPECT_TRUE(std::any_of(mesh.positions.begin(), mesh.positions.end(),
                            [&](const Vec3& p) {
                              return std::abs(p.x + mesh.origin[0] - wanted[0]) < kRounding &&
                                     std::abs(p.y + mesh.origin[1] - wanted[1]) < kRounding &&
                                     std::abs(p.z + mesh.origin[2] - wanted[2]) < kRounding;
                            }))
        << wanted[0] << ' ' << wanted[1] << ' ' << wanted[2];
  }
  EXPECT_GT(volume(mesh), 0);
}

/// The corners as a file has them in which Y up, in metres, is `up`, in units of so many metres.
struct Turned {
  UpAxis up;
  Place (*in_file)(const Place& p);
};
// A turn that takes the axis to Y: (x, z, -y) for Z up, and so on; here its inverse.
constexpr Turned kTurned[] = {
    {UpAxis::y, [](const Place& p) { return p; }},
    {UpAxis::z,
     [](const Place& p) {
       return Place{p[0], -p[2], p[1]};
     }},
    {UpAxis::x,
     [](const Place& p) {
       return Place{p[1], -p[0], p[2]};
     }},
    {UpAxis::minus_x,
     [](const Place& p) {
       return Place{-p[1], p[0], p[2]};
     }},
    {UpAxis::minus_y,
     [](const Place& p) {
       return Place{p[0], -p[1], -p[2]};
     }},
    {UpAxis::minus_z,
     [](const Place& p) {
       return Place{p[0], p[2], -p[1]};
     }},
};

std::string obj_text(Place (*in_file)(const Place&), double metres) {
  std::string text;
  char line[128];
  for (const Place& corner : kCorners) {
    const Place p = in_file(corner);
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", p[0] / metres, p[1] / metres,
                  p[2] / metres);
    text += line;
  }
  for (std::size_t i = 0; i < kFaces.size(); i += 3) {
    std::snprintf(line, sizeof line, "f %d %d %d\n", kFaces[i] + 1, kFaces[i + 1] + 1,
                  kFaces[i + 2] + 1);
    text += line;
  }
  return text;
}

TEST(Axes, FilesThatDoNotSayAreAsGivenOrAsTold) {
  for (const Turned& turned : kTurned) {
    for (const double metres : {1.0, 0.01, 0.0254}) {
      const fs::path path = write_file("a.obj", obj_text(turned.in_file, metres));
      const Mesh mesh = load_mesh(path, {.up = turned.up, .metres = metres});
      expect_corners(mesh);
      EXPECT_EQ(mesh.metres, 1);
    }
  }
  const Mesh given = load_mesh(write_file("a.obj", obj_text(kTurned[1].in_file, 0.01)));
  EXPECT_EQ(given.metres, 0);
  EXPECT_EQ(given.positions[2].z, 200);
}

TEST(Axes, NormalsAndTangentsTurnAndKeepTheirLength) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty "
      "float "
      "t\nproperty float tx\nproperty float ty\nproperty float tz\nproperty float tw\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 0 0 1 0 0 1 0 0 1\n1000 0 0 0 0 1 1 0 1 0 0 1\n0 1000 0 0 0 1 0 1 1 0 0 1\n3 0 1 2\n";
  std::vector<Warning> warnings;
  const Mesh mesh =
      load_mesh(write_file("a.ply", ply), {.up = UpAxis::z, .metres = 0.001}, &warnings);
  EXPECT_TRUE(warnings.empty()) << warnings[0].message.text();
  EXPECT_EQ(mesh.normals[0], (Vec3{0, 1, 0}));
  EXPECT_EQ(mesh.positions[2], (Vec3{0, 0, -1}));
  ASSERT_EQ(mesh.tangents.size(), 3U);
  EXPECT_EQ(mesh.tangents[0].direction, (Vec3{1, 0, 0}));
}

TEST(Axes, GltfIsInMetresUnlessOverridden) {
  GltfMaker maker;
  std::vector<float> positions;
  for (const Place& corner : kCorners) {
    for (const double value : corner) positions.push_back(static_cast<float>(value));
  }
  const std::size_t at = maker.add<float>("VEC3", positions);
  const std::size_t indices = maker.add<std::uint8_t>("SCALAR", {kFaces.begin(), kFaces.end()});
  maker.add_mesh({{"attributes", {{"POSITION", at}}}, {"indices", indices}});
  const fs::path path = write_file("a.glb", maker.glb());
  expect_corners(load_mesh(path, {.up = UpAxis::z, .metres = 0.01}));
  const Asset asset = load_asset(
      path, {.up = UpAxis::z, .metres = 0.5, .override_up = true, .override_unit = true});
  EXPECT_EQ(asset.mesh.positions[2], (Vec3{0, 0.25F, -1}));
  EXPECT_EQ(asset.nodes.at(0).transform[6], -0.5) << "the hierarchy goes with the mesh";
}

#ifdef KILN_HAS_ASSIMP

TEST(Axes, ColladaByItsAxisAndUnit) {
  // A triangle of three units along the file's x, y and z.
  const auto text = [](const char* unit, const char* up) {
    return std::string(R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter=")") +
           unit + R"("/><up_axis>)" + up + R"(</up_axis></asset>
<library_geometries><geometry id="g" name="t"><mesh>
<source id="p"><float_array id="pa" count="9">1 0 0 0 2 0 0 0 3</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="a" name="part"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
  };
  const auto read = [](const std::string& dae, const LoadMeshOptions& options) {
    return read_by_assimp({"a.dae", dae, nullptr, options}).mesh.positions;
  };
  const auto expect = [](const std::vector<Vec3>& found, const std::vector<Vec3>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      EXPECT_NEAR(found[i].x, wanted[i].x, 1e-6);
      EXPECT_NEAR(found[i].y, wanted[i].y, 1e-6);
      EXPECT_NEAR(found[i].z, wanted[i].z, 1e-6);
    }
  };
  expect(read(text("0.01", "Z_UP"), {}), {{0.01F, 0, 0}, {0, 0, -0.02F}, {0, 0.03F, 0}});
  expect(read(text("0.01", "Y_UP"), {}), {{0.01F, 0, 0}, {0, 0.02F, 0}, {0, 0, 0.03F}});
  expect(read(text("0.01", "Y_UP"), {.up = UpAxis::z, .metres = 1}),
         {{0.01F, 0, 0}, {0, 0.02F, 0}, {0, 0, 0.03F}});
  expect(read(text("0.01", "Z_UP"), {.up = UpAxis::y, .override_up = true}),
         {{0.01F, 0, 0}, {0, 0.02F, 0}, {0, 0, 0.03F}});
  expect(read(text("0.01", "Z_UP"), {.metres = 0.5, .override_unit = true}),
         {{0.5F, 0, 0}, {0, 0, -1}, {0, 1.5F, 0}});
}

#endif

#ifdef KILN_HAS_UFBX

FbxMaker maker_of(int coord, int coord_sign, int up, int up_sign, int front, int front_sign,
                  double centimetres) {
  FbxMaker maker;
  maker.coord = coord, maker.coord_sign = coord_sign;
  maker.up = up, maker.up_sign = up_sign;
  maker.front = front, maker.front_sign = front_sign;
  maker.centimetres = centimetres;
  for (const Place& corner : kCorners) {
    Place p{};
    p[static_cast<std::size_t>(coord)] = coord_sign * corner[0];
    p[static_cast<std::size_t>(up)] = up_sign * corner[1];
    p[static_cast<std::size_t>(front)] = front_sign * corner[2];
    for (const double value : p) maker.vertices.push_back(value * 100 / centimetres);
  }
  maker.corners = kFaces;
  // An axis that is mirrored turns the faces inside out; the file's own face out.
  const bool even = (up - coord + 3) % 3 == 1;
  if ((coord_sign * up_sign * front_sign < 0) == even) {
    for (std::size_t i = 0; i < maker.corners.size(); i += 3) {
      std::swap(maker.corners[i], maker.corners[i + 1]);
    }
  }
  return maker;
}

TEST(Axes, FbxByAllSettings) {
  int count = 0;
  for (int coord = 0; coord < 3; ++coord) {
    for (int up = 0; up < 3; ++up) {
      if (up == coord) continue;
      for (int signs = 0; signs < 8; ++signs) {
        const auto sign = [&](int bit) { return (signs >> bit & 1) != 0 ? -1 : 1; };
        SCOPED_TRACE(std::to_string(coord) + " " + std::to_string(up) + " " +
                     std::to_string(signs));
        const std::string text =
            maker_of(coord, sign(0), up, sign(1), 3 - coord - up, sign(2), count % 2 == 0 ? 1 : 254)
                .text();
        const Asset asset = read_fbx({"a.fbx", text});
        expect_corners(asset.mesh);
        EXPECT_EQ(asset.mesh.metres, 1);
        ++count;
      }
    }
  }
  EXPECT_EQ(count, 48);
}

TEST(Axes, FbxWithoutAxesIsToldAndOverridden) {
  FbxMaker odd = maker_of(0, 1, 1, 1, 2, 1, 1);
  odd.front = 1;
  std::vector<Warning> warnings;
  expect_corners(read_fbx({"a.fbx", odd.text(), &warnings}).mesh);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "odd-axes");
  // Settings that are not so: marked as Y up in centimetres, and Z up in metres.
  FbxMaker wrong = maker_of(0, 1, 2, 1, 1, -1, 100);
  wrong.up = 1, wrong.front = 2, wrong.front_sign = 1, wrong.centimetres = 1;
  const std::string text = wrong.text();
  LoadMeshOptions options{.up = UpAxis::z, .metres = 1};
  EXPECT_NEAR(read_fbx({"a.fbx", text, nullptr, options}).mesh.positions[1].z, 0.02, 1e-6);
  options.override_up = options.override_unit = true;
  expect_corners(read_fbx({"a.fbx", text, nullptr, options}).mesh);
}

TEST(UvSets, FbxByNumberAndName) {
  FbxMaker maker = maker_of(0, 1, 1, 1, 2, 1, 1);
  std::vector<double> first, second;
  for (int i = 0; i < 12; ++i) {
    first.insert(first.end(), {i / 16.0, 0.5});
    second.insert(second.end(), {0.25, i / 16.0});
  }
  maker.sets = {{"UVMap", first}, {"light map", second}};
  const std::string text = maker.text();
  const auto read = [&](const LoadMeshOptions& options) {
    return read_fbx({"a.fbx", text, nullptr, options}).mesh;
  };
  EXPECT_EQ(read({}).uvs[1], (Vec2{1 / 16.0F, 0.5F}));
  EXPECT_EQ(read({.uv_set = 1}).uvs[1], (Vec2{0.25F, 1 / 16.0F}));
  const Mesh named = read({.uv_set_name = "light map"});
  EXPECT_EQ(named.uvs[1], (Vec2{0.25F, 1 / 16.0F}));
  EXPECT_EQ(named.uv_set, 1U);
  for (const LoadMeshOptions& options :
       {LoadMeshOptions{.uv_set = 2}, LoadMeshOptions{.uv_set_name = "no"}}) {
    try {
      read(options);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("0 \"UVMap\", 1 \"light map\""), std::string::npos)
          << error.what();
    }
  }
}

// Programs agree on a scaling alone: UVs are multiplied by it. The rest is left out, and told.
TEST(UvTransforms, FbxScalesPictures) {
  const fs::path folder = scratch_folder();
  save_image({1, 1, 3, {1, 0, 0}}, folder / "p.png", {.format = ImageFormat::png8});
  const auto line = [](const char* name, const char* values) {
    return std::string("\t\t\tP: \"") + name + "\", \"Vector\", \"\", \"A\"," + values + "\n";
  };
  const std::string scaled = line("Scaling", "2,0.5,1");
  const std::array<float, 6> as_it_is = MaterialPicture().uv_transform;
  for (const auto& [placing, expected, told] :
       {std::tuple(scaled, std::array<float, 6>{2, 0, 0, 0, 0.5F, 0}, false),
        std::tuple(scaled + line("Translation", "0.25,0,0"), as_it_is, true),
        std::tuple(line("Rotation", "0,0,30"), as_it_is, true),
        std::tuple(line("Scaling", "0,1,1"), as_it_is, true),
        std::tuple(line("Scaling", "1,1,1"), as_it_is, false)}) {
    SCOPED_TRACE(placing);
    FbxMaker maker = maker_of(0, 1, 1, 1, 2, 1, 1);
    maker.picture = "p.png";
    maker.placing = placing;
    std::vector<Warning> warnings;
    const std::string text = maker.text();
    const Asset asset = read_fbx({(folder / "a.fbx").string(), text, &warnings});
    EXPECT_EQ(asset.materials.at(0).color_map.uv_transform, expected);
    ASSERT_EQ(warnings.size(), told ? 1U : 0U);
    if (told) EXPECT_EQ(warnings[0].code, "texture-options");
  }
}

TEST(Outside, FbxReadsItsFolderAlone) {
  const fs::path scratch = scratch_folder(), folder = scratch / "in", outside = scratch / "out";
  fs::create_directories(folder);
  fs::create_directories(outside);
  const fs::path picture = outside / "p.png";
  save_image({1, 1, 3, {1, 0, 0}}, picture, {.format = ImageFormat::png8});
  for (const std::string& name : {std::string("../out/p.png"), std::string("..\\out\\p.png"),
                                  std::string("a/../../out/p.png"), picture.string()}) {
    SCOPED_TRACE(name);
    FbxMaker maker = maker_of(0, 1, 1, 1, 2, 1, 1);
    maker.picture = name;
    const std::string text = maker.text();
    std::vector<Warning> warnings;
    const auto read = [&](const LoadMeshOptions& options) {
      return read_fbx({(folder / "a.fbx").string(), text, &warnings, options})
          .materials.at(0)
          .color_map;
    };
    EXPECT_TRUE(read({}).empty());
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].code, "picture-outside");
    EXPECT_EQ(read({.outside = true}).file.lexically_normal(), picture);
    // A copy beside the file is taken.
    save_image({1, 1, 3, {1, 0, 0}}, folder / "p.png", {.format = ImageFormat::png8});
    EXPECT_EQ(read({}).file, folder / "p.png");
    fs::remove(folder / "p.png");
  }
}

#endif

TEST(UvSets, OthersHaveOne) {
  const fs::path obj = write_file("a.obj", obj_text(kTurned[0].in_file, 1));
  EXPECT_THROW(load_mesh(obj, {.uv_set = 1}), Error);
  EXPECT_THROW(load_mesh(obj, {.uv_set_name = "UVMap"}), Error);
  const fs::path glb = write_file("a.glb", gltf_square().glb());
  EXPECT_EQ(load_mesh(glb, {.uv_set_name = "TEXCOORD_0"}).uv_set, 0U);
  try {
    load_mesh(glb, {.uv_set = 3});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("TEXCOORD_0"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kiln::test
