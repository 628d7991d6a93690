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

/// The scene's meshes as Kiln's own GLB, which is in metres with Y up.
void save_glb_of(const fs::path& obj, const fs::path& glb) { save_glb(load_mesh(obj), {}, glb); }

/// A mesh as a file has it in which Z is up, in centimetres.
void save_turned(const fs::path& from, const fs::path& to) {
  Mesh mesh = load_mesh(from);
  for (Vec3& p : mesh.positions) p = {100 * p.x, -100 * p.z, 100 * p.y};
  for (Vec3& n : mesh.normals) n = {n.x, -n.z, n.y};
  save_obj(mesh, to);
}

TEST(AssetCommand, AxesAndUnitsOfFilesThatDoNotSay) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  save_glb_of(scene / "low.obj", scene / "low.glb");
  save_turned(scene / "high.obj", scene / "turned.obj");
  const auto bake = [&](std::vector<std::string> flags, const fs::path& out) {
    flags.insert(flags.begin(), {"bake"});
    flags.insert(flags.end(), {"--size", "64", "--maps", "normal", "--out", out});
    return run_kiln(flags);
  };
  expect_exit(bake({scene / "high.obj", scene / "low.glb"}, scene / "a"), 0, {});
  // Without a word the boxes do not fit, and the message says what would help.
  expect_exit(bake({scene / "turned.obj", scene / "low.glb"}, scene / "b"), 3, {"0.01", "--unit"});
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--up", "z", "--unit", "cm"},
        std::vector<std::string>{"--up", "high=+Z", "--unit", "high=0.01"}}) {
    std::vector<std::string> all{scene / "turned.obj", scene / "low.glb"};
    all.insert(all.end(), flags.begin(), flags.end());
    expect_exit(bake(all, scene / "c"), 0, {});
    const Image wanted = load_image(scene / "a/low_normal.png");
    const Image found = load_image(scene / "c/low_normal.png");
    ASSERT_EQ(found.pixels.size(), wanted.pixels.size());
    // A hit on an edge of HIGH may be on either side of it.
    std::size_t apart = 0;
    for (std::size_t i = 0; i < wanted.pixels.size(); ++i) {
      apart += std::abs(found.pixels[i] - wanted.pixels[i]) > 1.0F / 255 ? 1 : 0;
    }
    EXPECT_LT(apart, wanted.pixels.size() / 500);
  }
  const std::string high = scene / "turned.obj", low = scene / "low.glb";
  expect_failure({"bake", low, low, "--up", "z", "--out", scene / "d"}, 2, {"--up", "high="});
  expect_failure({"bake", high, "--faces", "20", "--unit", "low=cm", "--out", scene / "d"}, 2,
                 {"--unit", "LOW"});
  expect_failure({"bake", high, low, "--unit", "yard", "--out", scene / "d"}, 2, {"yard", "mm"});
  expect_failure({"bake", high, low, "--up", "w", "--out", scene / "d"}, 2, {"'w'", "-z"});
  expect_failure({"bake", high, low, "--up", "x", "--up", "y", "--out", scene / "d"}, 2, {"twice"});
  expect_failure({"bake", high, low, "--uv-set", "low=1", "--out", scene / "d"}, 3,
                 {"low.glb", "TEXCOORD_0"});
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
