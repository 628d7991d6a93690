// GLBs that are written: the format's rules, and what comes back.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/texture_sets.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A GLB's parts; ends the test where they do not hold together as the format asks.
struct Parsed {
  json head;
  std::string bytes;

  explicit Parsed(const fs::path& path) {
    const std::string all = test::read_file(path);
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, all.data() + at, 4);
      return value;
    };
    EXPECT_EQ(all.substr(0, 4), "glTF");
    EXPECT_EQ(word(4), 2U);
    EXPECT_EQ(word(8), all.size());
    const std::size_t length = word(12);
    EXPECT_EQ(length % 4, 0U);
    EXPECT_EQ(all.substr(16, 4), "JSON");
    head = json::parse(all.substr(20, length));
    EXPECT_EQ(word(20 + length) % 4, 0U);
    bytes = all.substr(28 + length);
    EXPECT_EQ(word(20 + length), bytes.size());
    EXPECT_EQ(head["buffers"][0]["byteLength"], bytes.size());
  }

  /// A primitive's indices, which have 16 bits for fewer than 65,536 vertices.
  std::vector<std::uint32_t> indices(const json& primitive) const {
    const std::size_t accessor = primitive["indices"];
    const std::size_t positions = primitive["attributes"]["POSITION"];
    const bool is_short = head["accessors"].at(positions)["count"] < 65536;
    EXPECT_EQ(head["accessors"].at(accessor)["componentType"], is_short ? 5123 : 5125);
    if (!is_short) return values<std::uint32_t>(accessor, 1);
    const std::vector<std::uint16_t> shorts = values<std::uint16_t>(accessor, 1);
    return {shorts.begin(), shorts.end()};
  }

  /// An accessor's numbers, checked against its view.
  template <typename T>
  std::vector<T> values(std::size_t accessor, std::size_t width) const {
    const json& a = head["accessors"].at(accessor);
    const json& view = head["bufferViews"].at(a["bufferView"].get<std::size_t>());
    const std::size_t begin = view["byteOffset"], size = view["byteLength"];
    EXPECT_EQ(begin % 4, 0U);
    EXPECT_LE(begin + size, bytes.size());
    std::vector<T> result(a["count"].get<std::size_t>() * width);
    EXPECT_LE(result.size() * sizeof(T), size);
    std::memcpy(result.data(), bytes.data() + begin, result.size() * sizeof(T));
    return result;
  }
};

/// The format's rules for all primitives and pictures.
void expect_valid(const Parsed& glb) {
  EXPECT_EQ(glb.head["asset"]["version"], "2.0");
  for (const json& mesh : glb.head["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      const json& of = primitive["attributes"];
      const auto positions = glb.values<float>(of["POSITION"], 3);
      const auto normals = glb.values<float>(of["NORMAL"], 3);
      const bool has_tangents = of.contains("TANGENT");
      const auto tangents =
          has_tangents ? glb.values<float>(of["TANGENT"], 4) : std::vector<float>();
      const auto uvs = glb.values<float>(of["TEXCOORD_0"], 2);
      const std::size_t count = positions.size() / 3;
      ASSERT_EQ(normals.size(), 3 * count);
      ASSERT_EQ(tangents.size(), has_tangents ? 4 * count : 0);
      ASSERT_EQ(uvs.size(), 2 * count);
      const json& bounds = glb.head["accessors"].at(of["POSITION"].get<std::size_t>());
      for (std::size_t k = 0; k < 3; ++k) {
        float low = positions[k], high = low;
        for (std::size_t i = k; i < positions.size(); i += 3) {
          low = std::min(low, positions[i]);
          high = std::max(high, positions[i]);
        }
        EXPECT_EQ(bounds["min"][k].get<float>(), low);
        EXPECT_EQ(bounds["max"][k].get<float>(), high);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const auto length = [](const float* v) { return std::hypot(v[0], v[1], v[2]); };
        ASSERT_NEAR(length(&normals[3 * i]), 1, 1e-5);
        if (!has_tangents) continue;
        ASSERT_NEAR(length(&tangents[4 * i]), 1, 1e-5);
        ASSERT_EQ(std::abs(tangents[4 * i + 3]), 1);
      }
      for (const std::uint32_t index : glb.indices(primitive)) {
        ASSERT_LT(index, count);
      }
    }
  }
  for (const json& image : glb.head.value("images", json::array())) {
    const json& view = glb.head["bufferViews"].at(image["bufferView"].get<std::size_t>());
    const std::string png = glb.bytes.substr(view["byteOffset"], view["byteLength"]);
    EXPECT_NO_THROW(load_image(std::as_bytes(std::span(png)), "picture"));
  }
}

TEST(SaveGlb, IsValidAndComesBack) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.name = "ball";
  low.object_names = {"left", "right"};
  for (const Triangle& t : low.triangles) low.objects.push_back(low.positions[t[0]].x > 0 ? 1 : 0);
  const Image normal{4, 4, 3, std::vector<float>(48, 0.5F)};
  const Image grey{4, 4, 1, std::vector<float>(16, 0.25F)};
  AssetMaps maps;
  maps.normal = &normal;
  maps.occlusion = maps.opacity = &grey;
  save_glb(low, maps, path, {.extras = R"({"version":"x"})"});
  const Parsed glb(path);
  expect_valid(glb);
  EXPECT_EQ(glb.head["asset"]["extras"]["kiln"]["version"], "x");
  EXPECT_EQ(glb.head["materials"][0]["alphaMode"], "MASK");
  EXPECT_TRUE(glb.head["materials"][0].contains("occlusionTexture"));
  const Mesh back = load_mesh(path);
  EXPECT_EQ(back.triangles.size(), low.triangles.size());
  EXPECT_EQ(back.object_names, low.object_names);
  EXPECT_EQ(back.tangents.size(), 3 * low.triangles.size());
}

/// A square of n x n vertices, slightly curved, with UVs.
Mesh square_of(std::size_t columns, std::size_t rows) {
  Mesh mesh;
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t x = 0; x < columns; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(columns - 1),
                  v = static_cast<float>(y) / static_cast<float>(rows - 1);
      mesh.positions.push_back({u, v, u * v});
      mesh.uvs.push_back({u, v});
    }
  }
  for (std::size_t y = 0; y + 1 < rows; ++y) {
    for (std::size_t x = 0; x + 1 < columns; ++x) {
      const auto a = static_cast<std::uint32_t>(y * columns + x),
                 b = static_cast<std::uint32_t>(a + columns);
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({a + 1, b + 1, b});
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

TEST(SaveGlb, AlphaModesAndCutoffsAreWritten) {
  const fs::path path = test::scratch_folder() / "a.glb";
  const Mesh low = square_of(3, 3);
  const Image color{1, 1, 3, {0.5F, 0.5F, 0.5F}}, opacity{1, 1, 1, {0.5F}};
  AssetMaps maps;
  maps.color = &color;
  maps.opacity = &opacity;
  for (const auto& [mode, name] : {std::pair{AlphaMode::opaque, "OPAQUE"},
                                   {AlphaMode::mask, "MASK"},
                                   {AlphaMode::blend, "BLEND"}}) {
    for (const float cutoff : {0.25F, 0.5F, 0.75F}) {
      for (const bool double_sided : {false, true}) {
        save_glb(low, maps, path,
                 {.alpha_mode = mode, .alpha_cutoff = cutoff, .double_sided = double_sided});
        const json material = Parsed(path).head["materials"][0];
        EXPECT_EQ(material.value("alphaMode", "OPAQUE"), name);
        EXPECT_EQ(material.value("doubleSided", false), double_sided);
        if (mode == AlphaMode::mask) EXPECT_EQ(material.value("alphaCutoff", 0.5F), cutoff);
      }
    }
  }
}

/// Indices have 16 bits up to the index 65534, since 65535 restarts primitives, and 32 bits beyond; both come back.
TEST(SaveGlb, IndicesHave16BitsWhereTheyFit) {
  const fs::path path = test::scratch_folder() / "a.glb";
  for (const auto [columns, rows, type] :
       {std::array<std::size_t, 3>{255, 257, 5123}, std::array<std::size_t, 3>{256, 256, 5125},
        std::array<std::size_t, 3>{3, 3, 5123}}) {
    const Mesh low = square_of(columns, rows);
    AssetMaterial material;
    for (const MeshCompression compression :
         {MeshCompression::none, MeshCompression::meshopt, MeshCompression::draco}) {
      save_asset(low, std::span(&material, 1), path, {.compression = compression});
      const Parsed glb(path);
      const json& primitive = glb.head["meshes"][0]["primitives"][0];
      const json& indices = glb.head["accessors"].at(primitive["indices"].get<std::size_t>());
      EXPECT_EQ(indices["componentType"], type) << columns;
      EXPECT_EQ(indices["count"], 3 * low.triangles.size());
      if (compression == MeshCompression::none) {
        const json& view = glb.head["bufferViews"].at(indices["bufferView"].get<std::size_t>());
        EXPECT_EQ(view["byteLength"], 3 * low.triangles.size() * (type == 5123 ? 2 : 4));
        const std::vector<std::uint32_t> all = glb.indices(primitive);
        EXPECT_EQ(*std::max_element(all.begin(), all.end()), columns * rows - 1);
      }
      const Mesh back = load_mesh(path);
      EXPECT_EQ(back.triangles.size(), low.triangles.size());
      EXPECT_EQ(back.positions.size(), low.positions.size());
    }
  }
}

/// Tangents serve a normal map: without one, a primitive with pictures has none, and its vertices are not split by them.
TEST(SaveGlb, TangentsAreLeftOutWithoutANormalMap) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = square_of(9, 9);
  low.tangents.assign(3 * low.triangles.size(), Tangent{{1, 0, 0}, 1});
  low.tangents[1].direction = {0, 1, 0};  // one corner of a vertex of three triangles
  const Image grey{4, 4, 3, std::vector<float>(48, 0.5F)};
  const auto attributes_with = [&](const AssetMaps& maps, MeshCompression compression) {
    AssetMaterial material;
    material.pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
    save_asset(low, std::span(&material, 1), path, {.compression = compression});
    const Parsed glb(path);
    const json primitive = glb.head["meshes"][0]["primitives"][0];
    const std::size_t positions = primitive["attributes"]["POSITION"];
    return std::pair(primitive["attributes"].contains("TANGENT"),
                     glb.head["accessors"].at(positions)["count"].get<std::size_t>());
  };
  AssetMaps color, normal;
  color.color = &grey;
  normal.normal = normal.color = &grey;
  for (const MeshCompression compression :
       {MeshCompression::none, MeshCompression::meshopt, MeshCompression::draco}) {
    const auto [has_tangents, vertices] = attributes_with(color, compression);
    EXPECT_FALSE(has_tangents);
    EXPECT_EQ(vertices, 81);
    EXPECT_EQ(load_mesh(path).tangents.size(), 0);
    EXPECT_TRUE(attributes_with(normal, compression).first);
    EXPECT_TRUE(attributes_with({}, compression).first);  // the mesh may be read again for a bake
  }
  EXPECT_EQ(attributes_with(normal, MeshCompression::none).second, 82);
}

/// Whichever slots of a material have maps, one or two of them, tangents are there for normals alone, or where nothing
/// has a picture.
TEST(SaveGlb, TangentsDependOnNormalsInEverySetOfSlots) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = square_of(3, 3);
  low.tangents.assign(3 * low.triangles.size(), Tangent{{1, 0, 0}, 1});
  const Image grey{4, 4, 1, std::vector<float>(16, 0.5F)},
      color{4, 4, 3, std::vector<float>(48, 0.5F)};
  const std::vector<std::pair<const Image * AssetMaps::*, const Image*>> slots = {
      {&AssetMaps::normal, &color},   {&AssetMaps::occlusion, &grey},
      {&AssetMaps::roughness, &grey}, {&AssetMaps::metallic, &grey},
      {&AssetMaps::opacity, &grey},   {&AssetMaps::color, &color},
      {&AssetMaps::emission, &color},
  };
  for (std::size_t i = 0; i < slots.size(); ++i) {
    for (std::size_t k = i; k < slots.size(); ++k) {
      AssetMaps maps;
      for (const std::size_t slot : {i, k}) maps.*slots[slot].first = slots[slot].second;
      if (maps.opacity != nullptr && maps.color == nullptr) maps.color = &color;
      AssetMaterial material;
      material.pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
      save_asset(low, std::span(&material, 1), path);
      const Parsed glb(path);
      const json attributes = glb.head["meshes"][0]["primitives"][0]["attributes"];
      EXPECT_EQ(attributes.contains("TANGENT"), maps.normal != nullptr) << i << " " << k;
    }
  }
}

/// A mesh far away keeps its shape, by the root's translation.
TEST(SaveGlb, OriginsAreTheRootsTranslation) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.origin = {500000.25, 4000000.5, 100};
  save_glb(low, {}, path, {.metres = 0.01});
  const Mesh small = load_mesh(path);
  const Vec3& p = low.positions[low.triangles[0][0]];
  EXPECT_NEAR(small.origin[0] + small.positions[small.triangles[0][0]].x,
              0.01 * (low.origin[0] + p.x), 1e-6);
  save_glb(low, {}, path);
  const Parsed glb(path);
  EXPECT_EQ(glb.head["nodes"][0]["translation"], json(low.origin));
  const Mesh back = load_mesh(path);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = [&](const Mesh& mesh) {
      const Vec3& p = mesh.positions[mesh.triangles[0][0]];
      return mesh.origin[k] + (k == 0 ? p.x : k == 1 ? p.y : p.z);
    };
    EXPECT_NEAR(at(back), at(low), 1e-6);
  }
}

TEST(SaveGlb, RefusesWhatItCannotHold) {
  const fs::path path = test::scratch_folder() / "a.glb";
  const Mesh low = test::BumpySphere::light();
  const Image grey{4, 4, 1, std::vector<float>(16, 1)}, small{2, 2, 1, std::vector<float>(4, 1)};
  AssetMaps maps;
  maps.normal = &grey;
  EXPECT_THROW(save_glb(low, maps, path), Error);
  maps = {};
  maps.roughness = &grey;
  maps.metallic = &small;
  EXPECT_THROW(save_glb(low, maps, path), Error);
  EXPECT_THROW(save_glb(low, {}, path, {.extras = "{"}), Error);
  Mesh bare = low;
  bare.uvs.clear();
  bare.uv_triangles.clear();
  maps = {};
  maps.occlusion = &grey;
  EXPECT_THROW(save_glb(bare, maps, path), Error);
  EXPECT_FALSE(fs::exists(path));
}

/// As a plan makes low polys that need no map.
TEST(SaveGlb, MeshesWithoutUvsHaveNormalsAlone) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh bare = test::BumpySphere::light();
  bare.uvs.clear();
  bare.uv_triangles.clear();
  save_glb(bare, {}, path);
  const Parsed glb(path);
  const json& attributes = glb.head["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_EQ(attributes.size(), 2U);
  const Mesh back = load_mesh(path);
  EXPECT_EQ(back.triangles.size(), bare.triangles.size());
  EXPECT_EQ(back.normals.size(), back.positions.size());
  EXPECT_TRUE(back.uvs.empty());
}

TEST(SaveGlb, WebpIsRequiredWhereItIsWritten) {
  const std::vector<std::string> formats = picture_formats();
  if (std::find(formats.begin(), formats.end(), "WebP") == formats.end()) {
    GTEST_SKIP() << "built without libwebp";
  }
  const fs::path folder = test::scratch_folder();
  const Image normal{4, 4, 3, std::vector<float>(48, 0.25F)};
  AssetMaps maps;
  maps.normal = &normal;
  AssetMaterial material;
  material.pictures = std::make_shared<const AssetPictures>(encode_maps(maps, ImageFormat::webp));
  ASSERT_EQ(material.pictures->errors.size(), 1U);
  EXPECT_EQ(material.pictures->errors[0].map, "normal");
  EXPECT_TRUE(material.pictures->errors[0].is_normal);
  for (const char* name : {"a.glb", "b.gltf"}) {
    save_asset(test::BumpySphere::light(), std::span(&material, 1), folder / name);
    const Asset back = load_asset(folder / name);
    const MaterialPicture& map = back.materials[0].normal_map;
    const Image picture = map.bytes ? load_image(*map.bytes) : load_image(map.file);
    EXPECT_NEAR(picture.pixels[0], 0.25, 1.0 / 255);
  }
  EXPECT_TRUE(fs::exists(folder / "b_normal.webp"));
  const Parsed glb(folder / "a.glb");
  expect_valid(glb);
  EXPECT_EQ(glb.head["extensionsRequired"], json({"EXT_texture_webp"}));
  EXPECT_EQ(glb.head["extensionsUsed"], json({"EXT_texture_webp"}));
  EXPECT_FALSE(glb.head["textures"][0].contains("source"));
  EXPECT_THROW(encode_maps(maps, ImageFormat::png16), Error);
}

/// Two materials share pictures, which the file has once; each keeps its own ways.
TEST(SaveAsset, MaterialsShareTheirPictures) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.material_names = {"stone", "glass", "nowhere"};
  for (const Triangle& t : low.triangles)
    low.materials.push_back(low.positions[t[0]].x > 0 ? 1 : 0);
  const Image grey{4, 4, 1, std::vector<float>(16, 0.25F)};
  const Image light{4, 4, 3, std::vector<float>(48, 0.5F)};
  AssetMaps maps;
  maps.opacity = &grey;
  maps.emission = &light;
  maps.emission_strength = 12;
  const auto pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
  const std::vector<AssetMaterial> materials = {
      {.name = "stone", .pictures = pictures, .alpha_mode = AlphaMode::opaque},
      {.name = "glass",
       .pictures = pictures,
       .alpha_mode = AlphaMode::blend,
       .double_sided = true,
       .extras = R"({"a":[1]})"},
      {.name = "nowhere", .pictures = pictures}};
  save_asset(low, materials, path);
  const Parsed glb(path);
  expect_valid(glb);
  EXPECT_EQ(glb.head["images"].size(), 2U);
  EXPECT_EQ(glb.head["meshes"][0]["primitives"].size(), 2U);
  EXPECT_EQ(glb.head["extensionsUsed"], json::array({"KHR_materials_emissive_strength"}));
  const Asset back = load_asset(path);
  ASSERT_EQ(back.mesh.material_names, (std::vector<std::string>{"stone", "glass"}));
  EXPECT_EQ(std::count(back.mesh.materials.begin(), back.mesh.materials.end(), 1U),
            std::count(low.materials.begin(), low.materials.end(), 1U));
  EXPECT_EQ(back.materials[0].alpha_mode, AlphaMode::opaque);
  EXPECT_FALSE(back.materials[0].double_sided);
  EXPECT_EQ(back.materials[1].alpha_mode, AlphaMode::blend);
  EXPECT_TRUE(back.materials[1].double_sided);
  EXPECT_EQ(back.materials[1].extras, R"({"a":[1]})");
  EXPECT_EQ(back.materials[1].emission[0], 12);
}

/// Objects lie in the spaces of their nodes, and come back to where they were in the world.
TEST(SaveAsset, HierarchiesAreKept) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.name = "ball";
  low.origin = {1000, 0, -5};
  low.object_names = {"turned", "mirrored", "second", "flattened", "nowhere"};
  for (const Triangle& t : low.triangles) {
    const Vec3& p = low.positions[t[0]];
    low.objects.push_back((p.x > 0 ? 1 : 0) + (p.y > 0 ? 2 : 0));
  }
  low.tangents = tangents_of(low);
  SaveAssetOptions options;
  // A quarter turn about z, twice as large along x; below it a mirror, which is moved; and one of no height.
  options.nodes = {
      {"root", AssetNode::kNone, {0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}, R"({"k":1})"},
      {"mirror", 0, {1, 0, 0, 0, 0, -3, 0, 0, 0, 0, 1, 0, 0, 0, 900, 1}, ""},
      {"flat", 0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, ""},
      {"empty", 1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, ""}};
  options.object_nodes = {0, 1, 0, 2, 3};
  options.nodes[1].mesh_extras = R"({"m":2})";
  const AssetMaterial material{.name = "m"};
  save_asset(low, std::span(&material, 1), path, options);
  const Parsed glb(path);
  expect_valid(glb);
  for (std::size_t i = 0; i < options.nodes.size(); ++i) {
    EXPECT_EQ(glb.head["nodes"][i]["name"], options.nodes[i].name);
  }
  EXPECT_EQ(glb.head["nodes"][0]["matrix"], json(options.nodes[0].transform));
  EXPECT_EQ(glb.head["nodes"][0]["extras"], json::parse(R"({"k":1})"));
  for (const json& mesh : glb.head["meshes"]) {
    EXPECT_EQ(mesh.contains("extras"), mesh["name"] == "mirrored");
  }
  EXPECT_EQ(glb.head["meshes"][1]["extras"], json::parse(R"({"m":2})"));
  EXPECT_FALSE(glb.head["nodes"][3].contains("matrix"));
  EXPECT_FALSE(glb.head["nodes"][3].contains("mesh"));
  // A node that mirrors has no mesh of its own: programs do not agree on tangents there.
  EXPECT_FALSE(glb.head["nodes"][1].contains("mesh"));
  EXPECT_EQ(load_asset(path).nodes[1].parent, 0U);

  const Mesh back = load_mesh(path);
  ASSERT_EQ(back.triangles.size(), low.triangles.size());
  ASSERT_EQ(back.tangents.size(), low.tangents.size());
  for (std::uint32_t object = 0; object < 4; ++object) {
    const auto of = [](const Mesh& mesh, std::size_t number) {
      std::vector<std::size_t> triangles;
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (mesh.objects[t] == number) triangles.push_back(t);
      }
      return triangles;
    };
    const std::string name = object == 0 ? "root"  // by its node
                                         : low.object_names[object];
    const auto found = std::find(back.object_names.begin(), back.object_names.end(), name);
    ASSERT_NE(found, back.object_names.end()) << name;
    const auto before = of(low, object),
               after = of(back, static_cast<std::size_t>(found - back.object_names.begin()));
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < 3 * before.size(); ++i) {
      const std::size_t t = before[i / 3], u = after[i / 3], k = i % 3;
      const Vec3 &p = low.positions[low.triangles[t][k]], &q = back.positions[back.triangles[u][k]];
      EXPECT_NEAR(low.origin[0] + p.x, back.origin[0] + q.x, 1e-3);  // floats near 1000
      EXPECT_NEAR(low.origin[1] + p.y, back.origin[1] + q.y, 1e-3);
      EXPECT_NEAR(low.origin[2] + p.z, back.origin[2] + q.z, 1e-3);
      const Vec3 &n = low.normals[low.normal_triangles[t][k]],
                 &m = back.normals[back.normal_triangles[u][k]];
      EXPECT_NEAR(n.x * m.x + n.y * m.y + n.z * m.z, 1, 1e-6);
      const Tangent &a = low.tangents[3 * t + k], &b = back.tangents[3 * u + k];
      EXPECT_NEAR(a.direction.x * b.direction.x + a.direction.y * b.direction.y +
                      a.direction.z * b.direction.z,
                  1, 1e-6);
      EXPECT_EQ(a.sign, b.sign);
    }
  }
}

/// Positions within a node that shrinks by 1e-36 would be 1e39, beyond floats: the mesh is no part of the node then,
/// whichever axis is the long one.
TEST(SaveAsset, NodesThatShrinkTooMuchHaveNoMesh) {
  const fs::path path = test::scratch_folder() / "a.glb";
  constexpr double kScale = 1e-36;
  for (const auto member : {&Vec3::x, &Vec3::y, &Vec3::z}) {
    for (const float far : {0.0F, 1000.0F}) {
      Mesh low = test::cube(1);
      for (Vec3& p : low.positions) p.*member += far;
      SaveAssetOptions options;
      options.nodes = {{"tiny",
                        AssetNode::kNone,
                        {kScale, 0, 0, 0, 0, kScale, 0, 0, 0, 0, kScale, 0, 0, 0, 0, 1},
                        ""}};
      options.object_nodes = {0};
      const AssetMaterial material{.name = "m"};
      save_asset(low, std::span(&material, 1), path, options);
      EXPECT_EQ(Parsed(path).head["nodes"][0].contains("mesh"), far == 0);
      const Mesh back = load_mesh(path);
      ASSERT_EQ(back.triangles.size(), low.triangles.size());
      for (std::size_t t = 0; t < low.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 &p = low.positions[low.triangles[t][k]],
                     &q = back.positions[back.triangles[t][k]];
          EXPECT_NEAR(p.x, back.origin[0] + q.x, 1e-3);
          EXPECT_NEAR(p.y, back.origin[1] + q.y, 1e-3);
          EXPECT_NEAR(p.z, back.origin[2] + q.z, 1e-3);
        }
      }
    }
  }
}

/// Colours of vertices are there, but are not multiplied with a picture of colours.
TEST(SaveAsset, VertexColorsComeBack) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::plane(16, 16);
  for (std::size_t i = 0; i < low.positions.size(); ++i) {
    const auto byte = static_cast<std::uint8_t>(i);
    low.colors.push_back({byte, static_cast<std::uint8_t>(255 - byte), 7, byte});
  }
  save_glb(low, {}, path);
  const Mesh back = load_mesh(path);
  ASSERT_EQ(back.colors.size(), low.colors.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(back.colors[back.triangles[t][k]], low.colors[low.triangles[t][k]]);
    }
  }
  const Image color{4, 4, 3, std::vector<float>(48, 0.5F)};
  AssetMaps maps;
  maps.color = &color;
  save_glb(low, maps, path);
  const Parsed glb(path);
  const json& of = glb.head["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_FALSE(of.contains("COLOR_0"));
  EXPECT_TRUE(of.contains("_COLOR_0"));
}

/// The same file as text, its buffer and pictures beside it.
TEST(SaveAsset, GltfHasItsFilesBesideIt) {
  const fs::path folder = test::scratch_folder(), path = folder / "a b#1.gltf";
  const Mesh low = test::BumpySphere::light();
  const Image normal{4, 4, 3, std::vector<float>(48, 0.5F)};
  const Image grey{4, 4, 1, std::vector<float>(16, 0.25F)};
  AssetMaps maps;
  maps.normal = &normal;
  maps.occlusion = maps.opacity = &grey;
  save_glb(low, maps, path);
  save_glb(low, maps, folder / "b.glb");
  for (const char* name :
       {".bin", "_normal.png", "_color.png", "_occlusion_roughness_metallic.png"}) {
    EXPECT_TRUE(fs::exists(folder / ("a b#1" + std::string(name)))) << name;
  }
  const Asset text = load_asset(path), binary = load_asset(folder / "b.glb");
  EXPECT_EQ(text.mesh.positions.size(), binary.mesh.positions.size());
  EXPECT_EQ(text.mesh.triangles, binary.mesh.triangles);
  const Image picture = load_image(text.materials[0].normal_map.file);
  EXPECT_EQ(picture.width, 4U);
}

TEST(SaveAsset, RefusesWhatDoesNotHoldTogether) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  const AssetMaterial material;
  const std::vector<AssetMaterial> two(2);
  EXPECT_THROW(save_asset(low, two, path), Error);
  EXPECT_THROW(save_asset(low, {}, path), Error);
  const auto save = [&](const SaveAssetOptions& options) {
    save_asset(low, std::span(&material, 1), path, options);
  };
  EXPECT_THROW(save({.extras = "1"}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a"}}}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a"}}, .object_nodes = {0, 0}}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a"}}, .object_nodes = {1}}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a", .parent = 0}}, .object_nodes = {0}}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a", .transform = {}}}, .object_nodes = {0}}), Error);
  EXPECT_THROW(save({.nodes = {{.name = "a", .extras = "{"}}, .object_nodes = {0}}), Error);
  EXPECT_FALSE(fs::exists(path));
  save({.nodes = {{.name = "a"}}, .object_nodes = {AssetNode::kNone}});
  EXPECT_EQ(load_asset(path).nodes.size(), 2U);
}

/// A square whose UVs lie in one of eight ways: turned by quarters, mirrored or not.
Mesh turned_square(int way) {
  Mesh mesh;
  mesh.name = "square";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const Vec3& p : mesh.positions) {
    Vec2 uv = {way >= 4 ? 1 - p.x : p.x, p.y};
    for (int k = 0; k < way % 4; ++k) uv = {1 - uv.y, uv.x};
    mesh.uvs.push_back(uv);
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// The normal map, read through the file's own tangents as engines do, gives HIGH's normals, whichever way UVs lie.
TEST(SaveGlb, TangentsFitTheMapInAllEightOrientations) {
  KILN_REQUIRE_DEVICE();
  const fs::path path = test::scratch_folder() / "a.glb";
  // A roof that leans along +x and a little along +y: its normal is (-0.3, -0.1, 1), made unit.
  Mesh high = turned_square(0);
  for (Vec3& p : high.positions) p.z = 0.001F * (0.3F * p.x + 0.1F * p.y);
  high.normals = {{-0.3F, -0.1F, 1}};
  high.normal_triangles = {{0, 0, 0}, {0, 0, 0}};
  const double length = std::sqrt(1 + 0.09 + 0.01);
  const Source source(*test::device(), high);
  for (int way = 0; way < 8; ++way) {
    const Mesh low = turned_square(way);
    BakeOptions options;
    options.width = options.height = 16;
    options.match.max_distance = Length::share(0.1);
    const BakeResult result = bake(source, low, options);
    AssetMaps maps;
    maps.normal = &result.maps[0].image;
    save_glb(low, maps, path);
    const Parsed glb(path);
    expect_valid(glb);
    const json& of = glb.head["meshes"][0]["primitives"][0]["attributes"];
    const auto n = glb.values<float>(of["NORMAL"], 3), t = glb.values<float>(of["TANGENT"], 4);
    const json& view =
        glb.head["bufferViews"].at(glb.head["images"][0]["bufferView"].get<std::size_t>());
    const std::string png = glb.bytes.substr(view["byteOffset"], view["byteLength"]);
    const Image map = load_image(std::as_bytes(std::span(png)), "map");
    const float* const texel = map.at(8, 8);
    const Vec3 normal{n[0], n[1], n[2]}, tangent{t[0], t[1], t[2]};
    // glTF 2.0, 3.7.2.1: bitangent = cross(normal, tangent.xyz) * tangent.w
    const Vec3 bitangent = {t[3] * (normal.y * tangent.z - normal.z * tangent.y),
                            t[3] * (normal.z * tangent.x - normal.x * tangent.z),
                            t[3] * (normal.x * tangent.y - normal.y * tangent.x)};
    const double x = 2 * texel[0] - 1, y = 2 * texel[1] - 1, z = 2 * texel[2] - 1;
    // Half a step of 8 bits either way, and what dithering adds.
    constexpr double kStep = 2.0 / 255;
    EXPECT_NEAR(x * tangent.x + y * bitangent.x + z * normal.x, -0.3 / length, 1.5 * kStep) << way;
    EXPECT_NEAR(x * tangent.y + y * bitangent.y + z * normal.y, -0.1 / length, 1.5 * kStep) << way;
  }
}

/// A torus in eight charts, each turned or mirrored in another way.
Mesh torus_of_all_orientations() {
  Mesh low = test::torus(96, 48);
  const std::vector<Vec2> uvs = std::move(low.uvs);
  low.uvs.clear();
  for (Triangle& t : low.uv_triangles) {
    const float middle = (uvs[t[0]].x + uvs[t[1]].x + uvs[t[2]].x) / 3;
    const int way = static_cast<int>(8 * middle);
    for (std::uint32_t& corner : t) {
      Vec2 uv = {8 * uvs[corner].x - static_cast<float>(way), uvs[corner].y};
      if (way >= 4) uv.x = 1 - uv.x;
      for (int k = 0; k < way % 4; ++k) uv = {1 - uv.y, uv.x};
      corner = static_cast<std::uint32_t>(low.uvs.size());
      low.uvs.push_back({(static_cast<float>(way % 4) + 0.03F + 0.94F * uv.x) / 4,
                         (static_cast<float>(way / 4) + 0.03F + 0.94F * uv.y) / 2});
    }
  }
  return low;
}

/// On a curved mesh, normals and tangents are interpolated, and turn from corner to corner: the file's frame and
/// picture give HIGH's exact normals all the same, in each orientation.
TEST(SaveGlb, CurvedMeshesAreRightInAllEightOrientations) {
  KILN_REQUIRE_DEVICE();
  const fs::path path = test::scratch_folder() / "a.glb";
  const Mesh low = torus_of_all_orientations();
  const Source source(*test::device(), test::BumpyTorus::dense(400000));
  BakeOptions options;
  options.width = options.height = 512;
  const BakeResult result = bake(source, low, options);
  AssetMaps maps;
  maps.normal = &result.maps[0].image;
  save_glb(low, maps, path);
  const Parsed glb(path);
  expect_valid(glb);
  const json& primitive = glb.head["meshes"][0]["primitives"][0];
  const json& of = primitive["attributes"];
  const auto p = glb.values<float>(of["POSITION"], 3), n = glb.values<float>(of["NORMAL"], 3),
             t = glb.values<float>(of["TANGENT"], 4), uv = glb.values<float>(of["TEXCOORD_0"], 2);
  const auto indices = glb.indices(primitive);
  const json& view =
      glb.head["bufferViews"].at(glb.head["images"][0]["bufferView"].get<std::size_t>());
  const std::string png = glb.bytes.substr(view["byteOffset"], view["byteLength"]);
  const Image map = load_image(std::as_bytes(std::span(png)), "map");
  std::array<double, 8> sum{}, count{};
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::uint32_t* const c = &indices[i];
    const auto mean = [&](const std::vector<float>& v, std::size_t width, std::size_t k,
                          const std::array<double, 3>& w) {
      return w[0] * v[width * c[0] + k] + w[1] * v[width * c[1] + k] + w[2] * v[width * c[2] + k];
    };
    // The texel that the middle lies in; its centre's place on the triangle, where that is inside.
    constexpr double kThird = 1.0 / 3;
    const auto column = static_cast<std::size_t>(512 * mean(uv, 2, 0, {kThird, kThird, kThird}));
    const auto row = static_cast<std::size_t>(512 * mean(uv, 2, 1, {kThird, kThird, kThird}));
    const double u = (static_cast<double>(column) + 0.5) / 512,
                 v = (static_cast<double>(row) + 0.5) / 512;
    const auto area = [&](double ax, double ay, double bx, double by) { return ax * by - ay * bx; };
    const auto x = [&](std::size_t k) { return uv[2 * c[k]] - u; };
    const auto y = [&](std::size_t k) { return uv[2 * c[k] + 1] - v; };
    std::array<double, 3> w = {area(x(1), y(1), x(2), y(2)), area(x(2), y(2), x(0), y(0)),
                               area(x(0), y(0), x(1), y(1))};
    const double all = w[0] + w[1] + w[2];
    for (double& weight : w) weight /= all;
    if (*std::min_element(w.begin(), w.end()) < 0) continue;
    // glTF 2.0, 3.7.2.1: bitangent = cross(normal, tangent.xyz) * tangent.w, of interpolated ones
    std::array<double, 3> normal{}, tangent{};
    for (std::size_t k = 0; k < 3; ++k) {
      normal[k] = mean(n, 3, k, w);
      tangent[k] = mean(t, 4, k, w);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    for (double& value : normal) value /= length;
    const double along = normal[0] * tangent[0] + normal[1] * tangent[1] + normal[2] * tangent[2];
    for (std::size_t k = 0; k < 3; ++k) tangent[k] -= along * normal[k];
    const double size = std::hypot(tangent[0], tangent[1], tangent[2]);
    for (double& value : tangent) value /= size;
    const float* const texel = map.at(column, row);
    std::array<double, 3> shaded{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      const double bitangent = t[4 * c[0] + 3] * (normal[a] * tangent[b] - normal[b] * tangent[a]);
      shaded[k] = (2 * texel[0] - 1) * tangent[k] + (2 * texel[1] - 1) * bitangent +
                  (2 * texel[2] - 1) * normal[k];
    }
    const test::Vec3d exact =
        test::BumpyTorus::exact_normal({mean(p, 3, 0, w), mean(p, 3, 1, w), mean(p, 3, 2, w)});
    const double cosine = (shaded[0] * exact.x + shaded[1] * exact.y + shaded[2] * exact.z) /
                          std::hypot(shaded[0], shaded[1], shaded[2]);
    const auto way = static_cast<std::size_t>(4 * u) + (v < 0.5 ? 4 : 0);
    sum[way] += std::acos(std::min(1.0, cosine)) * 180 / 3.14159265358979;
    ++count[way];
  }
  // 8 bits are 0.3 degrees in the mean (half of 2/255, in two axes), and rays along LOW's normals meet HIGH a
  // little off the tube's ray. Green the wrong way round is 9 degrees and more.
  for (std::size_t way = 0; way < 8; ++way) {
    ASSERT_GT(count[way], 200);
    EXPECT_LT(sum[way] / count[way], 0.5) << way;
  }
}

}  // namespace
}  // namespace kiln
