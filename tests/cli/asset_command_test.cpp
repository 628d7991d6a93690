// kiln bake --out NAME.glb: the whole job in one file.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <regex>

#include "asset/gltf_draco_write.h"
#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "support/json_file.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;
using test::expect_failure;
using test::low_of_halves;
using test::make_scene;
using test::names;

TEST(AssetCommand, OneFileHasLowAndMaps) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  expect_exit(call_kiln({"bake", scene / "high.obj", "--faces", "500", "--size", "64", "--ao-rays",
                         "16", "--out", scene / "new/low.glb"}),
              0, {});
  EXPECT_EQ(names(scene / "new"), std::vector<std::string>{"low.glb"});
  const Asset asset = load_asset(scene / "new/low.glb");
  EXPECT_LE(asset.mesh.triangles.size(), 500U);
  ASSERT_EQ(asset.materials.size(), 1U);
  EXPECT_FALSE(asset.materials[0].normal_map.empty());
  EXPECT_FALSE(asset.materials[0].occlusion_map.empty());
  EXPECT_TRUE(asset.materials[0].color_map.empty());
  // The file is a HIGH and a LOW itself, with the tangents that its map was baked for.
  expect_exit(call_kiln({"bake", scene / "high.obj", scene / "new/low.glb", "--size", "64", "--out",
                         scene / "again"}),
              0, {});
  EXPECT_EQ(names(scene / "again"), std::vector<std::string>{"low_normal.png"});
}

/// A quarter of the rays, smoothed, is the default of such a file alone, and only where nothing is said.
TEST(AssetCommand, OcclusionIsSmoothedWhereNothingIsSaid) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Mesh low =
      test::BumpySphere::light();  // the picture's size decides, not the texels that charts cover
  for (Vec2& uv : low.uvs) uv = {0.2F * uv.x, 0.2F * uv.y};
  save_obj(low, scene / "low.obj");
  const auto bake = [&](const std::string& out, std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     scene / "high.obj",
                                     scene / "low.obj",
                                     "--maps=ao",
                                     "--out=" + (scene / out).string(),
                                     "--json=" + (scene / "report.json").string()};
    if (std::any_of(flags.begin(), flags.end(),
                    [](const std::string& f) { return f.starts_with("--maps"); })) {
      std::erase(line, "--maps=ao");
    }
    line.insert(line.end(), flags.begin(), flags.end());
    expect_exit(call_kiln(line), 0, {});
    return test::read_json(scene / "report.json")["options"]["ao_error"];
  };
  EXPECT_EQ(bake("plain/low.glb", {"--size=1024"}), 1);
  EXPECT_EQ(bake("said/low.glb", {"--size=1024", "--ao-error=1"}), 1);
  const auto bytes = [&](const char* folder) {
    return test::read_file(scene / folder / "low.glb");
  };
  EXPECT_EQ(bytes("plain"), bytes("said"));
  EXPECT_NE(bake("rays/low.glb", {"--size=1024", "--ao-rays=4"}), 1);
  EXPECT_NE(bake("views/low.glb", {"--size=1024", "--ao-by=views"}), 1);
  EXPECT_NE(
      bake("bound/low.glb", {"--size=1024", "--maps=normal,ao", "--max-error=normal=90,ao=1"}), 1);
  EXPECT_NE(bake("loose/", {"--size=1024", "--ao-rays=4"}), 1);
  // Below 1024 x 1024 texels plain rays are as fast, and never further from the truth.
  EXPECT_NE(bake("small/low.glb", {"--size=1024x1023"}), 1);
}

/// glTF's default material is metal; a mesh that has none says nothing of metal.
TEST(AssetCommand, BareMeshesDoNotBecomeMetal) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  // Two triangles of the size of a sheet, without a material.
  const std::string gltf =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
      R"({"attributes":{"POSITION":0},"mode":5}]}],"accessors":[{"bufferView":0,"componentType":5126,)"
      R"("count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":48}],)"
      R"("buffers":[{"byteLength":48,"uri":"sheet.bin"}]})";
  const std::array<float, 12> places = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  save_text(scene / "sheet.gltf", gltf);
  save_text(scene / "sheet.bin", {reinterpret_cast<const char*>(places.data()), sizeof places});
  expect_exit(call_kiln({"bake", scene / "sheet.gltf", "--faces", "2", "--size", "16", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  ASSERT_EQ(asset.materials.size(), 1U);
  EXPECT_EQ(asset.materials[0].metallic, 0);
  EXPECT_TRUE(asset.materials[0].metallic_map.empty());
  EXPECT_TRUE(asset.materials[0].color_map.empty());
}

/// Materials of several kinds of numbers become one picture of occlusion, roughness and metalness.
TEST(AssetCommand, MaterialsOfHighAreKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Mesh high = test::BumpySphere::dense(6000);
  high.material_names = {"steel", "wood"};
  high.material_files = {"m.mtl"};
  for (std::size_t t = 0; t < high.triangles.size(); ++t) high.materials.push_back(t % 2);
  high.uvs = {{0, 0}};
  high.uv_triangles.assign(high.triangles.size(), {0, 0, 0});
  save_obj(high, scene / "high.obj");
  save_text(scene / "m.mtl",
            "newmtl steel\nKd 1 1 1\nPr 0.25\nPm 1\nnewmtl wood\nKd 1 1 1\nPr 0.25\nPm 1\n");
  expect_exit(call_kiln({"bake", scene / "high.obj", "--faces", "500", "--size", "64", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  EXPECT_EQ(asset.mesh.material_names.size(), 2U);
  const Material& material = asset.materials.at(0);
  EXPECT_EQ(material.metallic_map.channel, 2);
  EXPECT_EQ(material.roughness_map.channel, 1);
  ASSERT_NE(material.roughness_map.bytes, nullptr);
  const Image picture = load_image(*material.roughness_map.bytes);
  EXPECT_NEAR(picture.at(32, 32)[1], 0.25, 1.0 / 255);
  EXPECT_EQ(picture.at(32, 32)[2], 1);
}

/// The picture of normals of each material, and the corners of its triangles, are those of the set's own bake.
void expect_sets(const fs::path& glb, const fs::path& maps, const std::vector<std::string>& names,
                 const std::vector<std::string>& materials) {
  const Asset asset = load_asset(glb);
  ASSERT_EQ(asset.mesh.material_names, materials);
  for (const Vec2& uv : asset.mesh.uvs) {
    EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1) << uv.x << " " << uv.y;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Image loose = load_image(maps / names[i]);
    ASSERT_NE(asset.materials[i].normal_map.bytes, nullptr);
    const Image picture = load_image(*asset.materials[i].normal_map.bytes);
    ASSERT_EQ(picture.width, loose.width);
    // Dithering rounds to one of the two values around.
    EXPECT_LT(compare_images(picture, loose).max_error, 1.01 / 255) << names[i];
  }
}

TEST(AssetCommand, MaterialsThatOverlapHaveTheirOwnPictures) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_obj(low_of_halves(0), scene / "low.obj");
  for (const char* out : {"a.glb", "maps"}) {
    expect_exit(call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "64", "--size",
                           "body=32", "--out", scene / out, "--maps", "normal"}),
                0, {});
  }
  expect_sets(scene / "a.glb", scene / "maps", {"low_glass_normal.png", "low_body_normal.png"},
              {"glass", "body"});
}

TEST(AssetCommand, TilesMoveIntoTheUnitSquare) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_obj(low_of_halves(1), scene / "low.obj");
  // Without a given padding, GLBs alone have none of the background.
  for (const char* out : {"a.glb", "maps"}) {
    expect_exit(call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "64", "--out",
                           scene / out, "--maps", "normal", "--sets", "udim", "--gutter", "16"}),
                0, {});
  }
  expect_sets(scene / "a.glb", scene / "maps", {"low_normal.1001.png", "low_normal.1002.png"},
              {"glass.1001", "body.1002"});
}

/// Writes HIGH of an opaque material and a transparent, double-sided one, which is its upper half.
void save_high_with_glass(const fs::path& folder, const char* glass) {
  Mesh high = test::BumpySphere::dense(6000);
  high.material_names = {"stone", "glass"};
  for (const Triangle& t : high.triangles)
    high.materials.push_back(high.positions[t[0]].y > 0 ? 1 : 0);
  high.uvs = {{0, 0}};
  high.uv_triangles.assign(high.triangles.size(), {0, 0, 0});
  const Image grey{1, 1, 1, {0.25F}};
  AssetMaps maps;
  maps.opacity = &grey;
  const auto pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
  // A layout of any kind: HIGH's own is a point.
  high.uvs.clear();
  high.uv_triangles = high.triangles;
  for (const Vec3& p : high.positions) high.uvs.push_back({p.x, p.y});
  const std::vector<AssetMaterial> materials = {
      {.name = "stone", .pictures = pictures, .alpha_mode = AlphaMode::opaque},
      {.name = glass,
       .pictures = pictures,
       .alpha_mode = AlphaMode::blend,
       .double_sided = true,
       .extras = "{\"thick\":3}"}};
  save_asset(high, materials, folder / "high.glb");
}

void expect_glass(const Asset& asset, const std::vector<std::string>& names) {
  ASSERT_EQ(asset.mesh.material_names.size(), 2U);
  std::vector<std::string> sorted = asset.mesh.material_names;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, names);
  for (std::size_t t = 0; t < asset.mesh.triangles.size(); ++t) {
    const Material& material = asset.materials[asset.mesh.materials[t]];
    double y = 0;
    for (const std::uint32_t corner : asset.mesh.triangles[t]) {
      y += asset.mesh.positions[corner].y / 3;
    }
    if (std::abs(y) < 0.1) continue;  // a triangle's height
    EXPECT_EQ(material.alpha_mode, y > 0 ? AlphaMode::blend : AlphaMode::opaque) << y;
    EXPECT_EQ(material.double_sided, y > 0);
  }
  EXPECT_EQ(asset.materials[0].normal_map.bytes->size(),
            asset.materials[1].normal_map.bytes->size());
}

/// Transparent parts stay so, and nothing else becomes it: in low polys that Kiln makes, by their materials...
TEST(AssetCommand, TransparencyIsKeptByMaterial) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  save_high_with_glass(scene, "glass");
  expect_exit(call_kiln({"bake", scene / "high.glb", "--faces", "1500", "--size", "128", "--sets",
                         "one", "--out", scene / "a.glb"}),
              0, {});
  expect_glass(load_asset(scene / "a.glb"), {"glass", "stone"});
}

/// ... in those of one material, by what their texels show.
TEST(AssetCommand, TransparencyIsKeptByWhatTexelsShow) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_high_with_glass(scene, "glass");
  expect_exit(call_kiln({"bake", scene / "high.glb", scene / "low.obj", "--size", "128", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  expect_glass(asset, {"glass", "low"});
}

/// A material that is cut away below its own opacity keeps this threshold. A triangle of LOW takes the transparent
/// material that most of its texels show.
TEST(AssetCommand, ThresholdsOfOpacityAreKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh high = test::plane(10, 1);
  high.material_names = {"few", "most"};
  for (const Triangle& t : high.triangles) {
    double x = 0;
    for (const std::uint32_t corner : t) x += high.positions[corner].x / 3;
    high.materials.push_back(x < -0.3 ? 0 : 1);  // two of ten cells
  }
  const Image grey{1, 1, 1, {0.75F}};
  AssetMaps maps;
  maps.opacity = &grey;
  const auto pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
  const std::vector<AssetMaterial> materials = {
      {.name = "few", .pictures = pictures, .alpha_cutoff = 0.2F},
      {.name = "most", .pictures = pictures, .alpha_cutoff = 0.3F}};
  save_asset(high, materials, scene / "high.glb");
  Mesh low = test::plane(1, 1);
  low.triangles = {{0, 1, 3}, {0, 3, 2}};
  low.uv_triangles = low.triangles;
  save_obj(low, scene / "low.obj");
  expect_exit(call_kiln({"bake", scene / "high.glb", scene / "low.obj", "--size", "64", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  ASSERT_EQ(asset.mesh.material_names, std::vector<std::string>{"most"});
  EXPECT_EQ(asset.materials[0].alpha_mode, AlphaMode::mask);
  EXPECT_NEAR(asset.materials[0].alpha_cutoff, 0.3, 1e-6);
}

/// The hierarchy of LOW comes back, and of HIGH where Kiln makes LOW.
TEST(AssetCommand, HierarchiesAreKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh low = test::BumpySphere::light(), high = test::BumpySphere::dense(6000);
  SaveAssetOptions options;
  options.nodes = {
      {"root", AssetNode::kNone, {0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}, R"({"k":1})"},
      {"left", 0, {1, 0, 0, 0, 0, -3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 1}, ""},
      {"right", 0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, ""}};
  options.object_nodes = {1, 2};
  options.extras = R"({"by":"me"})";
  options.copyright = "Me";
  options.scene = R"({"name":"stage","extras":{"light":1}})";
  const AssetMaterial material{.name = "m"};
  for (Mesh* mesh : {&low, &high}) {
    mesh->object_names = {"left", "right"};
    for (const Triangle& t : mesh->triangles) {
      mesh->objects.push_back(mesh->positions[t[0]].x > 0 ? 1 : 0);
    }
    if (mesh->uvs.empty()) {
      mesh->uv_triangles = mesh->triangles;
      for (const Vec3& p : mesh->positions) mesh->uvs.push_back({p.x, p.y});
    }
    save_asset(*mesh, std::span(&material, 1), scene / (mesh == &low ? "low.glb" : "high.glb"),
               options);
  }
  const auto expect_nodes = [&](const fs::path& path) {
    const Asset asset = load_asset(path);
    ASSERT_GE(asset.nodes.size(), 3U);
    EXPECT_EQ(asset.nodes[0].name, "root");
    EXPECT_EQ(asset.nodes[0].transform, options.nodes[0].transform);
    EXPECT_EQ(asset.nodes[0].extras, options.nodes[0].extras);
    EXPECT_NE(asset.extras.find("\"by\":\"me\""), std::string::npos);
    EXPECT_EQ(asset.copyright, "Me");
    EXPECT_NE(asset.scene.find("\"name\":\"stage\""), std::string::npos) << asset.scene;
    EXPECT_NE(asset.scene.find("{\"light\":1}"), std::string::npos) << asset.scene;
    EXPECT_NE(asset.extras.find("\"fnv1a\""), std::string::npos);
    EXPECT_NE(asset.extras.find("\"ao_rays\""), std::string::npos);
    std::vector<std::string> names = asset.mesh.object_names;
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"left", "right"}));
    for (const Vec3& p : asset.mesh.positions) {
      EXPECT_NEAR(std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z), 1, 0.06);
    }
  };
  // Nodes' names are parts, too.
  expect_exit(call_kiln({"bake", scene / "high.glb", scene / "low.glb", "--size", "64",
                         "--match-by", "name", "--out", scene / "a.glb"}),
              0, {});
  expect_nodes(scene / "a.glb");
  expect_exit(call_kiln({"bake", scene / "high.glb", "--faces", "2000", "--size", "64", "--out",
                         scene / "b.gltf"}),
              0, {});
  expect_nodes(scene / "b.gltf");
  EXPECT_TRUE(fs::exists(scene / "b.bin"));
  EXPECT_TRUE(fs::exists(scene / "b_normal.png"));
}

/// HIGH's normal maps are part of its look: over its own UVs LOW gets the same picture again.
TEST(AssetCommand, NormalMapsOfHighAreKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh square;
  square.name = "square";
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  square.triangles = square.uv_triangles = {{0, 1, 2}, {0, 2, 3}};
  const Image tilted{1, 1, 3, {0.65F, 0.4F, 0.96F}};
  AssetMaps maps;
  maps.normal = &tilted;
  const AssetMaterial material{
      .name = "m", .pictures = std::make_shared<const AssetPictures>(encode_maps(maps))};
  save_asset(square, std::span(&material, 1), scene / "high.glb");
  save_asset(square, std::span(&material, 1), scene / "low.glb");
  expect_exit(call_kiln({"bake", scene / "high.glb", scene / "low.glb", "--size", "16", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  const Image normal = load_image(*asset.materials[0].normal_map.bytes, "normal");
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_NEAR(normal.at(8, 8)[c], tilted.pixels[c], 3.0 / 255);  // quantised, dithered, made unit
  }
}

/// An OBJ's MTL names the maps that are beside it, a material a set.
TEST(AssetCommand, AnObjHasAnMtlThatNamesItsMaps) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_high_with_glass(scene, "glass");
  fs::create_directories(scene / "p");
  save_obj(low_of_halves(1), scene / "low.obj");
  expect_exit(call_kiln({"bake", scene / "high.glb", scene / "low.obj", "--size", "64", "--out",
                         scene / "o/new.obj", "--sets", "udim"}),
              0, {});
  const std::vector<std::string> files = names(scene / "o");
  for (const char* name : {"new.obj", "new.mtl", "new_normal.1001.png", "new_ao.1002.png"}) {
    EXPECT_TRUE(std::find(files.begin(), files.end(), name) != files.end()) << name;
  }
  const Asset asset = load_asset(scene / "o/new.obj");
  // "body" is none of HIGH's: its triangles that show glass are glass.
  EXPECT_EQ(asset.mesh.material_names,
            (std::vector<std::string>{"glass.1001", "body.1002", "glass.1002"}));
  EXPECT_EQ(asset.materials.at(1).normal_map.file, scene / "o/new_normal.1002.png");
  EXPECT_EQ(asset.materials[0].opacity_map.file, scene / "o/new_opacity.1001.png");
  EXPECT_TRUE(asset.materials[1].opacity_map.empty());
  for (const Vec2& uv : asset.mesh.uvs) EXPECT_LE(uv.x, 1);
  // An MTL of the user's is not written over.
  save_text(scene / "p/made.mtl", "newmtl a\n");
  expect_exit(
      call_kiln({"bake", scene / "high.glb", "--faces", "500", "--out", scene / "p/made.obj"}), 5,
      {"made.mtl", "--force"});
  // One that Kiln makes, of the maps asked for.
  expect_exit(call_kiln({"bake", scene / "high.glb", "--faces", "500", "--size", "64", "--out",
                         scene / "o/made.obj", "--maps", "normal"}),
              0, {});
  const Asset made = load_asset(scene / "o/made.obj");
  EXPECT_EQ(made.materials.size(), 2U);
  EXPECT_EQ(made.materials[0].normal_map.file, scene / "o/made_stone_normal.png");
  EXPECT_TRUE(made.materials[0].color_map.empty());
}

/// Light brighter than white keeps its strength.
TEST(AssetCommand, EmissionKeepsItsStrength) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Mesh high = test::BumpySphere::dense(6000);
  high.material_names = {"lamp"};
  high.material_files = {"m.mtl"};
  high.materials.assign(high.triangles.size(), 0);
  save_obj(high, scene / "high.obj");
  save_text(scene / "m.mtl", "newmtl lamp\nKd 1 1 1\nKe 8 4 2\n");
  expect_exit(call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "64", "--out",
                         scene / "a.glb"}),
              0, {});
  const Asset asset = load_asset(scene / "a.glb");
  EXPECT_NEAR(asset.materials.at(0).emission[0], 8, 1e-4);
  const Image picture = load_image(*asset.materials[0].emission_map.bytes);
  EXPECT_EQ(picture.at(32, 32)[0], 1);
  // 0.5 in linear light is 0.7354 of sRGB (IEC 61966-2-1), 0.25 is 0.5371.
  EXPECT_NEAR(picture.at(32, 32)[1], 0.7354, 1.0 / 255);
  EXPECT_NEAR(picture.at(32, 32)[2], 0.5371, 1.0 / 255);
}

/// HIGH's own picture of occlusion darkens what its shape leaves open, with its strength.
TEST(AssetCommand, OcclusionOfHighIsKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const Image grey{4, 4, 1, std::vector<float>(16, 0.25F)};
  save_glb(load_mesh(scene / "low.obj"), {.occlusion = &grey}, scene / "high.gltf");
  const auto bake = [&](const char* member) {
    std::string text = test::read_file(scene / "high.gltf");
    const std::size_t at = text.find("\"occlusionTexture\"");
    ASSERT_NE(at, text.npos);
    save_text(scene / "changed.gltf", text.insert(text.find('{', at) + 1, member));
    expect_exit(call_kiln({"bake", scene / "changed.gltf", scene / "low.obj", "--size", "64",
                           "--out", scene / "a.glb"}),
                0, {});
  };
  const auto middle = [&] {
    const Asset asset = load_asset(scene / "a.glb");
    return load_image(*asset.materials.at(0).occlusion_map.bytes).at(32, 32)[0];
  };
  bake("\"strength\":0.5,");
  EXPECT_NEAR(middle(), 1 - 0.5 * 0.75, 2.0 / 255);
  // One that lies on UVs that are not read is named.
  bake("\"extensions\":{\"KHR_texture_transform\":{\"texCoord\":1}},");
  EXPECT_GT(middle(), 0.9);
}

/// Rendered normals of a mesh, degrees to those of the scene's HIGH: with its maps, and without.
struct Rendered {
  double with = 0, without = 0;
};
/// As it is said: a report has 30 more pictures.
Rendered render_with_own_maps(const fs::path& scene, const fs::path& mesh) {
  const test::ProcessResult result =
      call_kiln({"render", mesh, "--reference", scene / "high.obj", "--size", "64",
                 "--ambient-rays", "0", "--out", scene / "look.png"});
  expect_exit(result, 0, {});
  EXPECT_EQ(result.errors, "");
  Rendered rendered;
  std::smatch said;
  const std::regex figures("mean ([0-9.]+) degrees smooth without the map, ([0-9.]+) with it");
  if (std::regex_search(result.output, said, figures)) {
    rendered.without = std::stod(said[1]);
    rendered.with = std::stod(said[2]);
  }
  EXPECT_GT(rendered.with, 0) << result.output;
  return rendered;
}

/// A GLB is shown and measured as engines show it, with one set of maps or several.
TEST(AssetCommand, RenderShowsTheMapsOfMaterials) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_obj(low_of_halves(0), scene / "halves.obj");
  for (const char* low : {"low.obj", "halves.obj"}) {
    SCOPED_TRACE(low);
    expect_exit(call_kiln({"bake", scene / "high.obj", scene / low, "--size", "128", "--maps",
                           "normal", "--out", scene / "a.glb"}),
                0, {});
    const Rendered rendered = render_with_own_maps(scene, scene / "a.glb");
    EXPECT_LT(rendered.with, rendered.without / 3);
  }
  // Of an OBJ, those of its MTL; a picture that is no picture is told.
  save_text(scene / "low.mtl", "newmtl a\nnorm broken.png\n");
  save_text(scene / "broken.png", "none");
  Mesh low = load_mesh(scene / "low.obj");
  low.material_names = {"a"};
  low.materials.assign(low.triangles.size(), 0);
  low.material_files = {"low.mtl"};
  save_obj(low, scene / "named.obj");
  const auto warnings_of = [&](const char* mesh) {
    expect_exit(call_kiln({"render", scene / mesh, "--size", "64", "--ambient-rays", "0", "--out",
                           scene / "look.png", "--json", scene / "look.json"}),
                0, {});
    std::vector<std::string> codes;
    const auto report = test::read_json(scene / "look.json");
    for (const auto& warning : report["warnings"]) codes.push_back(warning["code"]);
    return codes;
  };
  EXPECT_EQ(warnings_of("named.obj"), std::vector<std::string>{"own-maps"});
  // One that repeats is shown beyond the unit square; one that ends there is not repeated, but told.
  save_image(Image{2, 2, 3, {0.5F, 0.5F, 1, 0.5F, 0.5F, 1, 0.5F, 0.5F, 1, 0.5F, 0.5F, 1}},
             scene / "flat.png", {ImageFormat::png8});
  for (Vec2& uv : low.uvs) uv = {2 * uv.x, 2 * uv.y};
  save_obj(low, scene / "twice.obj");
  save_text(scene / "low.mtl", "newmtl a\nnorm flat.png\n");
  render_with_own_maps(scene, scene / "twice.obj");
  save_text(scene / "low.mtl", "newmtl a\nnorm -clamp on flat.png\n");
  EXPECT_EQ(warnings_of("twice.obj"), std::vector<std::string>{"own-maps"});
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
    return call_kiln(flags);
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
  for (const char* flag : {"--flip-y", "--mips", "--range=ao=0,2"}) {
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", out, flag}, 2,
                   {std::string(flag).substr(0, std::string(flag).find('=')), "GLB"}, scene / "o");
  }
}

/// Encodings are the command's: each file is read back with the maps and the triangles that a plain one has.
TEST(AssetCommand, EncodingsAreChosen) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto bake = [&](const std::string& name, std::vector<std::string> flags) {
    std::vector<std::string> line = {
        "bake", scene / "high.obj", scene / "low.obj", "--size", "64",        "--ao-rays",
        "16",   "--maps",           "normal,ao",       "--out",  scene / name};
    line.insert(line.end(), flags.begin(), flags.end());
    expect_exit(call_kiln(line), 0, {});
    return fs::file_size(scene / name);
  };
  const auto plain = bake("plain.glb", {});
  const std::vector<std::string> formats = picture_formats();
  const auto has = [&](const char* format) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  std::vector<std::string> names = {"plain.glb"};
  if (has("JPEG")) {
    EXPECT_LT(bake("jpeg.glb", {"--format", "jpeg", "--quality=30", "--normal-error=2"}), plain);
    names.emplace_back("jpeg.glb");
  }
  if (has("WebP")) {
    const auto exact = bake("exact.glb", {"--format=webp"});
    EXPECT_LT(bake("lossy.glb", {"--format=webp", "--quality=40", "--normal-error=2"}), exact);
    EXPECT_GT(bake("both.glb", {"--format=webp", "--fallback-textures"}), exact);
    names.insert(names.end(), {"exact.glb", "lossy.glb", "both.glb"});
  }
  EXPECT_LT(bake("meshopt.glb", {"--mesh-compression", "meshopt"}), plain);
  names.emplace_back("meshopt.glb");
  if (can_pack_draco()) {
    EXPECT_LT(bake("draco.glb", {"--mesh-compression=draco"}), plain);
    names.emplace_back("draco.glb");
  }
  // A word behind the flag belongs to it, as does none.
  const auto dithered = bake("dithered.glb", {"--dither", "on"});
  EXPECT_EQ(bake("alone.glb", {"--dither"}), dithered);
  EXPECT_NE(bake("rounded.glb", {"--dither", "off"}), dithered);
  // Lossless WebP has the values of PNG, dithered as rounded.
  if (has("WebP")) {
    bake("dithered_webp.glb", {"--format=webp", "--dither"});
    const auto normals_of = [&](const char* name) {
      return load_image(*load_asset(scene / name).materials.at(0).normal_map.bytes).pixels;
    };
    EXPECT_EQ(normals_of("dithered_webp.glb"), normals_of("dithered.glb"));
    EXPECT_NE(normals_of("dithered_webp.glb"), normals_of("rounded.glb"));
  }
  const Asset first = load_asset(scene / "plain.glb");
  for (const std::string& name : names) {
    const Asset asset = load_asset(scene / name);
    EXPECT_EQ(asset.mesh.triangles.size(), first.mesh.triangles.size()) << name;
    ASSERT_EQ(asset.materials.size(), 1U) << name;
    ASSERT_TRUE(asset.materials[0].normal_map.bytes) << name;
    ASSERT_TRUE(asset.materials[0].occlusion_map.bytes) << name;
    const Image map = load_image(*asset.materials[0].normal_map.bytes);
    const Image own = load_image(*first.materials[0].normal_map.bytes);
    ASSERT_EQ(map.pixels.size(), own.pixels.size()) << name;
    EXPECT_LT(compare_images(map, own).mean_angle_degrees,
              name == "lossy.glb" || name == "jpeg.glb" ? 2.5 : 0.3)
        << name;
  }
}

TEST(AssetCommand, RefusesEncodingsThatDoNotGoTogether) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(), out = scene / "o";
  const auto refused = [&](const fs::path& to, std::vector<std::string> flags,
                           const std::vector<std::string>& words) {
    std::vector<std::string> line = {"bake", scene / "high.obj", scene / "low.obj", "--out", to};
    line.insert(line.end(), flags.begin(), flags.end());
    expect_failure(line, 2, words, out);
  };
  refused(out / "a.glb", {"--quality=50"}, {"--quality", "jpeg"});
  refused(out / "a.glb", {"--normal-error=1"}, {"--normal-error", "webp"});
  refused(out / "a.glb", {"--format=jpeg", "--fallback-textures"}, {"--fallback-textures", "webp"});
  refused(out / "a.glb", {"--format=jpeg", "--dither=on"}, {"--dither", "jpeg"});
  refused(out / "a.glb", {"--format=webp", "--quality=50", "--dither"}, {"--dither", "--quality"});
  refused(out / "a.glb", {"--format=ktx2"}, {"Basis Universal", "webp"});
  refused(out / "a.glb", {"--format=webp", "--quality=101"}, {"--quality", "100"});
  refused(out / "a.glb", {"--mesh-compression=zip"}, {"--mesh-compression", "meshopt"});
  refused(out, {"--mesh-compression=meshopt"}, {"--mesh-compression", "GLB"});
  refused(out, {"--format=jpeg"}, {"--format jpeg", "GLB"});
  refused(out, {"--format=png8", "--dither", "auto"}, {"--dither auto", "GLB"});
}

}  // namespace
}  // namespace kiln
