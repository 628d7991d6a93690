// Sets of UVs in glTF: which one a picture lies on, and quantised ones.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

using mesh_files::load;
using mesh_files::load_text;
using mesh_files::Loaded;
using mesh_files::write_file;
using nlohmann::json;

json& primitive_of(GltfMaker& maker) { return maker.json["meshes"][0]["primitives"][0]; }

/// The square with a material of two pictures, on the sets of UVs that its members name.
GltfMaker pictured_square() {
  GltfMaker maker = gltf_square();
  const Image image{1, 1, 3, {0.2F, 0.4F, 0.6F}};
  maker.json["images"] = {
      {{"bufferView", maker.add_view(encode(image, {.format = ImageFormat::png8}))},
       {"mimeType", "image/png"}}};
  maker.json["textures"] = {{{"source", 0}}};
  maker.json["materials"] = {{{"name", "paint"},
                              {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                              {"normalTexture", {{"index", 0}}}}};
  primitive_of(maker)["material"] = 0;
  return maker;
}

json& color_of(GltfMaker& maker) {
  return maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
}
json& normal_of(GltfMaker& maker) { return maker.json["materials"][0]["normalTexture"]; }

json moved(const json& scale, const json& offset = {0, 0}) {
  return {{"KHR_texture_transform", {{"scale", scale}, {"offset", offset}}}};
}

void expect_uvs(const Mesh& mesh, const std::vector<Vec2>& wanted) {
  ASSERT_EQ(mesh.uvs.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_NEAR(mesh.uvs[i].x, wanted[i].x, 1e-6) << i;
    EXPECT_NEAR(mesh.uvs[i].y, wanted[i].y, 1e-6) << i;
  }
}

const std::vector<Vec2> kSquare{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
constexpr std::array<float, 6> kUnmoved{1, 0, 0, 0, 1, 0};

/// As gltfpack stores them: 12 bits of 16, normalised, in the square [0, 4095 / 65535]^2; v runs down.
std::size_t add_quantised(GltfMaker& maker) {
  return maker.add<std::uint16_t>("VEC2", {0, 4095, 4095, 4095, 4095, 0, 0, 0}, true);
}
const double kBack = 65535.0 / 4095;

TEST(GltfUvs, QuantisedOnesLieWhereTheirPicturesPutThem) {
  GltfMaker maker = pictured_square();
  primitive_of(maker)["attributes"]["TEXCOORD_0"] = add_quantised(maker);
  color_of(maker)["extensions"] = normal_of(maker)["extensions"] = moved({kBack, kBack});
  const std::filesystem::path path = write_file("packed.glb", maker.glb());
  const Asset asset = load_asset(path);
  expect_uvs(asset.mesh, kSquare);
  EXPECT_EQ(asset.materials[0].color_map.uv_transform, kUnmoved)
      << "the mesh's UVs are moved already";
  EXPECT_EQ(load_materials(asset.mesh, path)[0].color_map.uv_transform, kUnmoved);
  expect_uvs(load(path).mesh, kSquare);

  // Written, the layout stands in the UVs.
  const AssetMaterial material;
  const std::filesystem::path out = scratch_folder() / "out.glb";
  save_asset(asset.mesh, std::span(&material, 1), out);
  expect_uvs(load(out).mesh, kSquare);

  // An offset and a turn by a quarter: u' = v + 0, v' = -u + 1, in glTF's UVs.
  color_of(maker)["extensions"] = normal_of(maker)["extensions"] = {
      {"KHR_texture_transform",
       {{"scale", {kBack, kBack}}, {"rotation", std::acos(0.0)}, {"offset", {0, 1}}}}};
  // (0, 1) goes to (1, 1), which is (1, 0) with v up, and so on round.
  expect_uvs(load_text("turned.glb", maker.glb()).mesh, {{1, 0}, {1, 1}, {0, 1}, {0, 0}});

  // In plain integers.
  GltfMaker plain = pictured_square();
  plain.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  primitive_of(plain)["attributes"]["TEXCOORD_0"] =
      plain.add<std::uint16_t>("VEC2", {0, 255, 255, 255, 255, 0, 0, 0});
  color_of(plain)["extensions"] = normal_of(plain)["extensions"] = moved({1 / 255.0, 1 / 255.0});
  expect_uvs(load_text("plain.glb", plain.glb()).mesh, kSquare);
}

/// A picture's own placement stays with the picture.
TEST(GltfUvs, FloatsAreTheLayoutAsTheyAre) {
  GltfMaker maker = pictured_square();
  color_of(maker)["extensions"] = normal_of(maker)["extensions"] = moved({4, 4});
  const Asset asset = load_asset(write_file("tiles.glb", maker.glb()));
  expect_uvs(asset.mesh, kSquare);
  EXPECT_EQ(asset.materials[0].color_map.uv_transform, (std::array<float, 6>{4, 0, 0, 0, 4, -3}));
}

/// Where pictures have several transforms, the layout is one, and each picture lies where it lay.
TEST(GltfUvs, SeveralTransformsOfOneMaterial) {
  GltfMaker maker = pictured_square();
  primitive_of(maker)["attributes"]["TEXCOORD_0"] = add_quantised(maker);
  color_of(maker)["extensions"] = moved({8 * kBack, 2 * kBack}, {0.5, 0});  // tiles
  normal_of(maker)["extensions"] = moved({kBack, kBack});
  const std::filesystem::path path = write_file("several.glb", maker.glb());
  std::vector<Warning> warnings;
  const Asset asset = load_asset(path, {}, &warnings);
  expect_uvs(asset.mesh, kSquare);
  std::size_t told = 0;
  for (const Warning& warning : warnings) told += warning.code == "uv-transforms" ? 1 : 0;
  EXPECT_EQ(told, 1U);
  EXPECT_EQ(asset.materials[0].normal_map.uv_transform, kUnmoved);
  // u' = 8 u + 0.5, v' = 2 v down: 1 - 2 (1 - v) = 2 v - 1 up.
  const std::array<float, 6> wanted{8, 0, 0.5F, 0, 2, -1};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(asset.materials[0].color_map.uv_transform[i], wanted[i], 1e-5) << i;
  }
}

/// KHR_texture_transform: its own texCoord comes before the picture's.
TEST(GltfUvs, TheExtensionsSetComesFirst) {
  GltfMaker maker = pictured_square();
  color_of(maker)["texCoord"] = 1;
  EXPECT_EQ(load_asset(write_file("own.glb", maker.glb())).materials[0].color_map.uv_set, 1U);
  color_of(maker)["extensions"]["KHR_texture_transform"]["texCoord"] = 2;
  EXPECT_EQ(load_asset(write_file("both.glb", maker.glb())).materials[0].color_map.uv_set, 2U);
  color_of(maker)["extensions"]["KHR_texture_transform"]["texCoord"] = 0;
  EXPECT_EQ(load_asset(write_file("zero.glb", maker.glb())).materials[0].color_map.uv_set, 0U);
  color_of(maker)["extensions"]["KHR_texture_transform"].erase("texCoord");
  color_of(maker)["extensions"]["KHR_texture_transform"]["scale"] = {2, 2};
  EXPECT_EQ(load_asset(write_file("scaled.glb", maker.glb())).materials[0].color_map.uv_set, 1U);
}

/// The mesh has each set that a picture lies on, and no others.
TEST(GltfUvs, EachSlotHasItsSet) {
  GltfMaker maker = pictured_square();
  json& attributes = primitive_of(maker)["attributes"];
  attributes["TEXCOORD_1"] = maker.add<float>("VEC2", {0.5F, 0.75F, 1, 1, 1, 0, 0, 0});
  attributes["TEXCOORD_2"] = maker.add<float>("VEC2", {0, 0, 0, 0, 0, 0, 0.25F, 0});
  normal_of(maker)["texCoord"] = 2;
  maker.json["meshes"][0]["primitives"].push_back(primitive_of(maker));
  maker.json["meshes"][0]["primitives"][1]["attributes"].erase("TEXCOORD_2");
  const std::filesystem::path path = write_file("sets.glb", maker.glb());
  const Asset asset = load_asset(path);
  ASSERT_EQ(asset.mesh.other_uvs.size(), 1U);
  EXPECT_EQ(asset.mesh.other_uvs[0].set, 2U);
  ASSERT_EQ(asset.mesh.other_uvs[0].uvs.size(), asset.mesh.uvs.size());
  EXPECT_EQ(asset.mesh.other_uvs[0].uvs[3], (Vec2{0.25F, 1}));
  EXPECT_TRUE(std::isnan(asset.mesh.other_uvs[0].uvs[4].x)) << "a primitive without that set";
  EXPECT_TRUE(
      load_material_texture(asset.materials, MaterialSlot::color, asset.mesh).uv_sets.empty());
  EXPECT_EQ(load_material_texture(asset.materials, MaterialSlot::normal, asset.mesh).uv_sets,
            (std::vector<std::uint32_t>{2}));
  EXPECT_THROW(load_material_texture(asset.materials, MaterialSlot::normal), Error);
  // Read with that set, the others are beside it.
  const Mesh second = load_mesh(path, {.uv_set = 2});
  EXPECT_EQ(second.uvs[3], (Vec2{0.25F, 1}));
  ASSERT_EQ(second.other_uvs.size(), 1U);
  EXPECT_EQ(second.other_uvs[0].set, 0U);
  EXPECT_EQ(second.other_uvs[0].uvs[1], (Vec2{1, 0}));
  // A set that no primitive has.
  normal_of(maker)["texCoord"] = 5;
  const Asset none = load_asset(write_file("none.glb", maker.glb()));
  EXPECT_TRUE(none.mesh.other_uvs.empty());
  EXPECT_THROW(load_material_texture(none.materials, MaterialSlot::normal, none.mesh), Error);
}

/// Transforms on another set stay as they are: that set is not moved.
TEST(GltfUvs, OnlyTheLayoutsOwnSetIsMoved) {
  GltfMaker maker = pictured_square();
  json& attributes = primitive_of(maker)["attributes"];
  attributes["TEXCOORD_0"] = add_quantised(maker);
  attributes["TEXCOORD_1"] = add_quantised(maker);
  color_of(maker)["extensions"] = moved({kBack, kBack});
  normal_of(maker)["texCoord"] = 1;
  normal_of(maker)["extensions"] = moved({kBack / 2, kBack});
  std::vector<Warning> warnings;
  const Asset asset = load_asset(write_file("sets.glb", maker.glb()), {}, &warnings);
  for (const Warning& warning : warnings) EXPECT_NE(warning.code, "uv-transforms");
  expect_uvs(asset.mesh, kSquare);
  ASSERT_EQ(asset.mesh.other_uvs.size(), 1U);
  EXPECT_NEAR(asset.mesh.other_uvs[0].uvs[1].x, 1 / kBack, 1e-6);
  EXPECT_NEAR(asset.materials[0].normal_map.uv_transform[0], kBack / 2, 1e-5);
  EXPECT_EQ(asset.materials[0].color_map.uv_transform, kUnmoved);
}

/// The value of the cases' README.
TEST(GltfUvs, TheCase) {
  const std::string folder = "cases/gltf_quantised";
  KILN_REQUIRE_DATA(folder);
  const Mesh packed = load(*shared_data(folder) / "packed.glb").mesh;
  const Mesh plain = load(*shared_data(folder) / "plain.glb").mesh;
  ASSERT_EQ(packed.triangles.size(), plain.triangles.size());
  for (std::size_t t = 0; t < packed.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 &a = packed.uvs[packed.uv_triangles[t][k]],
                 &b = plain.uvs[plain.uv_triangles[t][k]];
      EXPECT_NEAR(a.x, b.x, 1e-3);
      EXPECT_NEAR(a.y, b.y, 1e-3);
    }
  }
}

}  // namespace
}  // namespace kiln::test
