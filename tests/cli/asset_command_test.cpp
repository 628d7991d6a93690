// kiln bake --out NAME.glb: the whole job in one file.
#include <gtest/gtest.h>

#include "cli/command_scene.h"
#include "kiln/asset.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::expect_exit;
using test::expect_failure;
using test::make_scene;
using test::names;
using test::run_kiln;

TEST(AssetCommand, OneFileHasLowAndMaps) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  expect_exit(run_kiln({"bake", scene / "high.obj", "--faces", "500", "--size", "64", "--out",
                        scene / "new/low.glb"}),
              0, {});
  EXPECT_EQ(names(scene / "new"), std::vector<std::string>{"low.glb"});
  const Asset asset = load_asset(scene / "new/low.glb");
  EXPECT_LE(asset.mesh.triangles.size(), 500U);
  ASSERT_EQ(asset.materials.size(), 1U);
  EXPECT_FALSE(asset.materials[0].normal_map.empty());
  EXPECT_FALSE(asset.materials[0].occlusion_map.empty());
  EXPECT_TRUE(asset.materials[0].color_map.empty());
  // The file is a HIGH and a LOW itself, with the tangents that its map was baked for.
  expect_exit(run_kiln({"bake", scene / "high.obj", scene / "new/low.glb", "--size", "64", "--out",
                        scene / "again"}),
              0, {});
  EXPECT_EQ(names(scene / "again"), std::vector<std::string>{"low_normal.png"});
}

/// Materials of several kinds of numbers become one picture of occlusion, roughness and metalness.
TEST(AssetCommand, MaterialsOfHighAreKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Mesh high = test::BumpySphere::dense(20000);
  high.material_names = {"steel", "wood"};
  high.material_files = {"m.mtl"};
  for (std::size_t t = 0; t < high.triangles.size(); ++t) high.materials.push_back(t % 2);
  high.uvs = {{0, 0}};
  high.uv_triangles.assign(high.triangles.size(), {0, 0, 0});
  save_obj(high, scene / "high.obj");
  save_text(scene / "m.mtl",
            "newmtl steel\nKd 1 1 1\nPr 0.25\nPm 1\nnewmtl wood\nKd 1 1 1\nPr 0.25\nPm 1\n");
  expect_exit(run_kiln({"bake", scene / "high.obj", "--faces", "500", "--size", "64", "--out",
                        scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  const Material& material = asset.materials.at(0);
  EXPECT_EQ(material.metallic_map.channel, 2);
  EXPECT_EQ(material.roughness_map.channel, 1);
  ASSERT_NE(material.roughness_map.bytes, nullptr);
  const Image picture = load_image(*material.roughness_map.bytes);
  EXPECT_NEAR(picture.at(32, 32)[1], 0.25, 1.0 / 255);
  EXPECT_EQ(picture.at(32, 32)[2], 1);
}

TEST(AssetCommand, RefusesWhatAGlbCannotHold) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(), out = scene / "o" / "a.glb";
  for (const char* flag : {"--flip-y", "--mips"}) {
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", out, flag}, 2,
                   {flag, "GLB"}, scene / "o");
  }
  expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "o" / "a.gltf"},
                 2, {".glb"}, scene / "o");
}

}  // namespace
}  // namespace kiln
