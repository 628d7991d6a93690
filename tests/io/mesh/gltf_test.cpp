// glTF: what each part of the format gives, and files that lie.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cmath>
#include <fstream>
#include <map>

#include "io/mesh/gltf_files.h"
#include "io/mesh/mesh_files.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "support/environment.h"

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
  const auto first = [&](MaterialSlot slot) {
    return load_material_texture(materials, slot).images.at(0)->pixels;
  };
  // The bytes are multiples of 51: exact in PNG.
  EXPECT_NEAR(first(MaterialSlot::roughness)[0], 0.4 * 0.5, 1e-6);
  EXPECT_NEAR(first(MaterialSlot::metallic)[0], 0.6, 1e-6);
  EXPECT_NEAR(first(MaterialSlot::opacity)[0], 0.8 * 0.5, 1e-6);
  const std::vector<float> color = first(MaterialSlot::color);
  EXPECT_NEAR(color[0], 0.2, 1e-6);
  // Half of sRGB 0.4 in linear light: 0.132868 / 2, which is sRGB 0.28592.
  EXPECT_NEAR(color[1], 1.055 * std::pow(std::pow((0.4 + 0.055) / 1.055, 2.4) / 2, 1 / 2.4) - 0.055,
              1e-6);
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
  const std::vector<float> n =
      load_material_texture(load_asset(path).materials, MaterialSlot::normal).images.at(0)->pixels;
  // (-0.6, -0.2, 0.2) becomes (-1.2, -0.4, 0.2), of length sqrt(1.64).
  EXPECT_NEAR(n[0], -1.2 / std::sqrt(1.64) / 2 + 0.5, 1e-6);
  EXPECT_NEAR(n[1], -0.4 / std::sqrt(1.64) / 2 + 0.5, 1e-6);
  EXPECT_NEAR(n[2], 0.2 / std::sqrt(1.64) / 2 + 0.5, 1e-6);
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

TEST(Gltf, PicturesThatDoNotRepeatAreTold) {
  GltfMaker maker = painted_square();
  maker.json["samplers"] = {{{"wrapS", 33071}}};
  maker.json["textures"][0]["sampler"] = 0;
  EXPECT_EQ(load_text("inside.glb", maker.glb()).count("texture-wrap"), 0U);
  maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]
            ["KHR_texture_transform"] = {{"offset", {0.25, 0}}};
  EXPECT_EQ(load_text("beyond.glb", maker.glb()).count("texture-wrap"), 1U);
}

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
  // What is there without the extension is of no use.
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
  bad({"accessors[0]", "VEC3"}, [](json& j) { j["accessors"][0]["type"] = "MAT4"; });
  bad({"POSITION", "9"},
      [](json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9; });
  bad({"TEXCOORD_0", "positions"}, [](json& j) { j["accessors"][1]["count"] = 3; });
  bad({"bufferViews[0]"}, [](json& j) { j["bufferViews"][0]["byteLength"] = 1000; });
  bad({"bufferViews[0]"}, [](json& j) { j["bufferViews"][0]["byteOffset"] = 1e15; });
  bad({"bufferViews[0].buffer"}, [](json& j) { j["bufferViews"][0]["buffer"] = 3; });
  bad({"buffers[0]", "truncated"}, [](json& j) { j["buffers"] = {{{"byteLength", 100000}}}; });
  bad({"nodes[0].mesh"}, [](json& j) { j["nodes"][0]["mesh"] = 4; });
  bad({"nodes", "ancestors"}, [](json& j) {
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
  bad({"KHR_draco_mesh_compression", "compression"},
      [](json& j) { j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
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
