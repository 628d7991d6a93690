// Wavefront MTL.
#include "io/mesh/materials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::vector<Material> read(const std::string& text, std::vector<Warning>* warnings = nullptr) {
  return read_materials({"test.mtl", text, warnings}, "folder");
}

TEST(Materials, ReadsNumbersAndNamesOfPictures) {
  std::vector<Warning> warnings;
  const std::vector<Material> materials = read(
      "# by hand\nKd 1 1 1\nnewmtl red paint\nKd 0.5 0.25 0\nd -halo 0.5\nPr 0.3\nPm 1\n"
      "map_Kd -blendu off -s 2 2 2 -clamp on old paint.png\nmap_Pr sub\\rough.png\n"
      "illum 2\n\nNEWMTL glass\nTr 0.75\nmap_d \"a b.png\"\nnorm -bm 0.4 n.png\nmap_Kd -o 1 "
      "x.png\n",
      &warnings);
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].name, "red paint");
  EXPECT_EQ(materials[0].color, (std::array<float, 3>{0.5F, 0.25F, 0}));
  EXPECT_EQ(materials[0].opacity, 0.5F);
  EXPECT_EQ(materials[0].roughness, 0.3F);
  EXPECT_EQ(materials[0].metallic, 1);
  EXPECT_EQ(materials[0].color_file, fs::path("folder/old paint.png"));
  EXPECT_EQ(materials[0].roughness_file, fs::path("folder/sub/rough.png"));
  EXPECT_EQ(materials[1].opacity, 0.25F);
  EXPECT_EQ(materials[1].opacity_file, fs::path("folder/a b.png"));
  EXPECT_EQ(materials[1].normal_file, fs::path("folder/n.png"));
  EXPECT_EQ(materials[1].color_file, fs::path("folder/x.png"));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "texture-options");
}

TEST(Materials, RefusesWhatIsNoNumber) {
  EXPECT_THROW(read("newmtl a\nKd 1 red 0\n"), Error);
  EXPECT_THROW(read("newmtl a\nd\n"), Error);
  EXPECT_TRUE(read("map_Kd early.png\nKd x y z\n").empty());
  EXPECT_EQ(read("newmtl\n").at(0).name, "default");
  EXPECT_TRUE(read("newmtl a\nmap_Kd -s 1\n").at(0).color_file.empty());
}

TEST(Materials, AreFoundBesideTheMesh) {
  const fs::path folder = test::scratch_folder();
  fs::create_directory(folder / "sub");
  std::ofstream(folder / "sub" / "my materials.mtl")
      << "newmtl a\nmap_Kd a.png\nnewmtl b\nKd 0.5 0.5 0.5\nd 0.25\n";
  std::ofstream(folder / "mesh.obj")
      << "mtllib sub/my materials.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl b\nf 1 2 3\nusemtl a\n"
         "f 1 2 3\nusemtl gone\nf 1 2 3\n";
  save_image({1, 1, 4, {1, 0, 0, 0.5F}}, folder / "sub" / "a.png", {.format = ImageFormat::png8});
  const Mesh mesh = load_mesh(folder / "mesh.obj");
  std::vector<Warning> warnings;
  const std::vector<Material> materials = load_materials(mesh, folder / "mesh.obj", &warnings);
  ASSERT_EQ(materials.size(), 3U);
  EXPECT_EQ(warnings.at(0).code, "material-missing");
  const Texture color = load_material_texture(materials, MaterialSlot::color);
  EXPECT_EQ(color.kind, TextureKind::srgb);
  EXPECT_EQ(color.image_of, (std::vector<std::uint32_t>{Texture::kNone, 0, Texture::kNone}));
  EXPECT_EQ(color.plain[0][1], 0.5F);
  // No picture of its own: the colour's alpha.
  const Texture opacity = load_material_texture(materials, MaterialSlot::opacity);
  EXPECT_EQ(opacity.channel, 3U);
  EXPECT_EQ(opacity.image_of[1], 0U);
  EXPECT_EQ(opacity.plain[0][3], 0.25F);
  EXPECT_THROW(load_material_texture({}, MaterialSlot::color), Error);
  fs::remove(folder / "sub" / "a.png");
  EXPECT_THROW(load_material_texture(materials, MaterialSlot::color), Error);
  fs::remove(folder / "sub" / "my materials.mtl");
  EXPECT_THROW(load_materials(mesh, folder / "mesh.obj"), Error);
}

}  // namespace
}  // namespace kiln
