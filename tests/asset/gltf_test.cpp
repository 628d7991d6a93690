// glTF: what each part of the format gives, and files that lie.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "base/srgb.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "support/environment.h"

#ifdef KILN_HAS_WEBP
#include <webp/encode.h>
#endif
#ifdef KILN_HAS_DRACO
#include <draco/compression/encode.h>
#include <draco/core/encoder_buffer.h>
#include <draco/mesh/mesh.h>
#endif

namespace kiln::test {
namespace {

using mesh_files::expect_bad_text;
using mesh_files::load_text;
using mesh_files::Loaded;
using mesh_files::write_file;
using nlohmann::json;

json& primitive_of(GltfMaker& maker) { return maker.json["meshes"][0]["primitives"][0]; }

/// Six times the volume that a closed mesh holds: negative where it is inside out.
double volume(const Mesh& mesh, std::uint32_t object) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.objects[t] != object) continue;
    const auto& [i, j, k] = mesh.triangles[t];
    const Vec3 &a = mesh.positions[i], &b = mesh.positions[j], &c = mesh.positions[k];
    sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) +
           double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
           double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
  }
  return sum;
}

Vec3 face_normal(const Mesh& mesh, std::size_t t) {
  const auto& [i, j, k] = mesh.triangles[t];
  const Vec3 &a = mesh.positions[i], &b = mesh.positions[j], &c = mesh.positions[k];
  const Vec3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z};
  return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

TEST(Gltf, SquareFromEveryContainer) {
  const GltfMaker maker = gltf_square();
  const Loaded glb = load_text("square.glb", maker.glb());
  ASSERT_EQ(glb.mesh.triangles.size(), 2U);
  EXPECT_EQ(glb.mesh.uvs[0].x, 0);
  EXPECT_EQ(glb.mesh.uvs[0].y, 0) << "glTF's v runs down";
  EXPECT_EQ(glb.mesh.uvs[2].y, 1);
  EXPECT_EQ(glb.mesh.material_names, (std::vector<std::string>{"default"}));
  EXPECT_EQ(glb.count("flat-normals"), 2U);
  EXPECT_EQ(glb.mesh.normals[0].z, 1);

  json text = maker.json;
  text["buffers"] = {{{"byteLength", maker.binary().size()}, {"uri", "a%20b.bin"}}};
  const std::filesystem::path folder = scratch_folder();
  std::ofstream(folder / "a b.bin", std::ios::binary) << maker.binary();
  std::ofstream(folder / "square.gltf") << text.dump();
  const Loaded beside = mesh_files::load(folder / "square.gltf");
  EXPECT_EQ(beside.mesh.positions, glb.mesh.positions);
  EXPECT_EQ(beside.mesh.uvs, glb.mesh.uvs);
  // From memory there is nothing beside it.
  const std::string bytes = text.dump(), whole = maker.glb();
  EXPECT_THROW(load_mesh(std::as_bytes(std::span(bytes)), "square.gltf"), Error);
  EXPECT_EQ(load_mesh(std::as_bytes(std::span(whole)), "square.glb").positions, glb.mesh.positions);
}

TEST(Gltf, MirroredNodesKeepTheirOutside) {
  GltfMaker maker;
  // A tetrahedron, wound to face outwards: six times its volume is 1.
  const std::size_t positions = maker.add<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  const std::size_t normals = maker.add<float>("VEC3", {-1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  const std::size_t indices =
      maker.add<std::uint8_t>("SCALAR", {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  maker.add_mesh(
      {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}, {"indices", indices}},
      false);
  maker.json["meshes"][0]["name"] = "tip";
  // The second has the scale 6 and a mirror; the third is turned, moved and mirrored by its parent.
  maker.json["nodes"] = {{{"mesh", 0}},
                         {{"mesh", 0}, {"scale", {-1, 2, 3}}},
                         {{"name", "parent"},
                          {"matrix", {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1}},
                          {"children", {3}}},
                         {{"mesh", 0},
                          {"name", "tip"},
                          {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}},
                          {"translation", {0, 5, 0}}}};
  const std::filesystem::path path = write_file("nodes.glb", maker.glb());
  const Asset asset = load_asset(path);
  EXPECT_EQ(asset.mesh.object_names, (std::vector<std::string>{"tip", "tip.001", "tip.002"}));
  EXPECT_EQ(asset.object_nodes, (std::vector<std::uint32_t>{0, 1, 3}));
  ASSERT_EQ(asset.nodes.size(), 4U);
  EXPECT_EQ(asset.nodes[3].parent, 2U);
  EXPECT_EQ(asset.mesh.metres, 1);
  EXPECT_NEAR(volume(asset.mesh, 0), 1, 1e-6);
  EXPECT_NEAR(volume(asset.mesh, 1), 6, 1e-5);
  EXPECT_NEAR(volume(asset.mesh, 2), 1, 1e-3);  // ten units from the origin
  // A quarter turn takes (1, 0, 0) to (0, 1, 0); then it is moved, and mirrored: (10, -6, 0).
  const Vec3 p = asset.mesh.positions[9];
  EXPECT_NEAR(p.x + asset.mesh.origin[0], 10, 1e-5);
  EXPECT_NEAR(p.y + asset.mesh.origin[1], -6, 1e-5);
  // Normals face out with the surface: of the corner away from the origin, against the apex.
  for (std::size_t t = 0; t < asset.mesh.triangles.size(); ++t) {
    if (t % 4 != 3) continue;  // the face away from corner 0, whose corners' normals lean its way
    const Vec3 face = face_normal(asset.mesh, t);
    for (const std::uint32_t corner : asset.mesh.normal_triangles[t]) {
      const Vec3& n = asset.mesh.normals[corner];
      EXPECT_GT(n.x * face.x + n.y * face.y + n.z * face.z, 0) << t;
    }
  }
}

TEST(Gltf, StripsFansAndWhatIsNoSurface) {
  // Two triangles that face +z, from each mode.
  const std::map<int, std::vector<std::uint16_t>> orders{
      {4, {0, 1, 2, 0, 2, 3}}, {5, {0, 1, 3, 2}}, {6, {0, 1, 2, 3}}};
  for (const auto& [mode, order] : orders) {
    GltfMaker maker = gltf_square();
    primitive_of(maker)["mode"] = mode;
    primitive_of(maker)["indices"] = maker.add<std::uint16_t>("SCALAR", order);
    const Loaded loaded = load_text("mode.glb", maker.glb());
    ASSERT_EQ(loaded.mesh.triangles.size(), 2U) << mode;
    for (std::size_t t = 0; t < 2; ++t) EXPECT_EQ(face_normal(loaded.mesh, t).z, 1) << mode;
  }
  for (int mode = 0; mode < 4; ++mode) {
    GltfMaker maker = gltf_square();
    primitive_of(maker)["mode"] = mode;
    expect_bad_text("lines.glb", maker.glb(), {"no triangles", "surface"});
    maker.json["meshes"][0]["primitives"].push_back(primitive_of(maker));
    primitive_of(maker)["mode"] = 4;
    EXPECT_EQ(load_text("both.glb", maker.glb()).count("ignored-primitives"), 1U);
  }
}

TEST(Gltf, SparseAndNormalisedNumbers) {
  GltfMaker maker = gltf_square();
  const std::size_t places = maker.add_view<std::uint8_t>({2});
  const std::size_t values = maker.add_view<float>({5, 6, 7});
  maker.json["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", places}, {"componentType", 5121}}},
      {"values", {{"bufferView", values}}}};
  const Vec3 moved = load_text("sparse.glb", maker.glb()).mesh.positions[2];
  EXPECT_EQ(moved.x, 5);
  EXPECT_EQ(moved.z, 7);
  maker.json["accessors"][0].erase("bufferView");  // then it counts from zeros
  maker.json["accessors"][0]["sparse"]["count"] = 1;
  expect_bad_text("zeros.glb", maker.glb(), {"degenerate"});

  GltfMaker quantised = gltf_square();
  quantised.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  primitive_of(quantised)["attributes"]["POSITION"] = quantised.add<std::int16_t>(
      "VEC3", {-32768, 0, 0, 32767, 0, 0, 32767, 32767, 0, 0, 32767, 0}, true);
  primitive_of(quantised)["attributes"]["TEXCOORD_0"] =
      quantised.add<std::uint8_t>("VEC2", {0, 255, 255, 255, 255, 0, 0, 51}, true);
  const Mesh mesh = load_text("small.glb", quantised.glb()).mesh;
  EXPECT_EQ(mesh.positions[0].x, -1) << "the lowest integer is -1, too";
  EXPECT_EQ(mesh.positions[1].x, 1);
  EXPECT_FLOAT_EQ(mesh.uvs[3].y, 0.8F);
}

TEST(Gltf, ColoursAreLinearInTheFile) {
  for (const bool bytes : {false, true}) {
    GltfMaker maker = gltf_square();
    primitive_of(maker)["attributes"]["COLOR_0"] =
        bytes ? maker.add<std::uint8_t>("VEC4",
                                        {0, 255, 55, 128, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, true)
              : maker.add<float>("VEC3", {0, 1, 0.21586F, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    const Mesh mesh = load_text("colors.glb", maker.glb()).mesh;
    ASSERT_EQ(mesh.colors.size(), 4U);
    // 0.21586 is sRGB's 0.5020, 128 of 255; so is 55 of 255 within half a step.
    EXPECT_EQ(mesh.colors[0], (std::array<std::uint8_t, 4>{
                                  0, 255, 128, static_cast<std::uint8_t>(bytes ? 128 : 255)}));
  }
}

TEST(Gltf, TangentsFollowTheirNodes) {
  GltfMaker maker = gltf_square();
  primitive_of(maker)["attributes"]["NORMAL"] =
      maker.add<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  primitive_of(maker)["attributes"]["TANGENT"] =
      maker.add<float>("VEC4", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1});
  maker.json["nodes"].push_back({{"mesh", 0}, {"scale", {-1, 1, 1}}, {"translation", {5, 0, 0}}});
  const Mesh mesh = load_text("tangents.glb", maker.glb()).mesh;
  ASSERT_EQ(mesh.tangents.size(), 12U);
  EXPECT_EQ(mesh.tangents[0].direction.x, 1);
  EXPECT_EQ(mesh.tangents[0].sign, 1);
  // x is mirrored, y and z are not: the bitangent, sign * cross(n, t), is +y as before.
  EXPECT_EQ(mesh.tangents[6].direction.x, -1);
  EXPECT_EQ(mesh.tangents[6].sign, -1);
  EXPECT_EQ(face_normal(mesh, 2).z, 1);
}

TEST(Gltf, SetsOfUvs) {
  GltfMaker maker = gltf_square();
  primitive_of(maker)["attributes"]["TEXCOORD_1"] =
      maker.add<float>("VEC2", {0.5F, 0.75F, 1, 1, 1, 0, 0, 0});
  const std::filesystem::path path = write_file("sets.glb", maker.glb());
  EXPECT_EQ(load_mesh(path).uvs[0].x, 0);
  const Mesh second = load_mesh(path, {.uv_set = 1});
  EXPECT_EQ(second.uvs[0].x, 0.5F);
  EXPECT_EQ(second.uvs[0].y, 0.25F);
}

TEST(Gltf, ScenesSayWhatIsThere) {
  GltfMaker maker = gltf_square();
  maker.json["nodes"].push_back({{"mesh", 0}, {"name", "other"}});
  EXPECT_EQ(load_text("none.glb", maker.glb()).mesh.triangles.size(), 4U);
  maker.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {0, 1}}}};
  EXPECT_EQ(load_text("all.glb", maker.glb()).mesh.triangles.size(), 4U);
  maker.json["scene"] = 0;
  EXPECT_EQ(load_text("first.glb", maker.glb()).mesh.triangles.size(), 2U);
  maker.json["scenes"][0] = json::object();
  expect_bad_text("empty.glb", maker.glb(), {"scene"});
}

/// A file with a picture of one texel a channel apart, and a material of everything.
GltfMaker painted_square() {
  GltfMaker maker = gltf_square();
  const Image image{2, 1, 4, {0.2F, 0.4F, 0.6F, 0.8F, 0.2F, 0.4F, 0.6F, 0.8F}};
  const std::vector<std::byte> png = encode(image, {.format = ImageFormat::png8});
  maker.json["images"] = {{{"bufferView", maker.add_view(png)}, {"mimeType", "image/png"}}};
  maker.json["textures"] = {{{"source", 0}}};
  maker.json["materials"] = {
      {{"name", "skin"},
       {"pbrMetallicRoughness",
        {{"baseColorTexture", {{"index", 0}}},
         {"baseColorFactor", {1, 0.5, 1, 0.5}},
         {"metallicRoughnessTexture", {{"index", 0}}},
         {"roughnessFactor", 0.5}}},
       {"alphaMode", "BLEND"},
       {"emissiveFactor", {1, 1, 0}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3}}}}},
       {"doubleSided", true},
       {"extras", {{"id", 7}}}},
      {{"name", "skin"}}};
  primitive_of(maker)["material"] = 0;
  return maker;
}

/// What a texture of one colour holds in the first material: in linear light, or as it is.
double held(const Texture& texture, std::size_t channel) {
  const double read = texture.images.at(0)->pixels.at(channel);
  const Texture::Factor factor = texture.factors.empty() ? Texture::Factor() : texture.factors[0];
  return (texture.kind == TextureKind::srgb ? from_srgb(read) : read) *
             double{factor.times.at(channel)} +
         double{factor.plus};
}

TEST(Gltf, MaterialsAndTheirPictures) {
  const std::filesystem::path path = write_file("painted.glb", painted_square().glb());
  const Asset asset = load_asset(path);
  ASSERT_EQ(asset.materials.size(), 1U);
  const Material& m = asset.materials[0];
  EXPECT_EQ(m.name, "skin");
  EXPECT_TRUE(m.multiplies && m.double_sided);
  EXPECT_EQ(m.alpha_mode, AlphaMode::blend);
  EXPECT_EQ(m.emission[0], 3);
  EXPECT_EQ(m.extras, "{\"id\":7}");
  const Mesh mesh = load_mesh(path);
  const std::vector<Material> materials = load_materials(mesh, path);
  ASSERT_EQ(materials.size(), 1U);
  const auto first = [&](MaterialSlot slot, std::size_t channel = 0) {
    return held(load_material_texture(materials, slot), channel);
  };
  // The bytes are multiples of 51: exact in PNG.
  EXPECT_NEAR(first(MaterialSlot::roughness), 0.4 * 0.5, 1e-6);
  EXPECT_NEAR(first(MaterialSlot::metallic), 0.6, 1e-6);
  EXPECT_NEAR(first(MaterialSlot::opacity), 0.8 * 0.5, 1e-6);
  EXPECT_NEAR(first(MaterialSlot::color, 0), from_srgb(0.2), 1e-6);
  EXPECT_NEAR(first(MaterialSlot::color, 1), from_srgb(0.4) / 2, 1e-6);
}

/// Materials that tint one picture, images that are one view: one picture in memory.
TEST(Gltf, APictureOfManyMaterialsIsReadOnce) {
  GltfMaker maker = painted_square();
  const json skin = maker.json["materials"][0], image = maker.json["images"][0];
  for (int i = 1; i < 300; ++i) {
    maker.json["images"].push_back(image);
    maker.json["textures"].push_back({{"source", i}});
    json material = skin;
    material["name"] = "skin" + std::to_string(i);
    json& pbr = material["pbrMetallicRoughness"];
    pbr["baseColorFactor"] = {1, i / 300.0, 1, 1};
    pbr["roughnessFactor"] = i / 300.0;
    pbr["baseColorTexture"] = pbr["metallicRoughnessTexture"] = {{"index", i}};
    material["normalTexture"] = {{"index", i}, {"scale", i}};
    maker.json["materials"].push_back(material);
    json primitive = primitive_of(maker);
    primitive["material"] = maker.json["materials"].size() - 1;
    maker.json["meshes"][0]["primitives"].push_back(primitive);
  }
  const Asset asset = load_asset(write_file("tints.glb", maker.glb()));
  EXPECT_EQ(asset.materials.size(), 300U);
  for (const MaterialSlot slot : {MaterialSlot::color, MaterialSlot::roughness,
                                  MaterialSlot::opacity, MaterialSlot::normal}) {
    const Texture texture = load_material_texture(asset.materials, slot);
    EXPECT_EQ(texture.images.size(), 1U);
    if (slot == MaterialSlot::opacity) continue;
    ASSERT_EQ(texture.factors.size(), 300U);
    EXPECT_NE(texture.factors[298], texture.factors[299]);
  }
}

TEST(LoadAsset, ObjWithAndWithoutItsMtl) {
  const std::filesystem::path folder = scratch_folder();
  std::ofstream(folder / "a.obj") << "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
  EXPECT_TRUE(load_asset(folder / "a.obj").materials.empty());
  std::ofstream(folder / "a.mtl") << "newmtl m\nKd 0.5 0 0\n";
  const Asset asset = load_asset(folder / "a.obj");
  ASSERT_EQ(asset.materials.size(), 1U);
  EXPECT_EQ(asset.materials[0].color[0], 0.5F);
  EXPECT_TRUE(asset.nodes.empty());
}

TEST(Gltf, NoMtlInObj) {
  const Mesh mesh = load_text("painted.glb", painted_square().glb()).mesh;
  EXPECT_EQ(mesh.material_files, (std::vector<std::string>{"painted.glb"}));
  const std::filesystem::path path = scratch_folder() / "a.obj";
  save_obj(mesh, path);
  const Mesh again = load_mesh(path);
  EXPECT_TRUE(again.material_files.empty());
  EXPECT_EQ(again.material_names, mesh.material_names);
}

TEST(Gltf, NormalsTimesTheirScale) {
  GltfMaker maker = painted_square();
  maker.json["materials"][0]["normalTexture"] = {{"index", 0}, {"scale", 2}};
  const std::filesystem::path path = write_file("normals.glb", maker.glb());
  const Texture normals = load_material_texture(load_asset(path).materials, MaterialSlot::normal);
  EXPECT_EQ(normals.factors.at(0).times, (std::array<float, 4>{2, 2, 1, 1}));
}

TEST(Gltf, OpaqueWhateverTheAlpha) {
  GltfMaker maker = painted_square();
  maker.json["materials"][0].erase("alphaMode");
  const std::filesystem::path path = write_file("opaque.glb", maker.glb());
  const Texture texture = load_material_texture(load_asset(path).materials, MaterialSlot::opacity);
  EXPECT_TRUE(texture.images.empty());
  EXPECT_EQ(texture.plain.at(0)[0], 1);
}

TEST(Gltf, PicturesOnOtherUvs) {
  GltfMaker maker = painted_square();
  json& info = maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  info["extensions"]["KHR_texture_transform"] = {{"offset", {0.25, 0.125}}, {"scale", {2, 4}}};
  // glTF: u' = 2u + 0.25 and v' = 4v + 0.125, down. With v up, v' = 1 - (4 (1 - v) + 0.125) = 4v - 3.125.
  const std::filesystem::path moved = write_file("moved.glb", maker.glb());
  EXPECT_EQ(
      load_material_texture(load_asset(moved).materials, MaterialSlot::color).uv_transforms.at(0),
      (std::array<float, 6>{2, 0, 0.25F, 0, 4, -3.125F}));
  info["extensions"]["KHR_texture_transform"]["texCoord"] = 1;
  const std::filesystem::path other = write_file("other.glb", maker.glb());
  EXPECT_THROW(load_material_texture(load_asset(other).materials, MaterialSlot::color), Error);
}

TEST(Gltf, SamplersSayWhatIsBeyondAPicture) {
  GltfMaker maker = painted_square();
  const auto color = [&] {
    const std::filesystem::path path = write_file("wraps.glb", maker.glb());
    return load_material_texture(load_asset(path).materials, MaterialSlot::color);
  };
  EXPECT_TRUE(color().wraps.empty());
  maker.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
  maker.json["textures"][0]["sampler"] = 0;
  EXPECT_EQ(color().wraps.at(0),
            (std::array<TextureWrap, 2>{TextureWrap::clamp, TextureWrap::mirror}));
  maker.json["samplers"][0]["wrapS"] = 1;
  const std::filesystem::path path = write_file("wraps.glb", maker.glb());
  EXPECT_THROW(load_asset(path), Error);
}

/// Maps are filtered linearly, whatever a sampler says.
TEST(Gltf, HardTexelsAreTold) {
  GltfMaker maker = painted_square();
  maker.json["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9728}}};
  maker.json["textures"][0]["sampler"] = 0;
  for (const bool nearest : {false, true}) {
    if (nearest) maker.json["samplers"][0]["magFilter"] = 9728;
    std::vector<Warning> warnings;
    load_asset(write_file("hard.glb", maker.glb()), {}, &warnings);
    const auto told = std::count_if(warnings.begin(), warnings.end(), [](const Warning& warning) {
      return warning.code == "nearest-filter";
    });
    EXPECT_EQ(told, nearest ? 1 : 0);
  }
}

TEST(Gltf, VertexColoursAreMultipliedWithTheBaseColour) {
  GltfMaker maker = painted_square();
  primitive_of(maker)["attributes"]["COLOR_0"] =
      maker.add<float>("VEC3", {0, 0, 0, 1, 1, 1, 1, 1, 1, 0, 0, 0});
  const std::filesystem::path path = write_file("tinted.glb", maker.glb());
  std::vector<Warning> warnings;
  const Asset asset = load_asset(path, {}, &warnings);
  for (const Warning& warning : warnings) EXPECT_EQ(warning.code, "flat-normals");
  const auto times = [&](MaterialSlot slot) {
    return load_material_texture(asset.materials, slot).times_vertex_colors;
  };
  EXPECT_EQ(times(MaterialSlot::color), std::vector<bool>{true});
  EXPECT_EQ(times(MaterialSlot::opacity), std::vector<bool>{true});
  EXPECT_TRUE(times(MaterialSlot::roughness).empty());
}

TEST(Gltf, LooksThatNoMapHoldsAreTold) {
  GltfMaker maker = painted_square();
  json& extensions = maker.json["materials"][0]["extensions"];
  extensions["KHR_materials_clearcoat"] = {{"clearcoatFactor", 1}};
  extensions["KHR_materials_unlit"] = json::object();
  maker.json["extensionsRequired"] = {"KHR_materials_clearcoat"};
  const std::filesystem::path path = write_file("coat.glb", maker.glb());
  std::vector<Warning> warnings;
  load_asset(path, {}, &warnings);
  const auto found = std::find_if(warnings.begin(), warnings.end(),
                                  [](const Warning& w) { return w.code == "material-extensions"; });
  ASSERT_NE(found, warnings.end());
  EXPECT_EQ(found->count, 2U);
  EXPECT_NE(found->message.text().find("KHR_materials_clearcoat (1), KHR_materials_unlit (1)"),
            std::string::npos)
      << found->message.text();
  maker.json["extensionsRequired"] = {"EXT_unheard_of"};
  expect_bad_text("unknown.glb", maker.glb(), {"EXT_unheard_of", "Export"});
}

TEST(Gltf, GlossinessBecomesRoughness) {
  GltfMaker maker = painted_square();
  json& material = maker.json["materials"][0];
  material.erase("pbrMetallicRoughness");
  material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {
      {"diffuseFactor", {0.5, 0.25, 1, 0.5}},
      {"diffuseTexture", {{"index", 0}}},
      {"glossinessFactor", 0.25},
      {"specularGlossinessTexture", {{"index", 0}}}};
  std::vector<Warning> warnings;
  const auto materials = [&] {
    return load_asset(write_file("glossy.glb", maker.glb()), {}, &warnings).materials;
  };
  // The picture's alpha is 0.8.
  const Texture map = load_material_texture(materials(), MaterialSlot::roughness);
  EXPECT_NEAR(held(map, 0), 1 - 0.25 * 0.8, 1e-6);
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                          [](const Warning& w) { return w.code == "glossiness-converted"; }));
  const Texture color = load_material_texture(materials(), MaterialSlot::color);
  EXPECT_NEAR(held(color, 0), 0.5 * from_srgb(0.2), 1e-6);
  const Texture opacity = load_material_texture(materials(), MaterialSlot::opacity);
  EXPECT_NEAR(held(opacity, 0), 0.5 * 0.8, 1e-6);
  material["extensions"]["KHR_materials_pbrSpecularGlossiness"].erase("specularGlossinessTexture");
  EXPECT_NEAR(load_material_texture(materials(), MaterialSlot::roughness).plain.at(0)[0], 0.75,
              1e-6);
}

#ifdef KILN_HAS_WEBP
TEST(Gltf, PicturesAsWebp) {
  const std::uint8_t red[3] = {255, 0, 0};
  std::uint8_t* data = nullptr;
  const std::size_t size = WebPEncodeLosslessRGB(red, 1, 1, 3, &data);
  const std::vector<std::uint8_t> webp(data, data + size);
  WebPFree(data);
  GltfMaker maker = painted_square();
  maker.json["images"].push_back(
      {{"bufferView", maker.add_view(webp)}, {"mimeType", "image/webp"}});
  maker.json["textures"][0]["extensions"]["EXT_texture_webp"] = {{"source", 1}};
  maker.json["extensionsRequired"] = {"EXT_texture_webp"};
  maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
  const std::filesystem::path path = write_file("webp.glb", maker.glb());
  const Texture color = load_material_texture(load_asset(path).materials, MaterialSlot::color);
  EXPECT_EQ(color.images.at(0)->width, 1U) << "the fallback has two";
  EXPECT_EQ(color.images.at(0)->pixels[0], 1);
  EXPECT_EQ(color.images.at(0)->pixels[1], 0);
}
#endif

TEST(Gltf, MissingPicturesLeaveTheFactor) {
  GltfMaker maker = painted_square();
  maker.json["images"][0] = {{"uri", "nowhere.png"}};
  const std::filesystem::path path = write_file("bare.glb", maker.glb());
  std::vector<Warning> warnings;
  const Asset asset = load_asset(path, {}, &warnings);
  EXPECT_TRUE(asset.materials[0].color_map.empty());
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                          [](const Warning& w) { return w.code == "picture-missing"; }));
}

TEST(Gltf, NothingOutsideTheFolderIsRead) {
  const GltfMaker maker = gltf_square();
  const std::filesystem::path folder = scratch_folder(), outside = folder / "outside.bin";
  std::filesystem::create_directories(folder / "inside");
  std::ofstream(outside, std::ios::binary) << maker.binary();
  for (const std::string& uri :
       {std::string("../outside.bin"), std::string("%2e%2e/outside.bin"),
        std::string("a/../../outside.bin"), std::string("..\\\\outside.bin"), outside.string(),
        "file://" + outside.string(), std::string("http://a/b.bin")}) {
    json text = maker.json;
    text["buffers"] = {{{"byteLength", maker.binary().size()}, {"uri", uri}}};
    std::ofstream(folder / "inside" / "a.gltf") << text.dump();
    mesh_files::expect_bad(folder / "inside" / "a.gltf", {"buffers[0].uri", "folder"});
  }
}

/// Packs a view of a square, as tools that shrink files do.
GltfMaker packed_square() {
  GltfMaker maker = gltf_square();
  const std::vector<float> positions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(4, 12));
  bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), positions.data(), 4, 12));
  const std::size_t view = maker.add_view(bytes);
  const json packed{{"buffer", 0},
                    {"byteOffset", maker.json["bufferViews"][view]["byteOffset"]},
                    {"byteLength", bytes.size()},
                    {"byteStride", 12},
                    {"count", 4},
                    {"mode", "ATTRIBUTES"}};
  // The fallback without the extension is of no use.
  maker.json["bufferViews"][0] = {{"buffer", 0},
                                  {"byteLength", 48},
                                  {"byteOffset", 8000},
                                  {"extensions", {{"EXT_meshopt_compression", packed}}}};
  const std::vector<unsigned> order{0, 1, 2, 0, 2, 3};
  bytes.resize(meshopt_encodeIndexBufferBound(6, 4));
  bytes.resize(meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), order.data(), 6));
  const std::size_t indices = maker.add_view(bytes);
  maker.json["bufferViews"][2] = {
      {"buffer", 0},
      {"byteLength", 12},
      {"extensions",
       {{"EXT_meshopt_compression",
         {{"buffer", 0},
          {"byteOffset", maker.json["bufferViews"][indices]["byteOffset"]},
          {"byteLength", bytes.size()},
          {"byteStride", 2},
          {"count", 6},
          {"mode", "TRIANGLES"}}}}}};
  maker.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  return maker;
}

/// A view of the file in which `packed` lies by meshopt's codec of vertices, with a filter to be undone.
template <typename T>
void pack_view(GltfMaker& maker, std::size_t view, const std::vector<T>& packed, std::size_t step,
               const char* filter) {
  const std::size_t count = packed.size() * sizeof(T) / step;
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(count, step));
  bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), packed.data(), count, step));
  const std::size_t from = maker.add_view(bytes);
  json extension{{"buffer", 0},
                 {"byteOffset", maker.json["bufferViews"][from]["byteOffset"]},
                 {"byteLength", bytes.size()},
                 {"byteStride", step},
                 {"count", count},
                 {"mode", "ATTRIBUTES"},
                 {"filter", filter}};
  maker.json["bufferViews"][view] = {{"buffer", 0},
                                     {"byteLength", count * step},
                                     {"byteStride", step},
                                     {"extensions", {{"EXT_meshopt_compression", extension}}}};
}

/// Values by the extension's own text, not by the library that undoes them.
TEST(Gltf, FiltersOfMeshopt) {
  // Exponential: 24 bits of mantissa below 8 of exponent, m * 2^e. 3 * 2^-2, -5 * 2^1, 0.
  const auto exponential = [](int mantissa, int exponent) {
    return static_cast<std::uint32_t>(exponent) << 24 |
           (static_cast<std::uint32_t>(mantissa) & 0xFFFFFFU);
  };
  GltfMaker maker = gltf_square();
  pack_view<std::uint32_t>(
      maker, 0,
      {exponential(0, 0), exponential(0, 0), exponential(0, 0), exponential(3, -2),
       exponential(0, 0), exponential(0, 0), exponential(3, -2), exponential(-5, 1),
       exponential(0, 0), exponential(0, 0), exponential(-5, 1), exponential(7, 0)},
      12, "EXPONENTIAL");
  const Mesh mesh = load_text("exponential.glb", maker.glb()).mesh;
  EXPECT_EQ(mesh.positions[1], (Vec3{0.75F, 0, 0}));
  EXPECT_EQ(mesh.positions[2], (Vec3{0.75F, -10, 0}));
  EXPECT_EQ(mesh.positions[3], (Vec3{0, -10, 7}));

  // Octahedral: x and y in units of the third number, which stands for 1; z = 1 - |x| - |y|, and what is below is
  // folded up; then made unit.
  const auto unit = [](double x, double y, double z) {
    const double size = std::sqrt(x * x + y * y + z * z);
    return std::array<double, 3>{x / size, y / size, z / size};
  };
  GltfMaker normals = gltf_square();
  const std::size_t accessor = normals.add<std::int8_t>(
      "VEC4", {0, 0, 127, 0, 64, 0, 127, 0, 64, -32, 127, 0, 127, 127, 127, 0}, true);
  normals.json["accessors"][accessor]["type"] = "VEC3";
  const std::size_t view = normals.json["accessors"][accessor]["bufferView"];
  pack_view<std::int8_t>(normals, view,
                         {0, 0, 127, 0, 64, 0, 127, 0, 64, -32, 127, 0, 127, 127, 127, 0}, 4,
                         "OCTAHEDRAL");
  primitive_of(normals)["attributes"]["NORMAL"] = accessor;
  const Mesh turned = load_text("octahedral.glb", normals.glb()).mesh;
  const double a = 64.0 / 127, b = -32.0 / 127;
  const std::array<double, 3> wanted[] = {
      {0, 0, 1}, unit(a, 0, 1 - a), unit(a, b, 1 - a + b), {0, 0, -1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3& n = turned.normals[turned.normal_triangles[i < 3 ? 0 : 1][i < 3 ? i : 2]];
    EXPECT_NEAR(n.x, wanted[i][0], 1.0 / 127) << i;  // rounded to a byte, then made unit
    EXPECT_NEAR(n.y, wanted[i][1], 1.0 / 127) << i;
    EXPECT_NEAR(n.z, wanted[i][2], 1.0 / 127) << i;
  }

  // Quaternion: three of four numbers over sqrt(2) in units of the last number's upper bits; its lower two say which
  // is left out, the largest. Read here as tangents, which take four numbers: (0, 0, sqrt(1/2), sqrt(1/2)) with w, the
  // last one, left out: 3 in the lower bits.
  GltfMaker tangents = gltf_square();
  const std::vector<std::int16_t> quaternion = {0, 0, 0x7FFC, 0x7FFF};
  std::vector<std::int16_t> four;
  for (int i = 0; i < 4; ++i) four.insert(four.end(), quaternion.begin(), quaternion.end());
  const std::size_t of_tangents = tangents.add<std::int16_t>("VEC4", four, true);
  pack_view<std::int16_t>(tangents, tangents.json["accessors"][of_tangents]["bufferView"], four, 8,
                          "QUATERNION");
  const std::size_t up = tangents.add<float>("VEC3", {1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0});
  primitive_of(tangents)["attributes"]["NORMAL"] = up;
  primitive_of(tangents)["attributes"]["TANGENT"] = of_tangents;
  const Mesh spun = load_text("quaternion.glb", tangents.glb()).mesh;
  ASSERT_EQ(spun.tangents.size(), 6U);
  EXPECT_NEAR(spun.tangents[0].direction.z, std::sqrt(0.5), 1e-4);
  EXPECT_NEAR(spun.tangents[0].sign, 1, 1e-4) << "any positive sign counts as 1";
}

#ifdef KILN_HAS_DRACO

/// Corners of a bent sheet of n by n squares: position and UV, and its triangles.
struct Sheet {
  std::vector<float> positions, uvs;
  std::vector<std::uint32_t> indices;

  explicit Sheet(std::uint32_t n) {
    for (std::uint32_t y = 0; y <= n; ++y) {
      for (std::uint32_t x = 0; x <= n; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(n);
        const float v = static_cast<float>(y) / static_cast<float>(n);
        positions.insert(positions.end(), {u, v, u * v});
        uvs.insert(uvs.end(), {u, 1 - v});
      }
    }
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 2, d = a + n + 1;
        indices.insert(indices.end(), {a, b, c, a, c, d});
      }
    }
  }

  std::vector<char> packed(draco::MeshEncoderMethod method) const {
    draco::Mesh mesh;
    const auto points = static_cast<std::uint32_t>(positions.size() / 3);
    mesh.set_num_points(points);
    const auto add = [&](draco::GeometryAttribute::Type type, std::int8_t width,
                         const std::vector<float>& values) {
      draco::GeometryAttribute attribute;
      attribute.Init(type, nullptr, width, draco::DT_FLOAT32, false,
                     static_cast<std::int64_t>(sizeof(float)) * width, 0);
      const int id = mesh.AddAttribute(attribute, true, points);
      for (std::uint32_t i = 0; i < points; ++i) {
        mesh.attribute(id)->SetAttributeValue(
            draco::AttributeValueIndex(i),
            &values[std::size_t{i} * static_cast<std::size_t>(width)]);
      }
    };
    add(draco::GeometryAttribute::POSITION, 3, positions);
    add(draco::GeometryAttribute::TEX_COORD, 2, uvs);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      mesh.AddFace({draco::PointIndex(indices[i]), draco::PointIndex(indices[i + 1]),
                    draco::PointIndex(indices[i + 2])});
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeMeshToBuffer(mesh, &buffer).ok()) throw std::runtime_error("not packed");
    return {buffer.data(), buffer.data() + buffer.size()};
  }

  /// \param data  packed; empty: none
  GltfMaker file(const std::vector<char>& data) const {
    GltfMaker maker;
    const std::size_t points = positions.size() / 3;
    if (data.empty()) {
      maker.add<float>("VEC3", positions);
      maker.add<float>("VEC2", uvs);
      maker.add<std::uint32_t>("SCALAR", indices);
    } else {
      maker.json["accessors"] = {
          {{"componentType", 5126}, {"count", points}, {"type", "VEC3"}},
          {{"componentType", 5126}, {"count", points}, {"type", "VEC2"}},
          {{"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}}};
      maker.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    }
    json primitive{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 2}};
    if (!data.empty()) {
      primitive["extensions"]["KHR_draco_mesh_compression"] = {
          {"bufferView", maker.add_view(data)},
          {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}};
    }
    maker.add_mesh(primitive);
    return maker;
  }
};

TEST(Gltf, PackedByDraco) {
  const Sheet sheet(5);
  const Mesh plain = load_text("plain.glb", sheet.file({}).glb()).mesh;
  // Corners of a triangle, from its least: Draco orders all anew.
  using Corner = std::array<float, 5>;
  const auto triangles = [](const Mesh& mesh) {
    std::vector<std::array<Corner, 3>> result;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      std::array<Corner, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = mesh.positions[mesh.triangles[t][k]];
        const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k]];
        corners[k] = {p.x, p.y, p.z, uv.x, uv.y};
      }
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      result.push_back(corners);
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  for (const auto method : {draco::MESH_EDGEBREAKER_ENCODING, draco::MESH_SEQUENTIAL_ENCODING}) {
    const std::vector<char> data = sheet.packed(method);
    const Mesh mesh = load_text("packed.glb", sheet.file(data).glb()).mesh;
    EXPECT_EQ(triangles(mesh), triangles(plain)) << method;
    // Cut short, it is an error or, of trailing bytes, the mesh.
    for (std::size_t size = 0; size < data.size(); ++size) {
      try {
        load_text("cut.glb",
                  sheet
                      .file({data.begin(), data.begin() + static_cast<std::ptrdiff_t>(
                                                              std::max<std::size_t>(size, 1))})
                      .glb());
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      }
    }
  }
}

TEST(Gltf, DracoThatLies) {
  const Sheet sheet(5);
  const std::vector<char> data = sheet.packed(draco::MESH_SEQUENTIAL_ENCODING);
  // Behind "DRACO", two bytes of version, type, method and two of flags: triangles, then vertices, seven bits a byte.
  ASSERT_EQ(data[11], 50);
  ASSERT_EQ(data[12], 36);
  std::vector<char> many = data;
  many.erase(many.begin() + 11);
  const unsigned char billion[] = {0x80, 0x94, 0xEB, 0xDC, 0x03};
  many.insert(many.begin() + 11, std::begin(billion), std::end(billion));
  expect_bad_text("many.glb", sheet.file(many).glb(),
                  {"KHR_draco_mesh_compression", "1000000000 triangles"});
  GltfMaker maker = sheet.file(data);
  json& extension = primitive_of(maker)["extensions"]["KHR_draco_mesh_compression"];
  extension["attributes"]["TEXCOORD_0"] = 7;
  expect_bad_text("number.glb", maker.glb(), {"accessors[1]", "no attribute 7"});
  extension["attributes"]["TEXCOORD_0"] = 0;
  expect_bad_text("width.glb", maker.glb(), {"accessors[1]", "3 numbers"});
  extension["attributes"] = {{"TEXCOORD_0", 1}};
  expect_bad_text("bare.glb", maker.glb(), {"positions"});
  extension["attributes"] = {{"POSITION", 0}};
  extension["bufferView"] = 5;
  expect_bad_text("view.glb", maker.glb(), {"bufferView"});
  std::vector<char> other = data;
  other[0] = 'X';
  expect_bad_text("other.glb", sheet.file(other).glb(), {"damaged"});
}

/// What an accessor of packed data says is not believed, and what its head says is summed up before any is unpacked.
TEST(Gltf, CountsOfDracoAreSummedUpFirst) {
  const Sheet sheet(5);
  const std::vector<char> data = sheet.packed(draco::MESH_SEQUENTIAL_ENCODING);
  const Mesh plain = load_text("plain.glb", sheet.file(data).glb()).mesh;
  for (const double count : {0.0, 9e15}) {
    GltfMaker maker = sheet.file(data);
    for (json& accessor : maker.json["accessors"]) accessor["count"] = count;
    EXPECT_EQ(load_text("lying.glb", maker.glb()).mesh.positions, plain.positions) << count;
  }
  // Used by several primitives, it is unpacked once; each has a mesh of its own.
  GltfMaker shared = sheet.file(data);
  shared.json["meshes"][0]["primitives"].push_back(primitive_of(shared));
  EXPECT_EQ(load_text("shared.glb", shared.glb()).mesh.triangles.size(),
            2 * plain.triangles.size());
  // 60,000 triangles each that are not there, as often as primitives name them.
  std::vector<char> many = data;
  many.erase(many.begin() + 11);
  const unsigned char thousands[] = {0xE0, 0xD4, 0x03};
  many.insert(many.begin() + 11, std::begin(thousands), std::end(thousands));
  GltfMaker maker = sheet.file(many);
  const json primitive = primitive_of(maker);
  for (int i = 1; i < 3000; ++i) maker.json["meshes"][0]["primitives"].push_back(primitive);
  set_memory_limit(memory_limit() - memory_left() + (std::uint64_t{1} << 30));
  expect_bad_text("sums.glb", maker.glb(), {"its meshes", "memory"});
  set_memory_limit(0);
}

#endif

TEST(Gltf, PackedByMeshopt) {
  const Mesh mesh = load_text("packed.glb", packed_square().glb()).mesh;
  EXPECT_EQ(mesh.positions, load_text("plain.glb", gltf_square().glb()).mesh.positions);
  for (std::size_t t = 0; t < 2; ++t) EXPECT_EQ(face_normal(mesh, t).z, 1);
  const auto bad = [](const char* key, const json& value) {
    GltfMaker maker = packed_square();
    maker.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
    expect_bad_text("bad.glb", maker.glb(), {"bufferViews[0].extensions.EXT_meshopt_compression"});
  };
  bad("count", 5);
  bad("count", 1e12);
  bad("byteStride", 13);
  bad("byteStride", 0);
  bad("byteLength", 9);
  bad("byteLength", 1e6);
  bad("mode", "INDICES");
  bad("mode", "OTHER");
  bad("filter", "QUATERNION");
}

TEST(Gltf, FilesThatLie) {
  const auto bad = [](const std::vector<std::string>& words, const auto& change) {
    GltfMaker maker = gltf_square();
    change(maker.json);
    expect_bad_text("bad.glb", maker.glb(), words);
  };
  bad({"accessors[0]", "bufferViews[0]"}, [](json& j) { j["accessors"][0]["count"] = 5; });
  bad({"accessors[0]"}, [](json& j) { j["accessors"][0]["count"] = 1e15; });
  bad({"accessors[0]"}, [](json& j) { j["accessors"][0]["byteOffset"] = 9e15; });
  bad({"accessors[0]", "without a bufferView"}, [](json& j) {
    j["accessors"][0].erase("bufferView");
    j["accessors"][0]["count"] = 1e12;
    j["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  });
  bad({"accessors[0].count"}, [](json& j) { j["accessors"][0]["count"] = -1; });
  bad({"accessors[0].count"}, [](json& j) { j["accessors"][0]["count"] = "4"; });
  bad({"accessors[0]", "type"}, [](json& j) { j["accessors"][0]["componentType"] = 5124; });
  bad({"accessors[0]"}, [](json& j) { j["accessors"][0]["type"] = "MAT4"; });
  bad({"accessors[0]", "VEC3"}, [](json& j) { j["accessors"][0]["type"] = "MAT2"; });
  bad({"POSITION", "9"},
      [](json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9; });
  bad({"TEXCOORD_0", "positions"}, [](json& j) { j["accessors"][1]["count"] = 3; });
  bad({"bufferViews[0]"}, [](json& j) { j["bufferViews"][0]["byteLength"] = 1000; });
  bad({"bufferViews[0]"}, [](json& j) { j["bufferViews"][0]["byteOffset"] = 1e15; });
  bad({"bufferViews[0].buffer"}, [](json& j) { j["bufferViews"][0]["buffer"] = 3; });
  bad({"buffers[0]", "truncated"}, [](json& j) { j["buffers"] = {{{"byteLength", 100000}}}; });
  bad({"nodes[0].mesh"}, [](json& j) { j["nodes"][0]["mesh"] = 4; });
  bad({"nodes", "own ancestor"}, [](json& j) {
    j["nodes"].push_back({{"children", {2}}});
    j["nodes"].push_back({{"children", {1}}});
  });
  bad({"children", "already"}, [](json& j) {
    j["nodes"].push_back({{"children", {0}}});
    j["nodes"].push_back({{"children", {0}}});
  });
  bad({"nodes[0].rotation"}, [](json& j) { j["nodes"][0]["rotation"] = {0, 0, 0, 0}; });
  bad({"nodes[0].scale", "3"}, [](json& j) { j["nodes"][0]["scale"] = {1, 1}; });
  bad({"asset", "2.0"}, [](json& j) { j["asset"]["version"] = "1.0"; });
#ifndef KILN_HAS_DRACO
  bad({"KHR_draco_mesh_compression", "compression"},
      [](json& j) { j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
#endif
  GltfMaker index = gltf_square();
  primitive_of(index)["indices"] = index.add<std::uint16_t>("SCALAR", {0, 1, 4});
  expect_bad_text("index.glb", index.glb(), {"accessors[3]", "4 vertices"});
}

TEST(Gltf, EveryTruncationIsRefused) {
  const std::string whole = painted_square().glb();
  for (std::size_t size = 0; size < whole.size(); size += size < 40 ? 1 : 13) {
    const std::filesystem::path path = write_file("cut.glb", whole.substr(0, size));
    EXPECT_THROW(load_mesh(path), Error) << size;
    // The same with a header that agrees.
    std::string lying = whole.substr(0, size);
    if (size < 12) continue;
    const auto length = static_cast<std::uint32_t>(size);
    std::memcpy(lying.data() + 8, &length, 4);
    try {
      load_mesh(write_file("lying.glb", lying));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
    }
  }
}

}  // namespace
}  // namespace kiln::test
