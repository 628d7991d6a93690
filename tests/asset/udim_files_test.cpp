// UDIM sets: names of files, and when a number is one.
#include "asset/udim_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "asset/gltf.h"
#include "kiln/image.h"
#include "kiln/material.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

void save(const fs::path& file, std::vector<float> texel, std::uint32_t side = 2) {
  Image image{side, side, static_cast<std::uint32_t>(texel.size()), {}};
  for (std::uint32_t i = 0; i < side * side; ++i) {
    image.pixels.insert(image.pixels.end(), texel.begin(), texel.end());
  }
  save_image(image, file, {.format = ImageFormat::png8});
}

TEST(TileName, FindsTokensAndNumbers) {
  const auto token = [](const char* name) {
    const auto found = TileName::parse_token(name);
    return found ? found->file_of(1012).string() : "none";
  };
  EXPECT_EQ(token("a/u.<UDIM>.png"), "a/u.1012.png");
  EXPECT_EQ(token("u_<udim>_c.png"), "u_1012_c.png");
  EXPECT_EQ(token("u.<UVTILE>.png"), "u.u2_v2.png");
  EXPECT_EQ(token("u.%(UDIM)d.exr"), "u.1012.exr");
  EXPECT_EQ(token("u.1001.png"), "none");
  EXPECT_EQ(token("<UDIM>/u.png"), "none");
  const auto number = [](const char* name) {
    const auto found = TileName::parse_number(name);
    return found ? std::to_string(found->number()) + " " + found->file_of(1002).string() : "none";
  };
  EXPECT_EQ(number("a/u.1001.png"), "1001 a/u.1002.png");
  EXPECT_EQ(number("u_1011_2048.png"), "1011 u_1002_2048.png");
  EXPECT_EQ(number("u1001.png"), "1001 u1002.png");
  EXPECT_EQ(number("skin_u1_v2.png"), "1011 skin_u2_v1.png");
  EXPECT_EQ(number("u2_v1_color.png"), "1002 u2_v1_color.png");
  EXPECT_EQ(number("menu1_v2.png"), "none");
  EXPECT_EQ(number("u0_v1.png"), "none");
  // Ten columns a row: u11_v1 is no tile, and not the one above u1_v1.
  EXPECT_EQ(number("skin_u10_v2.png"), "1020 skin_u2_v1.png");
  EXPECT_EQ(number("skin_u11_v1.png"), "none");
  EXPECT_EQ(number("skin_u12_v3.png"), "none");
  EXPECT_EQ(number("u.11001.png"), "none");
  EXPECT_EQ(number("u.2048.png"), "none");
  EXPECT_EQ(number("u.1000.png"), "none");
}

/// Quads beside each other, quad i over the square (columns[i], 0), each with a material of its own where that is asked for.
Mesh quads(const std::vector<float>& columns, const std::vector<std::uint32_t>& materials = {}) {
  Mesh mesh;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto x = static_cast<float>(i), u = columns[i];
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [dx, dy] : {std::pair(0.0F, 0.0F), {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}}) {
      mesh.positions.push_back({x + dx, dy, 0});
      mesh.uvs.push_back({u + dx, dy});
    }
    for (const auto& t :
         {Triangle{first, first + 1, first + 2}, Triangle{first, first + 2, first + 3}}) {
      mesh.triangles.push_back(t);
      mesh.uv_triangles.push_back(t);
      mesh.materials.push_back(materials.empty() ? 0 : materials[i]);
    }
  }
  return mesh;
}

Material material_of(const fs::path& picture) {
  Material material;
  material.name = "m";
  material.color_map.file = picture;
  return material;
}

struct Loaded {
  Texture texture;
  std::vector<Warning> warnings;
  std::vector<std::uint32_t> tiles() const {
    std::vector<std::uint32_t> numbers;
    for (const TextureTile& tile : texture.tiles) numbers.push_back(tile.tile);
    return numbers;
  }
};
Loaded load(const std::vector<Material>& materials, const Mesh& mesh) {
  Loaded loaded;
  loaded.texture = load_material_texture(materials, MaterialSlot::color, mesh, &loaded.warnings);
  return loaded;
}
using Tiles = std::vector<std::uint32_t>;

TEST(UdimFiles, ATokenLoadsTheTilesThatTheMeshUses) {
  const fs::path folder = test::scratch_folder();
  for (const char* number : {"1001", "1002", "1003", "1011"}) {
    save(folder / ("u." + std::string(number) + ".png"), {1, 0, 0});
  }
  const Loaded two = load({material_of(folder / "u.<UDIM>.png")}, quads({0, 1}));
  EXPECT_EQ(two.tiles(), (Tiles{1001, 1002}));
  EXPECT_EQ(two.texture.image_of[0], two.texture.tiles[0].set);
  EXPECT_EQ(two.texture.images.size(), 2U);
  EXPECT_TRUE(two.warnings.empty());
  EXPECT_EQ(load({material_of(folder / "u.<UDIM>.png")}, quads({2})).tiles(), (Tiles{1003}));
  // Without a mesh, or none of its tiles: all that there are.
  const Tiles all{1001, 1002, 1003, 1011};
  EXPECT_EQ(load({material_of(folder / "u.<UDIM>.png")}, quads({7})).tiles(), all);
  Loaded without;
  without.texture =
      load_material_texture({material_of(folder / "u.<UDIM>.png")}, MaterialSlot::color);
  EXPECT_EQ(without.tiles(), all);
  EXPECT_FALSE(is_picture_file(folder / "v.<UDIM>.png"));
  EXPECT_TRUE(is_picture_file(folder / "u.<UDIM>.png"));
  // Two materials with other squares of one set.
  const Loaded both =
      load({material_of(folder / "u.<UDIM>.png"), material_of(folder / "u.<UDIM>.png")},
           quads({0, 1, 2}, {0, 1, 1}));
  EXPECT_EQ(both.tiles(), (Tiles{1001, 1002, 1003}));
  EXPECT_NE(both.texture.image_of[0], both.texture.image_of[1]);
  // A picture of another set of UVs: its own tiles count, not those of the mesh's first set.
  Mesh sets = quads({0, 1});
  sets.other_uvs = {{3, quads({2, 2}).uvs}};
  Material other = material_of(folder / "u.<UDIM>.png");
  other.color_map.uv_set = 3;
  EXPECT_EQ(load({other}, sets).tiles(), (Tiles{1003}));
  EXPECT_EQ(load({material_of(folder / "u.<UDIM>.png")}, sets).tiles(), (Tiles{1001, 1002}));
  // None of them is there.
  std::vector<Warning> warnings;
  Material gone = material_of(folder / "gone.<UDIM>.png");
  gone.color_from = MaterialNumber::given;
  EXPECT_TRUE(load_material_texture({gone}, MaterialSlot::color, &warnings).images.empty());
  EXPECT_EQ(warnings.at(0).code, "picture-missing");
}

TEST(UdimFiles, ANumberIsATileWhereUvsReachItsSiblings) {
  const fs::path folder = test::scratch_folder();
  for (const char* number : {"1001", "1002"}) {
    save(folder / ("u." + std::string(number) + ".png"), {1, 0, 0});
  }
  const std::vector<Material> materials = {material_of(folder / "u.1001.png")};
  const Loaded set = load(materials, quads({0, 1}));
  EXPECT_EQ(set.tiles(), (Tiles{1001, 1002}));
  ASSERT_EQ(set.warnings.size(), 1U);
  EXPECT_EQ(set.warnings[0].code, "udim-siblings");
  EXPECT_NE(set.warnings[0].message.text().find("u.<UDIM>.png"), std::string::npos);
  // Within the first square it is a picture by itself, and nothing is to be said.
  const Loaded alone = load(materials, quads({0}));
  EXPECT_TRUE(alone.tiles().empty());
  EXPECT_TRUE(alone.warnings.empty());
  // Most squares have no file: a number of something else. It repeats, and that is said.
  const Loaded tiled = load(materials, quads({0, 1, 2, 3, 4}));
  EXPECT_TRUE(tiled.tiles().empty());
  ASSERT_EQ(tiled.warnings.size(), 1U);
  EXPECT_NE(tiled.warnings[0].message.text().find("is repeated"), std::string::npos);
  // No sibling at all: it repeats, as ever.
  fs::remove(folder / "u.1002.png");
  const Loaded without = load(materials, quads({0, 1}));
  EXPECT_TRUE(without.tiles().empty());
  EXPECT_TRUE(without.warnings.empty());
}

TEST(UdimFiles, PicturesThatOtherMaterialsNameAreNoSiblings) {
  const fs::path folder = test::scratch_folder();
  save(folder / "u.1001.png", {1, 0, 0});
  save(folder / "u.1002.png", {0, 1, 0});
  const std::vector<Material> both = {material_of(folder / "u.1001.png"),
                                      material_of(folder / "u.1002.png")};
  const Loaded loaded = load(both, quads({0, 1, 0}, {0, 0, 1}));
  EXPECT_TRUE(loaded.tiles().empty());
  EXPECT_EQ(loaded.texture.image_of, (std::vector<std::uint32_t>{0, 1}));
  ASSERT_FALSE(loaded.warnings.empty());
  EXPECT_NE(loaded.warnings[0].message.text().find("other materials"), std::string::npos);
  // Pictures a material, each over its own square, as photogrammetry has them: nothing is to be said.
  const Loaded own = load(both, quads({0, 1}, {0, 1}));
  EXPECT_TRUE(own.warnings.empty());
  EXPECT_EQ(own.texture.image_of, (std::vector<std::uint32_t>{0, 1}));
}

TEST(UdimFiles, MtlAndGltfNameThem) {
  const fs::path folder = test::scratch_folder();
  fs::create_directory(folder / "maps");
  save(folder / "maps" / "u.1001.png", {1, 0, 0});
  save(folder / "maps" / "u.1002.png", {0, 1, 0}, 4);
  std::ofstream(folder / "a.mtl") << "newmtl m\nmap_Kd C:\\old\\u.<UDIM>.png\n";
  std::ofstream(folder / "a.obj")
      << "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 1.1 0.1\nvt 1.9 0.1\nvt 1.1 0.9\nusemtl m\n"
         "f 1/1 2/2 3/3\n";
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(folder / "a.obj");
  const auto materials = load_materials(mesh, folder / "a.obj", &warnings);
  ASSERT_FALSE(warnings.empty());
  EXPECT_EQ(warnings[0].code, "found-elsewhere");
  const Texture texture = load_material_texture(materials, MaterialSlot::color, mesh, &warnings);
  ASSERT_EQ(texture.tiles.size(), 1U);
  EXPECT_EQ(texture.tiles[0].tile, 1002U);
  EXPECT_EQ(texture.images[0]->width, 4U);
  const std::string gltf =
      R"({"asset": {"version": "2.0"}, "images": [{"uri": "maps/u.%3CUDIM%3E.png"}],
         "textures": [{"source": 0}], "materials": [{"name": "m",
         "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]})";
  std::vector<Warning> said;
  MeshInput input{(folder / "a.gltf").string(), gltf, &said};
  input.folder = folder;
  const auto from_gltf = read_gltf_materials(input);
  EXPECT_EQ(from_gltf.at(0).color_map.file.filename(), "u.<UDIM>.png");
  EXPECT_TRUE(said.empty());
}

TEST(UdimFiles, APictureByItselfMayBeASet) {
  const fs::path folder = test::scratch_folder();
  save(folder / "u.u1_v1.png", {1, 0, 0});
  save(folder / "u.u2_v1.png", {0, 1, 0});
  const Mesh mesh = quads({0, 1});
  std::vector<Warning> warnings;
  EXPECT_EQ(load_texture(folder / "u.<UVTILE>.png", &mesh, &warnings).tiles.size(), 2U);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(load_texture(folder / "u.u1_v1.png", &mesh, &warnings).tiles.size(), 2U);
  EXPECT_EQ(warnings.at(0).code, "udim-siblings");
  EXPECT_TRUE(load_texture(folder / "u.u1_v1.png").tiles.empty());
  EXPECT_THROW(load_texture(folder / "v.<UVTILE>.png", &mesh), Error);
}

// Alpha weighs colours where it is opacity, and nowhere else.
TEST(MaterialAlpha, WeighsColoursWhereItIsOpacity) {
  const fs::path folder = test::scratch_folder();
  save(folder / "a.png", {1, 0, 0, 0.5F});
  save(folder / "d.png", {1, 0, 0});
  const auto weighs = [&](const Material& material) {
    return !load_material_texture({material}, MaterialSlot::color).weighted_by_alpha.empty();
  };
  Material mtl = material_of(folder / "a.png");
  EXPECT_TRUE(weighs(mtl));
  mtl.opacity_map.file = folder / "a.png";
  EXPECT_TRUE(weighs(mtl));
  mtl.opacity_map.file = folder / "d.png";  // map_d
  EXPECT_FALSE(weighs(mtl));
  Material gltf = material_of(folder / "a.png");
  gltf.multiplies = true;
  gltf.color_from = MaterialNumber::given;
  gltf.alpha_mode = AlphaMode::opaque;
  EXPECT_FALSE(weighs(gltf));
  gltf.alpha_mode = AlphaMode::blend;
  gltf.opacity_map = gltf.color_map;
  gltf.opacity_map.channel = 3;
  EXPECT_TRUE(weighs(gltf));
  gltf.alpha_mode = AlphaMode::mask;
  EXPECT_TRUE(weighs(gltf));
  // One picture of two materials, opaque and not, is read once and weighed once.
  Material opaque = gltf;
  opaque.alpha_mode = AlphaMode::opaque;
  opaque.opacity_map = {};
  const Texture both = load_material_texture({gltf, opaque}, MaterialSlot::color);
  ASSERT_EQ(both.images.size(), 2U);
  EXPECT_EQ(both.images[0], both.images[1]);
  EXPECT_EQ(both.weighted_by_alpha, (std::vector<bool>{true, false}));
}

}  // namespace
}  // namespace kiln
