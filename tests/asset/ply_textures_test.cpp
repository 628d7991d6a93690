// Pictures of PLY files: "comment TextureFile", UVs of corners, "texnumber".
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "asset/mesh_files.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/material.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::mesh_files::load;
using test::mesh_files::load_text;
using test::mesh_files::Loaded;
using test::mesh_files::PlyText;
using test::mesh_files::write_file;
using Names = std::vector<std::string>;

const std::string kVertices =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFaces =
    "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n";
const std::string kTwoPictures = "comment TextureFile tex_0.png\ncomment TextureFile tex 1.png\n";

void put_square(PlyText& ply) {
  for (const float value : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 1.F, 1.F, 0.F, 0.F, 1.F, 0.F}) {
    ply.put(value);
  }
}

/// A square of two triangles. \param uvs  six numbers a triangle, or none
void put_face(PlyText& ply, const std::array<std::int32_t, 3>& corners,
              const std::vector<float>& uvs) {
  ply.put(std::uint8_t{3});
  for (const std::int32_t corner : corners) ply.put(corner);
  ply.put(static_cast<std::uint8_t>(uvs.size()));
  for (const float uv : uvs) ply.put(uv);
}

const std::vector<float> kLower{0, 0, 1, 0, 1, 1}, kUpper{0.25F, 0, 1, 1, 0, 1};

/// The square with a number of a picture for each triangle.
std::string numbered(const std::string& encoding, const std::string& pictures, int first,
                     int second) {
  PlyText ply(encoding, pictures + kVertices + kFaces + "property int texnumber\n");
  put_square(ply);
  put_face(ply, {0, 1, 2}, kLower);
  ply.put(std::int32_t{first});
  put_face(ply, {0, 2, 3}, kUpper);
  ply.put(std::int32_t{second});
  return ply.text();
}

TEST(PlyTextures, EachIsAMaterialInEveryEncoding) {
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(encoding);
    const Loaded loaded = load_text("scan.ply", numbered(encoding, kTwoPictures, 1, 0));
    EXPECT_TRUE(loaded.warnings.empty());
    EXPECT_EQ(loaded.mesh.material_names, (Names{"tex 1", "tex_0"}));
    EXPECT_EQ(loaded.mesh.materials, (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(loaded.mesh.material_files, Names{"scan.ply"});
    ASSERT_EQ(loaded.mesh.uv_triangles.size(), 2U);
    for (std::size_t t = 0; t < 2; ++t) {
      const std::vector<float>& wanted = t == 0 ? kLower : kUpper;
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(loaded.mesh.uvs[loaded.mesh.uv_triangles[t][k]],
                  (Vec2{wanted[2 * k], wanted[2 * k + 1]}));
      }
    }
  }
}

TEST(PlyTextures, PicturesAreFoundAsThoseOfMaterials) {
  const fs::path path = write_file("scan.ply", numbered("ascii", kTwoPictures, 1, 0));
  const fs::path folder = path.parent_path();
  fs::create_directory(folder / "maps");
  save_image({1, 1, 3, {1, 0, 0}}, folder / "maps" / "tex 1.png", {.format = ImageFormat::png8});
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(path);
  const std::vector<Material> materials = load_materials(mesh, path, &warnings);
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].name, "tex 1");
  EXPECT_EQ(materials[0].color_map.file, folder / "maps" / "tex 1.png");
  EXPECT_EQ(materials[1].color_map.file, folder / "tex_0.png");
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "found-elsewhere");
  warnings.clear();
  const Texture texture = load_material_texture(materials, MaterialSlot::color, &warnings);
  EXPECT_EQ(texture.image_of, (std::vector<std::uint32_t>{0, Texture::kNone}));
  ASSERT_FALSE(warnings.empty());
  EXPECT_EQ(warnings.back().code, "picture-missing");
  EXPECT_EQ(warnings.back().count, 1U);
  EXPECT_NE(warnings.back().message.text().find("tex_0.png"), std::string::npos);
  // As an asset it has its materials at once.
  EXPECT_EQ(load_asset(path).materials.size(), 2U);
}

/// Files written on Windows separate folders by backslashes: the picture is found in its folder, and not the one of
/// the same name beside the mesh.
TEST(PlyTextures, BackslashesSeparateFolders) {
  const fs::path path =
      write_file("scan.ply", numbered("ascii",
                                      "comment TextureFile \"textures\\skin\\a.png\"\n"
                                      "comment TextureFile b.png\n",
                                      0, 1));
  const fs::path folder = path.parent_path();
  fs::create_directories(folder / "textures" / "skin");
  const SaveImageOptions png = {.format = ImageFormat::png8};
  save_image({1, 1, 3, {1, 0, 0}}, folder / "textures" / "skin" / "a.png", png);
  save_image({1, 1, 3, {0, 1, 0}}, folder / "a.png", png);
  save_image({1, 1, 3, {0, 0, 1}}, folder / "b.png", png);
  std::vector<Warning> warnings;
  const std::vector<Material> materials = load_materials(load_mesh(path), path, &warnings);
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].color_map.file, folder / "textures" / "skin" / "a.png");
  EXPECT_EQ(load_image(materials[0].color_map.file).pixels, (std::vector<float>{1, 0, 0}));
  EXPECT_EQ(materials[1].color_map.file, folder / "b.png");
}

TEST(PlyTextures, NamesAreAsProgramsWriteThem) {
  const auto names = [](const std::string& pictures) {
    std::string text = numbered("ascii", pictures, 0, 1);
    return load_text("scan.ply", text).mesh.material_names;
  };
  EXPECT_EQ(names("comment TextureFile a.jpg \ncomment\tTEXTUREFILE\t\"b c.png\"\n"),
            (Names{"a", "b c"}));
  EXPECT_EQ(names("comment TextureFile maps\\a.jpg\ncomment TextureFile /home/me/b.jpg\n"),
            (Names{"a", "b"}));
  // Of the same name in two folders: two materials. Named twice, it is one.
  EXPECT_EQ(names("comment TextureFile u/a.jpg\ncomment TextureFile v/a.jpg\n"),
            (Names{"u/a.jpg", "v/a.jpg"}));
  EXPECT_EQ(names("comment TextureFile a.jpg\ncomment TextureFile a.jpg\n"), Names{"a"});
  EXPECT_EQ(names("comment TextureFiles\ncomment TextureFile\ncomment a TextureFile b\n"), Names{});
}

TEST(PlyTextures, NumbersOfNoPictureAreCounted) {
  const Loaded loaded = load_text("scan.ply", numbered("ascii", kTwoPictures, 2, -1));
  EXPECT_EQ(loaded.count("texture-numbers"), 2U);
  EXPECT_EQ(loaded.mesh.material_names, Names{"untextured"});
  const fs::path path = write_file("scan.ply", numbered("ascii", kTwoPictures, 1, 7));
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(path, &warnings);
  EXPECT_EQ(warnings.size(), 1U);
  warnings.clear();
  const std::vector<Material> materials = load_materials(mesh, path, &warnings);
  EXPECT_TRUE(warnings.empty());
  EXPECT_TRUE(materials[1].color_map.empty());
  // Without pictures, numbers say nothing.
  const Loaded none = load_text("scan.ply", numbered("ascii", "", 2, -1));
  EXPECT_TRUE(none.warnings.empty());
  EXPECT_TRUE(none.mesh.material_names.empty());
  EXPECT_TRUE(none.mesh.material_files.empty());
}

// Where no picture is, the colours of faces or vertices are the surface's.
TEST(PlyTextures, FacesWithoutOneKeepTheirColours) {
  const std::string rgb = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  for (const std::string of : {"", "vertex", "face"}) {
    SCOPED_TRACE(of);
    PlyText ply("ascii", "comment TextureFile tex_0.png\n" + kVertices +
                             (of == "vertex" ? rgb : "") + kFaces + "property int texnumber\n" +
                             (of == "face" ? rgb : ""));
    const auto color = [&](const char* element, int red) {
      if (of == element) ply.put(std::uint8_t(red)).put(std::uint8_t{128}).put(std::uint8_t{9});
    };
    for (int v = 0; v < 4; ++v) {
      ply.put(v == 1 || v == 2 ? 1.F : 0.F).put(v > 1 ? 1.F : 0.F).put(0.F);
      color("vertex", 10 + v);
    }
    put_face(ply, {0, 1, 2}, kLower);
    ply.put(std::int32_t{0});
    color("face", 20);
    put_face(ply, {0, 2, 3}, kUpper);
    ply.put(std::int32_t{-1});
    color("face", 30);
    const fs::path path = write_file("scan.ply", ply.text());
    save_image({1, 1, 3, {1, 0, 0}}, path.parent_path() / "tex_0.png",
               {.format = ImageFormat::png8});
    std::vector<Warning> warnings;
    const Mesh mesh = load_mesh(path, &warnings);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].message.text().find("colours of faces") != std::string::npos,
              !of.empty());
    warnings.clear();
    const std::vector<Material> materials = load_materials(mesh, path, &warnings);
    ASSERT_EQ(materials.size(), 2U);
    const Texture texture = load_material_texture(materials, MaterialSlot::color, mesh, &warnings);
    EXPECT_EQ(texture.image_of, (std::vector<std::uint32_t>{0, Texture::kNone}));
    EXPECT_EQ(texture.plain[1], (std::array<float, 4>{1, 1, 1, 1}));
    if (of.empty()) {
      EXPECT_TRUE(texture.times_vertex_colors.empty());
      EXPECT_EQ(warnings.size(), 1U) << "no colour is known there";
      continue;
    }
    EXPECT_EQ(texture.times_vertex_colors, (std::vector<bool>{false, true}));
    EXPECT_TRUE(warnings.empty());
    const std::uint32_t corner = mesh.triangles[1][2];
    EXPECT_EQ(mesh.colors[corner][0], of == "face" ? 30 : 13);
    const Texture opacity = load_material_texture(materials, MaterialSlot::opacity, mesh);
    EXPECT_TRUE(opacity.times_vertex_colors.empty());
    EXPECT_EQ(opacity.channel, 3U) << "the pictures' alpha, as without colours";
  }
}

TEST(PlyTextures, SeveralWithoutNumbersAreSaid) {
  PlyText ply("ascii", kTwoPictures + kVertices + kFaces);
  put_square(ply);
  put_face(ply, {0, 1, 2}, kLower);
  put_face(ply, {0, 2, 3}, kUpper);
  const Loaded loaded = load_text("scan.ply", ply.text());
  EXPECT_EQ(loaded.count("texture-numbers"), 1U);
  EXPECT_EQ(loaded.mesh.material_names, Names{"tex_0"});
}

TEST(PlyTextures, UvsOfVerticesDoAsWell) {
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    PlyText ply(encoding,
                "comment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty "
                "float y\nproperty float z\nproperty float texture_u\nproperty float "
                "texture_v\nelement face 1\nproperty list uchar int vertex_indices\n");
    for (const float value :
         {0.F, 0.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 1.F, 0.F, 0.F, 1.F, 0.F, 0.F, 1.F}) {
      ply.put(value);
    }
    ply.put(std::uint8_t{3}).put(0).put(1).put(2);
    const Loaded loaded = load_text("scan.ply", ply.text());
    EXPECT_TRUE(loaded.warnings.empty());
    EXPECT_EQ(loaded.mesh.material_names, Names{"a"}) << encoding;
    EXPECT_EQ(loaded.mesh.materials, std::vector<std::uint32_t>{0}) << encoding;
    EXPECT_EQ(loaded.mesh.uvs[loaded.mesh.uv_triangles[0][1]], (Vec2{1, 0}));
  }
}

TEST(PlyTextures, WithoutUvsTheyAreNotRead) {
  PlyText ply("ascii", kTwoPictures + kVertices + kFaces);
  put_square(ply);
  put_face(ply, {0, 1, 2}, {});
  put_face(ply, {0, 2, 3}, {});
  const Loaded loaded = load_text("scan.ply", ply.text());
  EXPECT_EQ(loaded.count("texture-without-uvs"), 2U);
  EXPECT_TRUE(loaded.mesh.material_files.empty());
}

TEST(PlyTextures, UvsOfCornersWinOverThoseOfVertices) {
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    PlyText ply(encoding,
                "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty "
                "float s\nproperty float t\n" +
                    kFaces);
    for (const float value : {0.F, 0.F, 0.F, .5F, .5F, 1.F, 0.F, 0.F, .5F, .5F,
                              1.F, 1.F, 0.F, .5F, .5F, 0.F, 1.F, 0.F, .5F, .75F}) {
      ply.put(value);
    }
    put_face(ply, {0, 1, 2}, kLower);
    put_face(ply, {0, 2, 3}, {0, 0});  // no two numbers a corner: the vertices'
    const Loaded loaded = load_text("both.ply", ply.text());
    const auto uv = [&](std::size_t t, std::size_t k) {
      return loaded.mesh.uvs[loaded.mesh.uv_triangles[t][k]];
    };
    EXPECT_EQ(uv(0, 1), (Vec2{1, 0})) << encoding;
    EXPECT_EQ(uv(0, 2), (Vec2{1, 1})) << encoding;
    EXPECT_EQ(uv(1, 2), (Vec2{0.5F, 0.75F})) << encoding;
    EXPECT_EQ(loaded.count("bad-texcoords"), 1U);
  }
}

/// The same where faces come before vertices.
TEST(PlyTextures, UvsOfCornersWinWhereFacesComeFirst) {
  PlyText ply("ascii", kFaces +
                           "element vertex 4\nproperty float x\nproperty float y\nproperty float "
                           "z\nproperty float s\nproperty float t\n");
  put_face(ply, {0, 1, 2}, kLower);
  put_face(ply, {0, 2, 3}, {});
  for (const float value : {0.F, 0.F, 0.F, .5F, .5F, 1.F, 0.F, 0.F, .5F, .5F,
                            1.F, 1.F, 0.F, .5F, .5F, 0.F, 1.F, 0.F, .5F, .75F}) {
    ply.put(value);
  }
  const Mesh mesh = load_text("both.ply", ply.text()).mesh;
  EXPECT_EQ(mesh.uvs[mesh.uv_triangles[0][1]], (Vec2{1, 0}));
  EXPECT_EQ(mesh.uvs[mesh.uv_triangles[1][1]], (Vec2{0.5F, 0.5F}));
  EXPECT_EQ(mesh.uvs[mesh.uv_triangles[1][2]], (Vec2{0.5F, 0.75F}));
}

/// Counts in warnings of headers, not only that they come.
TEST(PlyHeader, WarningsCount) {
  const auto count = [](const std::string& header, const std::string& body, const char* code) {
    return load_text("h.ply", "ply\nformat ascii 1.0\n" + header + "end_header\n" + body)
        .count(code);
  };
  const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  const std::string vertices =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  EXPECT_EQ(count("comment a\nobj_info b\n" + vertices + face, triangle, "ignored-header-lines"),
            0U);
  EXPECT_EQ(
      count("what\n" + vertices + "is this\nelements 3\n" + face, triangle, "ignored-header-lines"),
      3U);
  // Half of a normal, a colour without its blue, with an alpha that belongs to it.
  EXPECT_EQ(count(vertices +
                      "property float nx\nproperty uchar red\nproperty uchar green\nproperty "
                      "uchar alpha\n" +
                      face,
                  "0 0 0 1 9 9 9\n1 0 0 1 9 9 9\n0 1 0 1 9 9 9\n3 0 1 2\n", "unused-properties"),
            4U);
  // A second set of UVs, both of it; and a face's colour twice.
  EXPECT_EQ(
      count(vertices + "property float s\nproperty float t\nproperty float u\nproperty float v\n" +
                face,
            "0 0 0 0 0 0 0\n1 0 0 0 0 0 0\n0 1 0 0 0 0 0\n3 0 1 2\n", "unused-properties"),
      2U);
  EXPECT_EQ(
      count(vertices + face + "property uchar red\nproperty uchar red\nproperty uchar green\n",
            "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 9 9 9\n", "unused-properties"),
      3U);
}

}  // namespace
}  // namespace kiln
