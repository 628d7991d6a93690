// Wavefront MTL.
#include "asset/materials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/material.h"
#include "support/environment.h"
#include "support/read_file.h"

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
      "map_Kd -blendu off -s 2 3 2 -clamp on old paint.png\nmap_Pr sub\\rough.png\n"
      "illum 2\n\nNEWMTL glass\nTr 0.75\nmap_d \"a b.png\"\nnorm -bm 0.4 n.png\nmap_Kd -o 1 "
      "x.png\n",
      &warnings);
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].name, "red paint");
  EXPECT_EQ(materials[0].color, (std::array<float, 3>{0.5F, 0.25F, 0}));
  EXPECT_EQ(materials[0].opacity, 0.5F);
  EXPECT_EQ(materials[0].roughness, 0.3F);
  EXPECT_EQ(materials[0].metallic, 1);
  EXPECT_EQ(materials[0].color_map.file, fs::path("folder/old paint.png"));
  EXPECT_EQ(materials[0].roughness_map.file, fs::path("folder/sub/rough.png"));
  EXPECT_EQ(materials[0].color_map.wrap[1], TextureWrap::clamp);
  EXPECT_EQ(materials[0].roughness_map.wrap[0], TextureWrap::repeat);
  EXPECT_EQ(materials[1].opacity, 0.25F);
  EXPECT_EQ(materials[1].opacity_map.file, fs::path("folder/a b.png"));
  EXPECT_EQ(materials[1].normal_map.file, fs::path("folder/n.png"));
  EXPECT_EQ(materials[1].color_map.file, fs::path("folder/x.png"));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "texture-options");
  EXPECT_EQ(warnings[0].count, 2U);  // -blendu, -bm
  EXPECT_EQ(materials[0].color_map.uv_transform, (std::array<float, 6>{2, 0, 0, 0, 3, 0}));
  EXPECT_EQ(materials[1].color_map.uv_transform, (std::array<float, 6>{1, 0, 1, 0, 1, 0}));
}

/// What a material is given has no part in the next one, whatever the statements of both.
TEST(Materials, NoStatementOutlivesItsMaterial) {
  const std::vector<std::string> statements = {"Kd 0.5 0.25 0",
                                               "Ke 1 2 3",
                                               "Ka 0.75 0.75 0.75",
                                               "d 0.5",
                                               "Tr 0.75",
                                               "Tr 1",
                                               "Pr 0.3",
                                               "Pm 1",
                                               "Ns 250",
                                               "illum 3",
                                               "illum 2",
                                               "map_Kd -s 2 2 a.png",
                                               "map_d b.png",
                                               "map_Bump c.png",
                                               "norm d.png",
                                               "map_Pr e.png",
                                               "map_Ns f.png",
                                               "map_refl g.png",
                                               "map_Ke h.png",
                                               "map_Kd -clamp on i.png",
                                               "Ka 1 1 1\nillum 6",
                                               "Kd 1 1 1\nTr 0.25"};
  const auto text_of = [](const Material& m) {
    std::string text;
    for (const float value : {m.color[0], m.color[1], m.color[2], m.opacity, m.roughness,
                              m.metallic, m.emission[0], m.emission[1], m.emission[2]}) {
      text += std::to_string(value) + " ";
    }
    for (const MaterialNumber from :
         {m.color_from, m.roughness_from, m.metallic_from, m.emission_from}) {
      text += std::to_string(static_cast<int>(from)) + " ";
    }
    for (const MaterialPicture* const picture :
         {&m.color_map, &m.opacity_map, &m.normal_map, &m.roughness_map, &m.metallic_map,
          &m.emission_map}) {
      text += picture->file.string() + std::to_string(static_cast<int>(picture->wrap[0])) +
              std::to_string(picture->empty() ? 0.0F : picture->uv_transform[0]) + " ";
    }
    return text;
  };
  for (const std::string& head : {std::string(), std::string("# Blender 4.2 MTL File\n")}) {
    for (const std::string& second : statements) {
      const std::string alone = text_of(read(head + "newmtl b\nKd 1 1 1\n" + second + "\n").at(0));
      for (const std::string& first : statements) {
        const std::vector<Material> both =
            read(head + "newmtl a\n" + first + "\nnewmtl b\nKd 1 1 1\n" + second + "\n");
        ASSERT_EQ(both.size(), 2U);
        EXPECT_EQ(text_of(both[1]), alone) << head << first << " before " << second;
      }
    }
  }
}

// As bpy 5.0.1 reads it: a Mapping node of type Point, whose scale comes before its location, whatever the order.
TEST(Materials, PicturesAreScaledThenMoved) {
  const std::array<float, 6> both{0.5F, 0, 0.2F, 0, 0.25F, -0.1F};
  for (const char* options : {"-o 0.2 -0.1 0 -s 0.5 0.25 1", "-s 0.5 0.25 -o 0.2 -0.1"}) {
    std::vector<Warning> warnings;
    const auto read_back =
        read("newmtl M\nmap_Kd " + std::string(options) + " a.png\nmap_Pr b.png\n", &warnings);
    EXPECT_EQ(read_back[0].color_map.uv_transform, both) << options;
    EXPECT_EQ(read_back[0].color_map.file, fs::path("folder/a.png"));
    EXPECT_EQ(read_back[0].roughness_map.uv_transform, MaterialPicture().uv_transform);
    EXPECT_TRUE(warnings.empty());
  }
  for (const char* odd : {"-s x 1", "-o 1e39 0", "-t 1 1"}) {
    std::vector<Warning> warnings;
    read("newmtl M\nmap_Kd " + std::string(odd) + " a.png\n", &warnings);
    EXPECT_EQ(warnings.size(), 1U) << odd;
  }
}

/// Options of pictures that are at their default say nothing; each of them with another value is told.
TEST(Materials, OptionsWithoutEffectAreNotTold) {
  const auto count_of = [](const std::string& options) {
    std::vector<Warning> warnings;
    const std::vector<Material> materials =
        read("newmtl M\nmap_Kd " + options + " a.png\n", &warnings);
    EXPECT_EQ(materials.at(0).color_map.file, fs::path("folder/a.png")) << options;
    return warnings.size();
  };
  for (const char* idle : {"-bm 1.0", "-t 0 0 0", "-clamp off", "-cc off", "-blendu on",
                           "-blendv on", "-mm 0 1", "-clamp on"}) {
    EXPECT_EQ(count_of(idle), 0U) << idle;
  }
  for (const char* told : {"-bm 0.5", "-t 0 0.5 0", "-cc on", "-blendu off", "-blendv off",
                           "-mm 0 2", "-mm 0.5 1", "-boost 1", "-texres 64", "-imfchan r"}) {
    EXPECT_EQ(count_of(told), 1U) << told;
  }
}

/// Spectra and CIE XYZ are no RGB: such a colour counts as not given.
TEST(Materials, ColoursOfOtherKindsStayWhite) {
  for (const char* kind : {"xyz 0.1 0.2 0.3", "spectral red.rfl", "spectral red.rfl 0.5"}) {
    const Material material = read("newmtl a\nKd " + std::string(kind) + "\nd 0.5\n").at(0);
    EXPECT_EQ(material.color, Material().color) << kind;
    EXPECT_EQ(material.color_from, Material().color_from) << kind;
    EXPECT_EQ(material.opacity, 0.5F) << kind;
  }
}

TEST(Materials, RefusesWhatIsNoNumber) {
  EXPECT_THROW(read("newmtl a\nKd 1 red 0\n"), Error);
  EXPECT_THROW(read("newmtl a\nd\n"), Error);
  EXPECT_TRUE(read("map_Kd early.png\nKd x y z\n").empty());
  EXPECT_EQ(read("newmtl\n").at(0).name, "default");
  EXPECT_TRUE(read("newmtl a\nmap_Kd -s 1\n").at(0).color_map.file.empty());
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
  EXPECT_TRUE(load_material_texture(materials, MaterialSlot::color).images.empty());
  fs::remove(folder / "sub" / "my materials.mtl");
  EXPECT_THROW(load_materials(mesh, folder / "mesh.obj"), Error);
}

/// The number of a material's opacity counts beside a picture of colours, and the alpha of that picture beside other
/// materials' pictures of opacity.
TEST(Materials, OpacityIsThePicturesAlphaTimesTheNumber) {
  const fs::path folder = test::scratch_folder();
  save_image({1, 1, 4, {1, 0, 0, 0.8F}}, folder / "alpha.png", {.format = ImageFormat::png8});
  save_image({1, 1, 3, {0, 1, 0}}, folder / "color.png", {.format = ImageFormat::png8});
  save_image({1, 1, 1, {0.6F}}, folder / "holes.png", {.format = ImageFormat::png8});
  std::ofstream(folder / "mesh.obj")
      << "mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"
         "usemtl other\nf 1 2 3\n";
  const auto opacity = [&](const std::string& statements, const std::string& other) {
    std::ofstream(folder / "mesh.mtl") << "newmtl m\n" << statements << "newmtl other\n" << other;
    const Mesh mesh = load_mesh(folder / "mesh.obj");
    const Texture texture =
        load_material_texture(load_materials(mesh, folder / "mesh.obj"), MaterialSlot::opacity);
    // Alpha is the fourth channel, unless a material reads another picture.
    EXPECT_EQ(texture.channel,
              (statements + other).find("map_d holes") == std::string::npos ? 3U : 0U);
    const std::uint32_t index = texture.image_of[0];
    if (index == Texture::kNone) return texture.plain[0][texture.channel];
    const Image& image = *texture.images[index];
    // a picture without the channel of alpha is opaque
    const float value = image.channels == 1                ? image.pixels[0]
                        : texture.channel < image.channels ? image.pixels[texture.channel]
                                                           : 1;
    return texture.factors.empty() ? value : value * texture.factors[0].times[texture.channel];
  };
  const std::string plain = "Kd 1 1 1\n", colored = "map_Kd alpha.png\n",
                    holes = "map_d holes.png\n";
  for (const std::string& other : {plain, colored, holes}) {
    SCOPED_TRACE(other);
    EXPECT_NEAR(opacity("map_Kd alpha.png\n", other), 0.8, 1e-6);
    EXPECT_NEAR(opacity("d 0.4\nmap_Kd color.png\n", other), 0.4, 1e-6);
    EXPECT_NEAR(opacity("Tr 0.3\nmap_Kd color.png\n", other), 0.7, 1e-6);
    EXPECT_NEAR(opacity("Tr 1\nmap_Kd color.png\n", other), 1, 1e-6);
    EXPECT_NEAR(opacity("d 0.5\nmap_Kd alpha.png\n", other), 0.4, 1e-6);
    EXPECT_NEAR(opacity("d 0.5\nmap_Kd alpha.png\nmap_d alpha.png\n", other), 0.8, 1e-6);
    EXPECT_NEAR(opacity("d 0.5\nmap_Kd alpha.png\nmap_d holes.png\n", other), 0.6, 1e-6);
    EXPECT_NEAR(opacity("d 0.25\n", other), 0.25, 1e-6);
  }
}

/// Nouns and verbs of messages agree with one and with many.
TEST(Materials, MessagesAgreeWithTheirCounts) {
  const auto said = [](const std::string& text) {
    std::vector<Warning> warnings;
    read("newmtl a\n" + text, &warnings);
    std::string all;
    for (const Warning& warning : warnings) all += std::string(warning.message.text()) + "\n";
    return all;
  };
  const auto has = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  const std::string tr = "Kd 1 1 1\nTr 1\n", ignored = "map_foo a.png\n",
                    moved = "map_Kd -t 1 1 a.png\n";
  has(said(tr), "1 material has Tr 1 and no d, which means invisible. It is read as opaque");
  has(said(tr + "newmtl b\n" + tr),
      "2 materials (this is the first) have Tr 1 and no d, which means invisible. They are read as "
      "opaque");
  has(said(ignored), "1 statement of a picture is not supported, and was ignored");
  has(said(ignored + ignored),
      "2 statements (this is the first) of pictures are not supported, and were ignored");
  has(said(moved), "1 picture has options that Kiln does not support");
  has(said(moved + moved), "2 pictures (this is the first) have options that Kiln");
}

// ---- which statements mean what ----------------------------------------------------------------

std::uint64_t count(const std::vector<Warning>& warnings, const std::string& code) {
  std::uint64_t sum = 0;
  for (const Warning& warning : warnings) sum += warning.code == code ? warning.count : 0;
  return sum;
}

std::string message(const std::vector<Warning>& warnings, const std::string& code) {
  for (const Warning& warning : warnings) {
    if (warning.code == code) return warning.message.text();
  }
  return {};
}

TEST(Materials, NormalMapsHaveManyNames) {
  for (const char* word : {"map_Bump", "map_bump", "bump", "norm", "map_Kn"}) {
    std::vector<Warning> warnings;
    const std::string text = "newmtl M\n" + std::string(word) + " -bm 1.000000 n.png\n";
    EXPECT_EQ(read(text, &warnings)[0].normal_map.file, fs::path("folder/n.png")) << word;
    EXPECT_TRUE(warnings.empty()) << "a strength of 1 changes nothing";
  }
  // A statement that means nothing but normals comes first, wherever it stands.
  EXPECT_EQ(read("newmtl M\nnorm n.png\nmap_Bump h.png\n")[0].normal_map.file,
            fs::path("folder/n.png"));
  EXPECT_EQ(read("newmtl M\nmap_Bump h.png\nnorm n.png\n")[0].normal_map.file,
            fs::path("folder/n.png"));
  std::vector<Warning> warnings;
  read("newmtl M\nmap_Bump -bm 0.3 n.png\n", &warnings);
  EXPECT_EQ(count(warnings, "texture-options"), 1u);
}

TEST(Materials, PicturesFarAwayAreRefused) {
  const fs::path folder = test::scratch_folder();
  save_image({1, 1, 3, {0.5F, 0.5F, 1}}, folder / "a.png", {.format = ImageFormat::png8});
  std::vector<Material> materials(1);
  materials[0].color_map.file = folder / "a.png";
  for (const float far : {1e7F, -1e30F, NAN}) {
    materials[0].color_map.uv_transform[2] = far;
    EXPECT_THROW(load_material_texture(materials, MaterialSlot::color), Error) << far;
  }
  materials[0].color_map.uv_transform[2] = 1000;
  EXPECT_EQ(load_material_texture(materials, MaterialSlot::color).images.size(), 1U);
}

/// Numbers stand where pictures are gone, with a warning.
TEST(Materials, PicturesThatAreGoneAreTold) {
  std::vector<Material> materials(2);
  materials[0].color = {1, 0.5F, 0};
  materials[0].color_map.file = test::scratch_folder() / "gone.png";
  std::vector<Warning> warnings;
  const Texture texture = load_material_texture(materials, MaterialSlot::color, &warnings);
  EXPECT_TRUE(texture.images.empty());
  EXPECT_EQ(texture.plain[0][1], 0.5F);
  EXPECT_EQ(count(warnings, "picture-missing"), 1U);
  EXPECT_NE(message(warnings, "picture-missing").find("gone.png"), std::string::npos);
}

TEST(Materials, GreyPicturesAreHeights) {
  const fs::path folder = test::scratch_folder();
  save_image({1, 2, 3, {0.5F, 0.5F, 0.5F, 0.9F, 0.9F, 0.9F}}, folder / "grey.png",
             {.format = ImageFormat::png8});
  save_image({2, 1, 1, {0.5F, 0.9F}}, folder / "one.png", {.format = ImageFormat::png8});
  save_image({1, 1, 3, {0.5F, 0.5F, 1}}, folder / "flat.png", {.format = ImageFormat::png8});
  std::vector<Material> materials(4);
  materials[0].normal_map.file = folder / "grey.png";
  materials[1].normal_map.file = folder / "one.png";
  materials[2].normal_map.file = folder / "flat.png";
  std::vector<Warning> warnings;
  const Texture texture = load_material_texture(materials, MaterialSlot::normal, &warnings);
  EXPECT_EQ(texture.image_of,
            (std::vector<std::uint32_t>{Texture::kNone, Texture::kNone, 0, Texture::kNone}));
  ASSERT_EQ(texture.images.size(), 1u);
  EXPECT_EQ(count(warnings, "bump-is-height"), 2u);
  EXPECT_NE(message(warnings, "bump-is-height").find("grey.png"), std::string::npos);
}

/// As Blender 5.0.1 wrote them for roughness 0.35 and 0.2, metalness 0, 0.75 and 0.6.
const std::string kBlender =
    "# Blender 5.0.1 MTL File: 'None'\n# www.blender.org\n\nnewmtl Material #25\nNs 422.499969\n"
    "Ka 1.000000 1.000000 1.000000\nKe 0.000000 0.000000 0.000000\nd 1.000000\nillum 2\n\n"
    "newmtl metal\nNs 640.000000\nKa 0.750000 0.750000 0.750000\nd 1.000000\nillum 3\n\n"
    "newmtl glassmetal\nNs 640.000000\nKa 0.600000 0.600000 0.600000\nd 0.500000\nillum 6\n\n"
    "newmtl textured\nKa 1 1 1\nillum 2\nmap_Ns rough.png\nmap_refl metal.png\n\n"
    "newmtl pbr\nNs 10\nillum 3\nPr 0.350000\nPm 0.250000\n";

TEST(Materials, BlendersNumbersAreConverted) {
  std::vector<Warning> warnings;
  const std::vector<Material> m = read(kBlender, &warnings);
  ASSERT_EQ(m.size(), 5u);
  EXPECT_EQ(m[0].name, "Material #25");
  EXPECT_EQ(m[0].place, "test.mtl: line 4");
  EXPECT_NEAR(m[0].roughness, 0.35, 1e-6);
  EXPECT_EQ(m[0].metallic, 0);
  EXPECT_NEAR(m[1].roughness, 0.2, 1e-6);
  EXPECT_EQ(m[1].metallic, 0.75F);
  EXPECT_NEAR(m[2].metallic, 0.6, 1e-6);
  EXPECT_EQ(m[3].roughness_map.file, fs::path("folder/rough.png"));
  EXPECT_EQ(m[3].metallic_map.file, fs::path("folder/metal.png"));
  EXPECT_EQ(count(warnings, "blender-pictures"), 2u);
  EXPECT_EQ(m[4].roughness, 0.35F);
  EXPECT_EQ(m[4].metallic, 0.25F);
  EXPECT_EQ(m[4].roughness_from, MaterialNumber::given);
  const std::vector<Material> plain = {m[0], m[1], m[2], m[4]};
  warnings.clear();
  const Texture rough = load_material_texture(plain, MaterialSlot::roughness, &warnings);
  EXPECT_NEAR(rough.plain[0][0], 0.35, 1e-6);
  EXPECT_EQ(count(warnings, "roughness-from-ns"), 3u);
  EXPECT_NE(message(warnings, "roughness-from-ns").find("test.mtl: line 4"), std::string::npos);
  load_material_texture(plain, MaterialSlot::metallic, &warnings);
  EXPECT_EQ(count(warnings, "metallic-from-illum"), 3u);
  // In other programs' files Ka is a colour of light, and map_Ns an exponent.
  warnings.clear();
  const std::vector<Material> other =
      read("newmtl M\nNs 1000\nKa 1 1 1\nillum 3\nmap_Ns e.png\nmap_Pr_typo x.png\n", &warnings);
  EXPECT_EQ(other[0].roughness, 0);
  EXPECT_TRUE(other[0].roughness_map.file.empty());
  EXPECT_EQ(other[0].metallic_from, MaterialNumber::none);
  EXPECT_EQ(count(warnings, "ignored-pictures"), 2u);
  EXPECT_NE(message(warnings, "ignored-pictures").find("line 5: map_ns"), std::string::npos);
  for (const auto& [ns, roughness] :
       {std::pair("-3", 1.0), {"0", 1.0}, {"250", 0.5}, {"9999", 0.0}}) {
    EXPECT_NEAR(read("newmtl M\nNs " + std::string(ns) + "\n")[0].roughness, roughness, 1e-6);
  }
}

TEST(Materials, WhatNobodyWroteIsNoMap) {
  const std::vector<Material> bare = read("newmtl M\nKs 1 1 1\n");
  for (const MaterialSlot slot :
       {MaterialSlot::color, MaterialSlot::normal, MaterialSlot::roughness, MaterialSlot::metallic,
        MaterialSlot::emission}) {
    try {
      load_material_texture(bare, slot);
      ADD_FAILURE() << "a constant";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_NE(std::string(error.what()).find("\"M\" (test.mtl: line 1)"), std::string::npos)
          << error.what();
    }
  }
  EXPECT_EQ(load_material_texture(bare, MaterialSlot::opacity).plain[0][0], 1);
  std::vector<Warning> warnings;
  const Texture some = load_material_texture(read("newmtl a\nPm 0.5\nnewmtl b\nnewmtl c\n"),
                                             MaterialSlot::metallic, &warnings);
  EXPECT_EQ(some.plain[0][0], 0.5F);
  EXPECT_EQ(some.plain[1][0], 0);
  EXPECT_EQ(count(warnings, "material-value"), 2u);
  EXPECT_NE(message(warnings, "material-value").find("\"b\" (test.mtl: line 3)"),
            std::string::npos);
}

TEST(Materials, OfAnyEncodingAndWriter) {
  // 3ds Max's opacity in both words; some write Tr as d.
  EXPECT_EQ(read("newmtl a\nd 1.0\nTr 1.0\n")[0].opacity, 1);
  EXPECT_EQ(read("newmtl a\nTr 1.0\nd 1.0\n")[0].opacity, 1);
  const std::string text =
      "newmtl Stra\xC3\x9F"
      "e\nKd 1 0 0\n";
  EXPECT_EQ(read("\xEF\xBB\xBF" + text)[0].name,
            "Stra\xC3\x9F"
            "e");
  std::string wide = "\xFF\xFE";
  for (const std::string& c : {std::string("newmtl "), std::string(1, '\x3D')}) {
    if (c.size() == 1) {
      wide += std::string("\x3D\xD8\x00\xDE\x3D\xD8", 6);  // U+1F600, and half of a pair
    } else {
      for (const char letter : c) wide += std::string{letter, '\0'};
    }
  }
  EXPECT_EQ(read(wide)[0].name, "\xF0\x9F\x98\x80\xEF\xBF\xBD");
}

/// Joined meshes have one material of a name: where their files describe two, that is told; copies are one.
TEST(Materials, TwoOfOneNameAreTold) {
  const fs::path folder = test::scratch_folder();
  fs::create_directories(folder / "b");
  const auto describe =
      [&](const fs::path& in, const char* color, float shade) {
        std::ofstream(in / "m.mtl") << "newmtl wood\nKd " << color << "\nmap_Kd t.png\n";
        save_image({1, 1, 3, {shade, 0, 0}}, in / "t.png", {.format = ImageFormat::png8});
        std::ofstream(in / "m.obj")
            << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wood\nf 1 2 3\n";
      };
  const auto told = [&] {
    std::vector<Mesh> meshes = {load_mesh(folder / "m.obj"), load_mesh(folder / "b/m.obj")};
    meshes[1].material_files = {"b/m.mtl"};
    std::vector<Warning> warnings;
    load_materials(join_meshes(meshes), folder / "m.obj", &warnings);
    return count(warnings, "materials-differ");
  };
  describe(folder, "1 1 1", 1);
  describe(folder / "b", "1 1 1", 1);
  EXPECT_EQ(told(), 0u);
  describe(folder / "b", "1 0 1", 1);
  EXPECT_EQ(told(), 1u);
  describe(folder / "b", "1 1 1", 0);
  EXPECT_EQ(told(), 1u) << "another picture of the same name";
}

/// Paths of another machine.
TEST(Materials, PicturesAreFoundInTheMeshsFolders) {
  const fs::path folder = test::scratch_folder() / "model";
  for (const char* sub : {"tex", "old/tex", "a/b/c/d/e"}) fs::create_directories(folder / sub);
  const auto picture = [](const fs::path& path) {
    save_image({1, 1, 3, {1, 0, 0}}, path, {.format = ImageFormat::png8});
  };
  picture(folder / "tex" / "a.png");
  picture(folder / "old" / "tex" / "a.png");
  picture(folder / "Wood.PNG");
  picture(folder / "a/b/c/d/e" / "deep.png");
  picture(folder.parent_path() / "above.png");
  std::ofstream(folder / "mesh.mtl")
      << "newmtl a\nmap_Kd C:\\proj\\tex\\a.png\nnewmtl b\nmap_Kd /home/x/wood.png\n"
         "newmtl c\nmap_Kd D:\\deep.png\nnewmtl d\nmap_Kd above.png\nnewmtl e\nmap_Kd "
         "old/tex/a.png\n"
         "newmtl f\nmap_Kd ../above.png\n";
  std::ofstream(folder / "mesh.obj") << "mtllib X:\\scenes\\mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
  std::ofstream out(folder / "mesh.obj", std::ios::app);
  for (const char* name : {"a", "b", "c", "d", "e", "f"}) out << "usemtl " << name << "\nf 1 2 3\n";
  out.close();
  std::vector<Warning> warnings;
  const std::vector<Material> m =
      load_materials(load_mesh(folder / "mesh.obj"), folder / "mesh.obj", &warnings);
  EXPECT_EQ(m[0].color_map.file, folder / "tex/a.png");
  EXPECT_EQ(m[1].color_map.file, folder / "Wood.PNG");
  EXPECT_FALSE(fs::exists(m[2].color_map.file)) << "four levels";
  EXPECT_FALSE(fs::exists(m[3].color_map.file)) << "never above the mesh's folder";
  EXPECT_EQ(m[4].color_map.file, folder / "old/tex/a.png");
  EXPECT_TRUE(fs::exists(m[5].color_map.file)) << "as the file says";
  EXPECT_EQ(count(warnings, "found-elsewhere"), 3u);  // the MTL, a.png, Wood.PNG
  bool said = false;
  for (const Warning& warning : warnings) {
    said = said || (warning.message.text().find("line 2: map_kd") != std::string::npos &&
                    warning.message.text().find("one of 2 files") != std::string::npos &&
                    warning.message.text().find("tex/a.png' is used") != std::string::npos);
  }
  EXPECT_TRUE(said);
  // A missing MTL's message names the mesh.
  fs::remove(folder / "mesh.mtl");
  try {
    load_materials(load_mesh(folder / "mesh.obj"), folder / "mesh.obj");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("mesh.obj"), std::string::npos) << error.what();
  }
}

/// OpenMVS and mvs-texturing write `Tr 1` for what is opaque.
TEST(Materials, TransparencyOfOneIsOpaque) {
  const auto opacity = [](const std::string& lines, std::uint64_t said = 0) {
    std::vector<Warning> warnings;
    const float value = read("newmtl m\nKd 1 1 1\n" + lines, &warnings).at(0).opacity;
    EXPECT_EQ(count(warnings, "transparency-of-one"), said) << lines;
    return value;
  };
  EXPECT_EQ(opacity("Tr 1.000000\nmap_Kd a.png\n", 1), 1);
  EXPECT_EQ(opacity("Tr 1\n", 1), 1);
  EXPECT_EQ(opacity("d 1\nTr 1\n"), 1);
  EXPECT_EQ(opacity("Tr 1\nd 1\n"), 1);
  EXPECT_EQ(opacity("d 1\nTr 0\n"), 1);
  EXPECT_EQ(opacity("Tr 0\n"), 1);
  EXPECT_EQ(opacity("Tr 0.75\n"), 0.25F);
  EXPECT_EQ(opacity("d 0.5\nTr 1\n"), 0.5F);
  EXPECT_EQ(opacity("Tr 1\nd 0.5\n"), 0.5F);
  EXPECT_EQ(opacity("d 0\n"), 0);
  EXPECT_EQ(opacity("d 0\nTr 1\n"), 0);
  // Each material by itself.
  std::vector<Warning> warnings;
  const std::vector<Material> both =
      read("newmtl a\nTr 1\nnewmtl b\nKd 1 0 0\nnewmtl c\nTr 1\n", &warnings);
  for (const Material& material : both) EXPECT_EQ(material.opacity, 1) << material.name;
  EXPECT_EQ(count(warnings, "transparency-of-one"), 2U);
  EXPECT_NE(message(warnings, "transparency-of-one").find("line 2: a"), std::string::npos);
}

TEST(Materials, TheCases) {
  KILN_REQUIRE_DATA("cases");
  const fs::path cases = *test::shared_data("cases");
  const auto texture = [](const fs::path& obj, MaterialSlot slot) {
    return load_material_texture(load_materials(load_mesh(obj), obj), slot);
  };
  for (const char* name :
       {"plane", "plane_pbr", "k_bump", "k_map_Bump", "k_map_bump", "k_map_Kn", "k_norm"}) {
    const Texture normals =
        texture(cases / "bump" / (std::string(name) + ".obj"), MaterialSlot::normal);
    ASSERT_EQ(normals.images.size(), 1u) << name;
    EXPECT_NEAR(normals.images[0]->pixels[0], 0.75, 0.003);
    EXPECT_NEAR(normals.images[0]->pixels[1], 0.5, 0.003);
    EXPECT_NEAR(normals.images[0]->pixels[2], 0.933, 0.003);
  }
  EXPECT_THROW(texture(cases / "bump" / "odd.obj", MaterialSlot::roughness), Error);
  EXPECT_NEAR(texture(cases / "bump" / "plane.obj", MaterialSlot::roughness).plain[0][0], 0.5,
              1e-6);
  for (const char* name : {"hash", "lib"}) {
    const Texture colors =
        texture(cases / "hash" / (std::string(name) + ".obj"), MaterialSlot::color);
    EXPECT_EQ(colors.plain[0], (std::array<float, 4>{1, 0, 0, 1}));
    EXPECT_EQ(colors.plain[1], (std::array<float, 4>{0, 1, 0, 1}));
  }
  EXPECT_EQ(texture(cases / "hash" / "tex.obj", MaterialSlot::color).images.size(), 2u);
  for (const char* name : {"openmvs", "openmvs_kd", "mvstex", "d1tr0", "d1tr1", "tr1d1"}) {
    const fs::path obj = cases / "mtl_tr" / (std::string(name) + ".obj");
    EXPECT_EQ(load_materials(load_mesh(obj), obj).at(0).opacity, 1) << name;
  }
}

/// Pictures of floats hold linear light, which is converted where a slot's other pictures are sRGB. Numbers are kept.
TEST(Materials, ColoursInLinearLightAreConverted) {
  const fs::path folder = test::scratch_folder();
  const std::vector<float> linear = {0, 0.0021F, 0.2140411F, 1, 2.5F, 0.5028865F};
  const Image picture{2, 1, 3, linear};
  save_image(picture, folder / "a.exr", {.format = ImageFormat::exr_float});
  const auto texture_of = [&](const std::string& line, MaterialSlot slot) {
    std::ofstream(folder / "m.mtl") << "newmtl a\n" << line << "\n";
    std::ofstream(folder / "m.obj") << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n"
                                       "usemtl a\nf 1/1 2/1 3/1\n";
    const Asset asset = load_asset(folder / "m.obj");
    const Texture texture = load_material_texture(asset.materials, slot);
    EXPECT_EQ(texture.images.size(), 1U) << line;
    return texture;
  };
  const std::vector<double> srgb = {0, 12.92 * 0.0021, 0.5, 1, 1.490, 0.7373};
  for (const MaterialSlot slot : {MaterialSlot::color, MaterialSlot::emission}) {
    const bool is_color = slot == MaterialSlot::color;
    const Texture texture = texture_of(is_color ? "map_Kd a.exr" : "map_Ke a.exr", slot);
    EXPECT_EQ(texture.kind, TextureKind::srgb);
    for (std::size_t i = 0; i < srgb.size(); ++i) {
      EXPECT_NEAR(texture.images.at(0)->pixels[i], srgb[i], 6e-4) << i;
    }
  }
  const Texture roughness = texture_of("map_Pr a.exr", MaterialSlot::roughness);
  EXPECT_EQ(roughness.kind, TextureKind::linear);
  EXPECT_EQ(roughness.images.at(0)->pixels[2], linear[2]);
  // In the bytes of a file, too.
  Material material;
  material.color_map.bytes = std::make_shared<const std::vector<std::byte>>(
      encode(picture, {.format = ImageFormat::exr_float}));
  EXPECT_NEAR(load_material_texture({material}, MaterialSlot::color).images.at(0)->pixels[2], 0.5,
              6e-4);
}

/// BC5 and its like hold x and y of normals: as colours they are grey with opacity, which is told. Grey and alpha of
/// other formats, and normals, are what they are.
TEST(Materials, TexturesOfTwoChannelsAreNoColours) {
  const fs::path folder = test::scratch_folder();
  const auto save = [&](std::uint32_t side, std::uint32_t channels, const char* name,
                        const SaveImageOptions& options) {
    const std::size_t values = std::size_t{side} * side * channels;
    save_image({side, side, channels, std::vector<float>(values, 0.5F)}, folder / name, options);
  };
  save(8, 2, "bc5.dds", {.format = ImageFormat::dds});
  save(6, 2, "r8g8.dds", {.format = ImageFormat::dds});
  save(8, 1, "bc4.dds", {.format = ImageFormat::dds});
  save(8, 3, "srgb.dds", {.format = ImageFormat::dds, .use = TextureUse::color});
  save(8, 2, "grey_alpha.png", {.format = ImageFormat::png8});
#ifdef KILN_HAS_ZSTD
  save(8, 2, "bc5.ktx2", {.format = ImageFormat::ktx2});
#endif
  const auto warnings_of = [&](const fs::path& file, MaterialSlot slot, bool in_memory) {
    Material material;
    material.name = "m";
    MaterialPicture& picture = slot == MaterialSlot::color      ? material.color_map
                               : slot == MaterialSlot::emission ? material.emission_map
                                                                : material.normal_map;
    picture.file = folder / file;
    if (in_memory) {
      const std::string bytes = test::read_file(folder / file);
      const auto* const first = reinterpret_cast<const std::byte*>(bytes.data());
      picture.bytes = std::make_shared<const std::vector<std::byte>>(first, first + bytes.size());
    }
    std::vector<Warning> warnings;
    load_material_texture({material}, slot, &warnings);
    return warnings;
  };
  for (const bool in_memory : {false, true}) {
    for (const char* file : {"bc5.dds", "r8g8.dds", "bc5.ktx2"}) {
      if (!fs::exists(folder / file)) continue;
      for (const MaterialSlot slot : {MaterialSlot::color, MaterialSlot::emission}) {
        const std::vector<Warning> warnings = warnings_of(file, slot, in_memory);
        EXPECT_EQ(count(warnings, "two-channel-colors"), 1U) << file;
        EXPECT_NE(message(warnings, "two-channel-colors").find(file), std::string::npos) << file;
      }
      EXPECT_EQ(count(warnings_of(file, MaterialSlot::normal, in_memory), "two-channel-colors"),
                0U);
    }
    for (const char* file : {"bc4.dds", "srgb.dds", "grey_alpha.png"}) {
      EXPECT_EQ(count(warnings_of(file, MaterialSlot::color, in_memory), "two-channel-colors"), 0U)
          << file;
    }
  }
}

}  // namespace
}  // namespace kiln
