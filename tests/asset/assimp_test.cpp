// FBX, DAE, 3DS and X: other people's files with their counts, and a small Collada against its own numbers.
#include "asset/assimp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "io/image/image_samples.h"
#include "io/image/picture.h"
#include "kiln/mesh.h"
#include "support/environment.h"

#ifdef KILN_HAS_ASSIMP

namespace kiln {
namespace {

namespace fs = std::filesystem;

// The counts are those that Blender 5.0 reads (bpy, wm.fbx_import), and so are the boxes, turned to Y up.
TEST(Assimp, FilesOfOthers) {
  struct Expected {
    const char* file;
    std::size_t triangles, polygons, objects, materials;
    std::array<double, 6> box;  // low and high, metres
  };
  constexpr Expected kFiles[] = {
      {"animation_with_skeleton.fbx",
       2112,
       1056,
       1,
       1,
       {-36.42, -0.91667, -0.91667, 34.791, 0.91667, 0.91667}},
      {"box.fbx", 12, 12, 1, 1, {-0.2261, -0.16186, -0.064646, 0.28446, 0.24435, 0.46466}},
      {"boxWithCompressedCTypeArray.FBX",
       12,
       6,
       1,
       1,
       {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}},
      {"boxWithUncompressedCTypeArray.FBX",
       12,
       6,
       1,
       1,
       {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}},
      {"box_orphant_embedded_texture.fbx", 12, 6, 1, 1, {-0.5, 0, -0.5, 0.5, 1, 0.5}},
      {"close_to_identity_transforms.fbx",
       420,
       210,
       4,
       2,
       {-0.082137, -0.061239, -0.060438, 0.14362, 0.15981, 0.16537}},
      {"cubes_nonames.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"cubes_with_mirroring_and_pivot.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.15981, 0.26727}},
      {"cubes_with_names.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"cubes_with_outofrange_float.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"embedded_ascii/box.FBX", 12, 6, 1, 1, {-0.59989, 0, -0.6, 0.60011, 1.2, 0.6}},
      {"global_settings.fbx", 1352, 848, 2, 2, {-20.349, -21.949, -19.447, 36.717, 35.116, 37.618}},
      {"maxPbrMaterial_metalRough.fbx", 12, 6, 1, 1, {-8.3407, 0, -11.653, 9.482, 16.788, 10.311}},
      {"maxPbrMaterial_specGloss.fbx", 12, 6, 1, 1, {-8.3407, 0, -11.653, 9.482, 16.788, 10.311}},
      {"phong_cube.fbx", 12, 6, 1, 1, {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}}};
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  for (const Expected& expected : kFiles) {
    SCOPED_TRACE(expected.file);
    const std::string bytes = test::contents(folder / expected.file);
    const Asset asset = read_by_assimp({(folder / expected.file).string(), bytes});
    const Mesh& mesh = asset.mesh;
    EXPECT_EQ(mesh.triangles.size(), expected.triangles);
    EXPECT_EQ(mesh.polygons.empty() ? mesh.triangles.size() : mesh.polygons.back() + 1,
              expected.polygons);
    EXPECT_EQ(mesh.object_names.size(), expected.objects);
    EXPECT_EQ(asset.object_nodes.size(), expected.objects);
    EXPECT_EQ(asset.materials.size(), expected.materials);
    EXPECT_EQ(asset.mesh.metres, 1);
    std::array<double, 6> box{HUGE_VAL, HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const Vec3& p : mesh.positions) {
      const std::array<double, 3> at{p.x + mesh.origin[0], p.y + mesh.origin[1],
                                     p.z + mesh.origin[2]};
      for (std::size_t k = 0; k < 3; ++k) {
        box[k] = std::min(box[k], at[k]);
        box[3 + k] = std::max(box[3 + k], at[k]);
      }
    }
    const double size = expected.box[3] - expected.box[0];
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(box[k], expected.box[k], 1e-4 * size) << k;
    for (const Material& material : asset.materials) {
      EXPECT_TRUE(material.roughness >= 0 && material.roughness <= 1) << material.roughness;
    }
    // The command's way.
    EXPECT_EQ(load_mesh(folder / expected.file).triangles.size(), expected.triangles);
    // Cut short, it is an error or a mesh, never a crash.
    for (const std::size_t share : {1, 2, 3}) {
      try {
        read_by_assimp({"cut.fbx", std::string_view(bytes).substr(0, bytes.size() * share / 4)});
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      }
    }
  }
}

TEST(Assimp, EmbeddedPicturesAndFactors) {
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  const auto read = [&](const char* file) {
    const std::string bytes = test::contents(folder / file);
    return read_by_assimp({(folder / file).string(), bytes});
  };
  for (const char* file : {"box_orphant_embedded_texture.fbx", "embedded_ascii/box.FBX"}) {
    const MaterialPicture picture = read(file).materials.at(0).color_map;
    ASSERT_NE(picture.bytes, nullptr) << file;
    const Image image = load_image(*picture.bytes, picture.file.string());
    EXPECT_GT(image.width, 1u);
  }
  // Pictures that are there are found; others are told, and the numbers stand.
  const char* const pbr = "maxPbrMaterial_metalRough.fbx";
  const std::string bytes = test::contents(folder / pbr);
  const fs::path scratch = test::scratch_folder();
  std::vector<Warning> warnings;
  const auto read_here = [&] {
    return read_by_assimp({(scratch / pbr).string(), bytes, &warnings}).materials.at(0);
  };
  EXPECT_TRUE(read_here().color_map.empty());
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                          [](const Warning& w) { return w.code == "picture-missing"; }));
  for (const char* name : {"albedo", "normal", "roughness", "metalness", "emission"}) {
    fs::create_directories(scratch / "Textures");
    save_image({1, 1, 3, {1, 0, 0}}, scratch / "Textures" / (std::string(name) + ".png"),
               {.format = ImageFormat::png8});
  }
  const Material material = read_here();
  EXPECT_EQ(material.name, "PBR Material");
  EXPECT_EQ(material.color_map.file.filename(), "albedo.png");
  EXPECT_EQ(material.normal_map.file.filename(), "normal.png");
  EXPECT_EQ(material.roughness_map.file.filename(), "roughness.png");
  EXPECT_EQ(material.metallic_map.file.filename(), "metalness.png");
  EXPECT_EQ(material.emission_map.file.filename(), "emission.png");
}

/// One changed byte of a file with an embedded picture makes Assimp 5.2 free memory twice, now and then.
TEST(Assimp, DamagedFilesAreErrorsOrMeshes) {
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  for (const char* file : {"box_orphant_embedded_texture.fbx", "embedded_ascii/box.FBX"}) {
    const std::string bytes = test::contents(folder / file);
    for (std::size_t i = 0; i < 60; ++i) {
      std::string damaged = bytes;
      damaged[bytes.size() * (2 * i + 1) / 120] = "!\n\"5"[i % 4];
      try {
        read_by_assimp({"damaged.fbx", damaged});
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      }
    }
  }
}

/// A unit square, its second instance mirrored in x and 10 to the right.
const std::string kSquares = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g" name="square"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="n"><float_array id="na" count="3">0 0 1</float_array><technique_common>
<accessor source="#na" count="1" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="8">0 0 0.25 0 0.25 0.5 0 0.5</float_array><technique_common>
<accessor source="#ta" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2" set="0"/>
<vcount>4</vcount><p>0 0 0 1 0 1 2 0 2 3 0 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">
<node id="a" name="part"><instance_geometry url="#g"/></node>
<node id="b" name="part"><matrix>-1 0 0 10 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";

TEST(Assimp, InstancesMirroredOnesFaceTheSameWay) {
  const Asset asset = read_by_assimp({"squares.dae", kSquares});
  const Mesh& mesh = asset.mesh;
  EXPECT_EQ(asset.mesh.metres, 1);
  EXPECT_EQ(mesh.object_names, (std::vector<std::string>{"part", "part.001"}));
  ASSERT_EQ(asset.object_nodes.size(), 2u);
  EXPECT_EQ(asset.nodes[asset.object_nodes[1]].name, "part");
  EXPECT_EQ(asset.nodes[asset.object_nodes[1]].transform[12], 10);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  ASSERT_EQ(mesh.positions.size(), 8u);
  EXPECT_EQ(mesh.polygons, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  for (std::size_t t = 0; t < 4; ++t) {
    const auto corner = [&](std::size_t k) { return mesh.positions[mesh.triangles[t][k]]; };
    const double area = (corner(1).x - corner(0).x) * (corner(2).y - corner(0).y) -
                        (corner(2).x - corner(0).x) * (corner(1).y - corner(0).y);
    EXPECT_EQ(area, 1) << "the winding agrees with the normal, +z";
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = corner(k).x + mesh.origin[0], y = corner(k).y;
      const Vec2 uv = mesh.uvs[mesh.uv_triangles[t][k]];
      EXPECT_EQ(uv.x, (t < 2 ? x : 10 - x) / 4);
      EXPECT_EQ(uv.y, y / 2);
      EXPECT_EQ(mesh.normals[mesh.normal_triangles[t][k]].z, 1);
    }
  }
}

TEST(Assimp, RefusalsNameTheFileAndTheRemedy) {
  for (const char* name : {"bad.fbx", "bad.dae", "bad.3ds", "bad.x"}) {
    for (const std::string& bytes : {std::string("nothing"), std::string(1000, '\0'),
                                     std::string("Kaydara FBX Binary  \0\x1a\0", 23)}) {
      try {
        read_by_assimp({name, bytes});
        ADD_FAILURE() << name << " was read";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
        const std::string text = error.what();
        EXPECT_TRUE(text.starts_with(name)) << text;
        EXPECT_TRUE(text.ends_with(".")) << text;
      }
    }
  }
}

}  // namespace
}  // namespace kiln
#endif
