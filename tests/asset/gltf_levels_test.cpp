// Levels of detail in one glTF: MSFT_lod.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "kiln/asset.h"
#include "kiln/files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The JSON chunk of a GLB.
json head_of(const std::vector<std::byte>& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, &glb[12], 4);
  return json::parse(std::string(reinterpret_cast<const char*>(&glb[20]), length));
}

std::shared_ptr<const AssetPictures> pictures_of(float value) {
  const Image normal{4, 4, 3, std::vector<float>(48, value)};
  AssetMaps maps;
  maps.normal = &normal;
  return std::make_shared<const AssetPictures>(encode_maps(maps));
}

Mesh sphere_of(std::uint32_t divisions, const char* name) {
  Mesh mesh = test::uv_sphere(divisions, divisions);
  mesh.name = name;
  return mesh;
}

AssetMaterial material_of(const std::shared_ptr<const AssetPictures>& pictures, const char* set) {
  AssetMaterial material;
  material.name = "skin";
  material.pictures = pictures;
  material.set = set;
  return material;
}

/// A sphere with two coarser levels. \param shares  all levels have the pictures of the first
struct Spheres {
  Mesh low = sphere_of(16, "ball");
  std::vector<AssetMaterial> materials;
  SaveAssetOptions options;

  explicit Spheres(bool shares) {
    const auto first = pictures_of(0.5F);
    materials = {material_of(first, "")};
    for (std::uint32_t k = 1; k < 3; ++k) {
      AssetLevel level;
      level.low = sphere_of(16 >> k, k == 1 ? "ball_lod1" : "ball_lod2");
      level.materials = {
          material_of(shares ? first : pictures_of(0.5F + 0.1F * k), k == 1 ? "lod1" : "lod2")};
      level.coverage = k == 1 ? 0.5 : 0.125;
      options.levels.push_back(std::move(level));
    }
  }
  std::vector<std::byte> glb() const { return encode_glb(low, materials, options); }
};

std::size_t triangles_of(const json& head, const json& node) {
  const json& mesh = head["meshes"].at(node["mesh"].get<std::size_t>());
  std::size_t indices = 0;
  for (const json& primitive : mesh["primitives"]) {
    indices +=
        head["accessors"].at(primitive["indices"].get<std::size_t>())["count"].get<std::size_t>();
  }
  return indices / 3;
}

/// Nodes that the scene or another node lists.
std::set<std::size_t> listed_nodes(const json& head) {
  std::set<std::size_t> listed;
  const auto add = [&](const json& nodes) {
    for (const json& node : nodes) listed.insert(node.get<std::size_t>());
  };
  add(head["scenes"][0]["nodes"]);
  for (const json& node : head["nodes"]) add(node.value("children", json::array()));
  return listed;
}

TEST(GltfLevels, TheFirstListsTheOthers) {
  const Spheres spheres(/*shares=*/false);
  const json head = head_of(spheres.glb());
  ASSERT_EQ(head["scenes"][0]["nodes"].size(), 1U);
  const json& root = head["nodes"].at(head["scenes"][0]["nodes"][0].get<std::size_t>());
  const json& ids = root["extensions"]["MSFT_lod"]["ids"];
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(root["extras"]["MSFT_screencoverage"], json({0.5, 0.125, 0}));
  EXPECT_EQ(head["extensionsUsed"], json({"MSFT_lod"}));
  EXPECT_FALSE(head.contains("extensionsRequired"));
  const std::set<std::size_t> listed = listed_nodes(head);
  std::size_t finer = triangles_of(head, root);
  EXPECT_EQ(root["name"], "ball");
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t id = ids[k];
    EXPECT_FALSE(listed.contains(id)) << "no scene may show a coarser level";
    const json& node = head["nodes"].at(id);
    EXPECT_EQ(node["name"], spheres.options.levels[k].low.name);
    EXPECT_LT(triangles_of(head, node), finer);
    finer = triangles_of(head, node);
  }
}

/// Pictures of levels are their own, or written once where levels share them.
TEST(GltfLevels, SharedPicturesAreWrittenOnce) {
  const json own = head_of(Spheres(false).glb()), shared = head_of(Spheres(true).glb());
  EXPECT_EQ(own["images"].size(), 3U);
  EXPECT_EQ(own["materials"].size(), 3U);
  EXPECT_EQ(own["images"][0]["name"], "normal");
  EXPECT_EQ(own["images"][1]["name"], "lod1_normal");
  EXPECT_EQ(shared["images"].size(), 1U);
  EXPECT_EQ(shared["materials"].size(), 1U);
  for (const json* head : {&own, &shared}) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ((*head)["meshes"][k]["primitives"][0]["material"], head == &own ? k : 0U);
    }
  }
}

/// A reader without the extension shows the first level, in every compression and in a glTF of several files.
TEST(GltfLevels, ReadersWithoutTheExtensionShowTheFirst) {
  for (const MeshCompression compression :
       {MeshCompression::none, MeshCompression::meshopt, MeshCompression::draco}) {
    Spheres spheres(false);
    spheres.options.compression = compression;
    const fs::path path = test::scratch_folder() / "levels.gltf";
    save_asset(spheres.low, spheres.materials, path, spheres.options);
    Spheres alone(false);
    alone.options.levels.clear();
    alone.options.compression = compression;
    std::vector<Warning> warnings;
    const std::vector<std::byte> glb = spheres.glb();
    const Asset files = load_asset(path, {}, &warnings);
    const Asset whole = load_asset(glb, "levels.glb", {}, &warnings);
    const Asset first = load_asset(alone.glb(), "first.glb", {}, &warnings);
    EXPECT_TRUE(warnings.empty());
    EXPECT_EQ(*whole.materials[0].normal_map.bytes, *first.materials[0].normal_map.bytes);
    for (const Asset* asset : {&files, &whole}) {
      EXPECT_EQ(asset->mesh.positions.size(), first.mesh.positions.size());
      EXPECT_EQ(asset->mesh.triangles, first.mesh.triangles);
      EXPECT_EQ(asset->mesh.uvs.size(), first.mesh.uvs.size());
      ASSERT_EQ(asset->materials.size(), 1U);
      EXPECT_FALSE(asset->materials[0].normal_map.empty());
    }
  }
}

/// With a hierarchy each level has the nodes of its objects.
TEST(GltfLevels, EachLevelHasItsHierarchy) {
  Spheres spheres(true);
  SaveAssetOptions& options = spheres.options;
  AssetNode moved;
  moved.name = "moved";
  moved.transform[12] = 3;
  options.nodes = {moved, moved};
  options.object_nodes = {1};
  for (AssetLevel& level : options.levels) level.object_nodes = {1};
  const json head = head_of(spheres.glb());
  const json& root = head["nodes"].at(head["scenes"][0]["nodes"][0].get<std::size_t>());
  const auto mesh_of = [&](const json& level) {
    EXPECT_EQ(level["children"].size(), 2U);
    const json& node = head["nodes"].at(level["children"][1].get<std::size_t>());
    EXPECT_EQ(node["name"], "moved");
    return triangles_of(head, node);
  };
  std::size_t finer = mesh_of(root);
  for (const json& id : root["extensions"]["MSFT_lod"]["ids"]) {
    const std::size_t own = mesh_of(head["nodes"].at(id.get<std::size_t>()));
    EXPECT_LT(own, finer);
    finer = own;
  }
  options.levels[0].object_nodes = {2};
  EXPECT_THROW(spheres.glb(), Error);
  options.levels[0].object_nodes = {};
  EXPECT_THROW(spheres.glb(), Error);
}

TEST(GltfLevels, CoveragesNeverRise) {
  for (const double coverage : {1.5, -0.1, 0.1}) {
    Spheres spheres(true);
    spheres.options.levels[0].coverage = coverage;  // the second's is 0.125
    EXPECT_THROW(spheres.glb(), Error) << coverage;
  }
  Spheres two_materials(true);
  two_materials.options.levels[1].materials.clear();
  EXPECT_THROW(two_materials.glb(), Error);
}

}  // namespace
}  // namespace kiln
