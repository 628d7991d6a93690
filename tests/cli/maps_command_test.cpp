// Textures, names, layers, packed channels and own maps from the command line.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;
using test::call_kiln;
using test::expect_exit;
using test::ProcessResult;
using test::run_kiln;
using Words = std::vector<std::string>;

/// A square of two materials, whose pictures lie beside it, and a low poly for it.
fs::path make_scene() {
  fs::path folder = test::scratch_folder();
  Mesh high = test::plane(2, 1);
  high.name = "high";
  high.material_names = {"brick", "glass"};
  for (const Triangle& t : high.triangles) {
    const float x = high.positions[t[0]].x + high.positions[t[1]].x + high.positions[t[2]].x;
    high.materials.push_back(x < 0 ? 0 : 1);
  }
  save_obj(high, folder / "plain.obj");
  std::ofstream(folder / "high.obj") << "mtllib high.mtl\n"
                                     << test::read_file(folder / "plain.obj");
  std::ofstream(folder / "high.mtl")
      << "newmtl brick\nmap_Kd brick.png\nPr 0.75\nnewmtl glass\nKd 0.5 0.5 0.5\nd 0.25\nPr 0.25\n";
  save_image({2, 2, 4, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}}, folder / "brick.png",
             {ImageFormat::png8});
  save_obj(test::plane(1, 1), folder / "low.obj");
  return folder;
}

ProcessResult bake(const fs::path& scene, const Words& more) {
  Words words = {
      "bake",   scene / "high.obj", scene / "low.obj", "--out", scene / "out", "--size", "16",
      "--json", scene / "r.json",   "--recall",        "0"};
  words.insert(words.end(), more.begin(), more.end());
  return call_kiln(words);
}

json report_of(const fs::path& scene) { return json::parse(std::ifstream(scene / "r.json")); }

TEST(MapsCommand, SeveralOfAKindAreAsIfEachWereAskedForAlone) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  ASSERT_EQ(bake(scene, {"--maps", "ao,near=ao:ao-distance=5%:ao-rays=8,parts=id:id-by=part",
                         "--ao-rays", "4", "--pack", "both=ao,near"})
                .exit_code,
            0);
  EXPECT_EQ(report_of(scene)["variant_ids"]["parts"].size(), 1U);
  const Image near = load_image(scene / "out" / "low_near.png"),
              ao = load_image(scene / "out" / "low_ao.png"),
              both = load_image(scene / "out" / "low_both.png");
  EXPECT_EQ(both.at(8, 8)[1], near.at(8, 8)[0]);
  ASSERT_EQ(bake(scene, {"--maps", "ao", "--ao-distance", "5%", "--ao-rays", "8"}).exit_code, 0);
  EXPECT_EQ(load_image(scene / "out" / "low_ao.png").pixels, near.pixels);
  ASSERT_EQ(bake(scene, {"--maps", "ao", "--ao-rays", "4"}).exit_code, 0);
  EXPECT_EQ(load_image(scene / "out" / "low_ao.png").pixels, ao.pixels);
}

TEST(MapsCommand, AnotherColorIsOfTheSamePictures) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  ASSERT_EQ(bake(scene, {"--maps", "color"}).exit_code, 0);
  const Image color = load_image(scene / "out" / "low_color.png");
  ASSERT_EQ(bake(scene, {"--maps", "base=color"}).exit_code, 0);
  EXPECT_EQ(load_image(scene / "out" / "low_base.png").pixels, color.pixels);
}

TEST(MapsCommand, FindsWhatMaterialsName) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult result =
      bake(scene, {"--maps", "color,opacity,id", "--id-by", "material", "--transfer",
                   "mtl:roughness", "--pack", "mix=roughness,opacity,1", "--format", "png8"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Image color = load_image(scene / "out" / "low_color.png");
  EXPECT_NEAR(color.at(2, 8)[0], 1, 1e-6);
  EXPECT_NEAR(color.at(2, 8)[1], 0, 1e-6);
  // Kd is linear light, the file sRGB.
  EXPECT_NEAR(color.at(13, 8)[1], std::lround(255 * 0.735357) / 255.0, 1e-6);
  const Image mix = load_image(scene / "out" / "low_mix.png");
  ASSERT_EQ(mix.channels, 3U);
  EXPECT_NEAR(mix.at(2, 8)[0], 0.75, 0.003);
  EXPECT_NEAR(mix.at(13, 8)[0], 0.25, 0.003);
  EXPECT_NEAR(mix.at(2, 8)[1], 1, 1e-6);
  EXPECT_NEAR(mix.at(13, 8)[1], 0.25, 0.003);
  EXPECT_EQ(mix.at(13, 8)[2], 1);
  const json ids = report_of(scene)["ids"];
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(ids[1]["name"], "glass");
  EXPECT_EQ(ids[1]["triangles"], 2);
  const Image id = load_image(scene / "out" / "low_id.png");
  EXPECT_NEAR(id.at(13, 8)[0], ids[1]["color"][0].get<double>(), 1e-6);
  EXPECT_NE(ids[0]["color"], ids[1]["color"]);
}

/// Roughness is one number: a block format of one channel holds it, and packs take it by any channel's name.
TEST(MapsCommand, HoldsRoughnessInOneChannel) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  ASSERT_EQ(bake(scene, {"--transfer", "mtl:roughness", "--format", "dds"}).exit_code, 0);
  std::ifstream file(scene / "out" / "low_roughness.dds", std::ios::binary);
  file.seekg(128);  // the first word of DDS_HEADER_DXT10: DXGI_FORMAT
  EXPECT_EQ(file.get(), 80) << "BC4_UNORM";
  ASSERT_EQ(bake(scene, {"--maps", "mask", "--transfer", "mtl:roughness", "--pack",
                         "mix=roughness.g,roughness,mask", "--format", "png8"})
                .exit_code,
            0);
  EXPECT_EQ(load_image(scene / "out" / "low_roughness.png").channels, 1U);
  const Image mix = load_image(scene / "out" / "low_mix.png");
  EXPECT_NEAR(mix.at(2, 8)[0], 0.75, 0.003);
  EXPECT_EQ(mix.at(2, 8)[0], mix.at(2, 8)[1]);
}

/// A file as Blender writes it of a material without its extensions, and what nobody wrote.
TEST(MapsCommand, ConvertsMaterialsAndSaysSo) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  std::ofstream(scene / "high.mtl")
      << "# Blender 5.0.1 MTL File: 'None'\nnewmtl brick\nNs 422.5\nKa 1 1 1\nillum 2\n"
         "map_Bump -bm 1.000000 C:\\proj\\tilt.png\nnewmtl glass\nNs 422.5\nKa 1 1 1\nillum 2\n";
  fs::create_directory(scene / "tex");
  // A normal that leans 30 degrees along u: (sin, 0, cos) as n/2 + 1/2.
  save_image({1, 1, 3, {0.75F, 0.5F, 0.933F}}, scene / "tex" / "tilt.png", {ImageFormat::png16});
  const ProcessResult result =
      bake(scene, {"--maps", "mask", "--transfer", "mtl:normals", "--transfer", "mtl:roughness",
                   "--transfer", "mtl:metallic", "--format", "png16"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* word :
       {"1 - sqrt(Ns / 1000)", "high.mtl: line 2", "tilt.png' is used", "illum"}) {
    EXPECT_NE(result.errors.find(word), std::string::npos) << word << " in " << result.errors;
  }
  const Image normals = load_image(scene / "out" / "low_normals.png");
  EXPECT_NEAR(normals.at(3, 8)[0], 0.75, 0.002);
  EXPECT_NEAR(normals.at(3, 8)[1], 0.5, 0.002);
  EXPECT_NEAR(normals.at(3, 8)[2], 0.933, 0.002);
  EXPECT_NEAR(normals.at(13, 8)[2], 1, 0.002);
  EXPECT_NEAR(load_image(scene / "out" / "low_roughness.png").at(3, 8)[0], 0.35, 0.0001);
  EXPECT_EQ(load_image(scene / "out" / "low_metallic.png").at(3, 8)[0], 0);
  expect_exit(bake(scene, {"--transfer", "mtl:emission"}), 3, {"emission", "map_Ke", "high.mtl"});
  expect_exit(bake(scene, {"--maps", "color"}), 3, {"colour", "map_Kd", "high.mtl"});
  std::ofstream(scene / "high.mtl") << "newmtl brick\nmap_roughness r.png\nnewmtl glass\n";
  expect_exit(bake(scene, {"--transfer", "mtl:roughness"}), 3,
              {"roughness", "line 2: map_roughness"});
}

TEST(MapsCommand, TransparentPartsAreNotThere) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  ASSERT_EQ(bake(scene, {"--maps", "mask", "--alpha-test", "0.5"}).exit_code, 0);
  const Image mask = load_image(scene / "out" / "low_mask.png");
  EXPECT_EQ(*mask.at(2, 8), 1);
  EXPECT_EQ(*mask.at(13, 8), 0);
  const auto says_idle = [&] {
    const json warnings = report_of(scene)["warnings"];
    return std::any_of(warnings.begin(), warnings.end(),
                       [](const json& warning) { return warning["code"] == "alpha-test-idle"; });
  };
  EXPECT_FALSE(says_idle());
  save_image({2, 2, 1, std::vector<float>(4, 1)}, scene / "opaque.png", {ImageFormat::png8});
  const std::string opaque = (scene / "opaque.png").string() + ":opacity";
  const ProcessResult idle =
      bake(scene, {"--maps", "mask", "--alpha-test", "0.5", "--transfer", opaque});
  ASSERT_EQ(idle.exit_code, 0) << idle.errors;
  EXPECT_TRUE(says_idle());
}

TEST(MapsCommand, WritesLayersAndErrors) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult result =
      bake(scene, {"--maps", "normal,height,id", "--layers", "--format", "exr", "--report-error"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_TRUE(fs::exists(scene / "out" / "low_layers.exr"));
  EXPECT_FALSE(fs::exists(scene / "out" / "low_normal.exr"));
  const json errors = report_of(scene)["errors"];
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0]["map"], "normal");
  EXPECT_EQ(errors[0]["unit"], "degrees");
  EXPECT_LT(errors[0]["rms"].get<double>(), 1e-3);
  EXPECT_NE(result.output.find("error of height"), std::string::npos) << result.output;
}

/// Whatever sizes the pictures have, maps have the size of the bake.
TEST(MapsCommand, LayersOfPicturesOfDifferentSizes) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  save_image({5, 3, 1, std::vector<float>(15, 0.25F)}, scene / "small.exr",
             {ImageFormat::exr_float});
  save_image({64, 40, 3, std::vector<float>(7680, 0.5F)}, scene / "large.exr",
             {ImageFormat::exr_float});
  const ProcessResult result = bake(
      scene, {"--maps", "mask", "--layers", "--format", "exr32", "--transfer", scene / "small.exr",
              "--transfer", scene / "large.exr", "--transfer", "mtl:roughness"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  Imf::InputFile file((scene / "out" / "low_layers.exr").string().c_str());
  EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({0, 0}, {15, 15}));
  const std::vector<std::pair<const char*, float>> channels = {
      {"mask.Y", 1}, {"small.Y", 0.25F}, {"large.Y", 0.5F}, {"roughness.Y", 0.75F}};
  for (const auto& [name, expected] : channels) {
    EXPECT_NE(file.header().channels().findChannel(name), nullptr) << name;
    std::vector<float> read(256, -1);
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, read.data(), Imath::V2i(0, 0), 16, 16));
    file.setFrameBuffer(buffer);
    file.readPixels(0, 15);
    EXPECT_NEAR(read[8 * 16 + 2], expected, 1e-6) << name;
  }
}

TEST(MapsCommand, PicturesTellTheirRanges) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto bytes_of = [&](const std::string& file) {
    return test::read_file(scene / "out" / file);
  };
  const auto expect_text = [&](const std::string& file, const std::string& text) {
    EXPECT_NE(bytes_of(file).find(text), std::string::npos) << file << ": " << text;
  };
  const std::string range("tEXtRange\0", 10), unit("tEXtUnit\0", 9);
  expect_exit(bake(scene, {"--maps", "normal,height,curvature,position,slope,ao", "--ao-rays", "8",
                           "--range", "height=-0.25,0.3", "--curvature-radius", "0.25", "--pack",
                           "orm=ao,1,height,curvature", "--pack", "up=position.b,slope"}),
              0, {});
  expect_text("low_height.png", range + "-0.25 0.3");
  expect_text("low_height.png", unit + "world units");
  expect_text("low_curvature.png", range + "-4 4");
  expect_text("low_curvature.png", unit + "1 / world unit");
  // The square about 0, of a side of 1, is flat: one step about its only z.
  expect_text("low_position.png", range + "-0.5 0.5 -0.5 0.5 -0.1 0.1");
  expect_text("low_slope.png", range + "0 180");
  expect_text("low_orm.png", range + "0 1 0 1 -0.25 0.3 -4 4");
  expect_text("low_orm.png", unit + "1, 1, world units, 1 / world unit");
  expect_text("low_up.png", range + "-0.1 0.1 0 180");  // of the packed channel
  for (const char* file : {"low_normal.png", "low_ao.png"}) {
    EXPECT_EQ(bytes_of(file).find("tEXt"), std::string::npos) << file;
  }
  // OpenEXR holds values as they are.
  expect_exit(bake(scene, {"--maps", "height,ao", "--ao-rays", "8", "--format", "exr", "--force"}),
              0, {});
  const std::string attribute("unit\0string\0\x0b\0\0\0world units", 27);
  expect_text("low_height.exr", attribute);
  EXPECT_EQ(bytes_of("low_ao.exr").find("unit"), std::string::npos);
  expect_exit(bake(scene, {"--maps", "height,ao", "--ao-rays", "8", "--format", "exr", "--layers"}),
              0, {});
  expect_text("low_layers.exr", "height." + attribute);
}

TEST(MapsCommand, TakesMapsOfYourOwn) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::string file = scene / "mine.cl";
  std::ofstream(file) << "float4 kiln_map(const kiln_point* p) {\n  return (float4)(0.25f);\n}\n";
  ASSERT_EQ(bake(scene, {"--maps", "mask,mine=" + file, "--format", "png8"}).exit_code, 0);
  EXPECT_NEAR(load_image(scene / "out" / "low_mine.png").at(3, 3)[0], 0.25, 0.003);
  std::ofstream(file) << "float4 kiln_map(const kiln_point* p) {\n  return;\n}\n";
  fs::remove_all(scene / "out");
  const ProcessResult broken = bake(scene, {"--maps", "mine=" + file});
  expect_exit(broken, 3, {"mine.cl:2"});
  // It is the source's fault, so nothing is tried anew, and no cache is blamed.
  EXPECT_EQ(broken.errors.find("once more"), std::string::npos) << broken.errors;
  EXPECT_EQ(broken.errors.find("second time"), std::string::npos) << broken.errors;
  EXPECT_EQ(broken.errors.find("cache"), std::string::npos) << broken.errors;
  for (const char* source : {"float4 kiln_map(const kiln_point* p) {\n}\n",  // gives nothing
                             "float4 other(const kiln_point* p) { return (float4)(1.0f); }\n"}) {
    std::ofstream(file) << source;
    expect_exit(bake(scene, {"--maps", "mine=" + file}), 3, {"mine.cl"});
    EXPECT_FALSE(fs::exists(scene / "out" / "low_mine.png"));
  }
  EXPECT_FALSE(fs::exists(scene / "out" / "low_mine.png"));
  expect_exit(bake(scene, {"--maps", "mine=nowhere.cl"}), 3, {"nowhere.cl"});
  expect_exit(bake(scene, {"--maps", "normal=" + file}), 2, {"normal"});
  // It never returns: the command still ends, soon after a signal.
  std::ofstream(file) << "float4 kiln_map(const kiln_point* p) {\n"
                         "  volatile float x = p->distance;\n  while (x < 1e30f) {}\n"
                         "  return (float4)(x);\n}\n";
  test::ProcessOptions options;
  options.environment = {{"POCL_MAX_PTHREAD_COUNT", "1"}};
  options.interrupt_after_processor_seconds = 1.2;  // the rest takes less than one
  const ProcessResult endless =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "endless", "--size",
                "16", "--maps", "mine=" + file},
               options);
  EXPECT_EQ(endless.exit_code, 130) << endless.errors;
  EXPECT_GT(endless.seconds_after_signal, 0);
  EXPECT_LT(endless.seconds_after_signal, 3);
}

TEST(MapsCommand, RefusesWhatIsNotThere) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::string brick = scene / "brick.png";
  expect_exit(bake(scene, {"--pack", "orm=ao,roughness,metallic"}), 2, {"'ao'"});
  expect_exit(bake(scene, {"--maps", "ao", "--pack", "orm=ao.g"}), 2, {"1 channels"});
  expect_exit(bake(scene, {"--maps", "ao", "--pack", "orm"}), 2, {"NAME=MAP"});
  expect_exit(bake(scene, {"--maps", "ao", "--pack", "ao=ao"}), 2, {"another file"});
  expect_exit(bake(scene, {"--layers"}), 2, {"--format exr"});
  expect_exit(bake(scene, {"--transfer", "nowhere.png"}), 3, {"nowhere.png"});
  expect_exit(bake(scene, {"--transfer", "mtl:shine"}), 2, {"mtl:color"});
  for (const char* words : {"mtl:roughness:rough", "mtl:roughness:srbg", "mtl:color:x:linear"}) {
    expect_exit(bake(scene, {"--transfer", words}), 2, {"is no colour space"});
  }
  expect_exit(bake(scene, {"--transfer", brick + ":wall:srbg"}), 2, {"'srbg' is no colour space"});
  expect_exit(bake(scene, {"--transfer", brick + ":wall:"}), 2, {"linear"});
  expect_exit(bake(scene, {"--transfer", brick + ":ao:srgb"}), 2, {"'ao'"});
  expect_exit(bake(scene, {"--transfer", brick, "--transfer", brick}), 2, {"brick"});
  // Longer than any file's name; the second would be asked for 40,000 times, each a path of many parts.
  expect_exit(bake(scene, {"--transfer", std::string(5000, 'a')}), 5, {"aaa", "too long"});
  std::string many = "a";
  for (int i = 0; i < 40'000; ++i) many += ":/b";
  expect_exit(bake(scene, {"--transfer", many + ":"}), 3, {"a:/b"});
  expect_exit(bake(scene, {"--id-by", "group"}), 2, {"--maps id"});
  expect_exit(bake(scene, {"--maps", "id", "--id-by", "object"}), 3, {"objects"});
  expect_exit(bake(scene, {"--light", "1,0,0"}), 2, {"--maps shadow"});
  expect_exit(bake(scene, {"--ao-error", "0.01"}), 2, {"--maps ao"});
  fs::resize_file(brick, 40);
  expect_exit(bake(scene, {"--maps", "color"}), 3, {"brick.png"});
  fs::remove(scene / "high.mtl");
  expect_exit(bake(scene, {"--maps", "color"}), 3, {"high.mtl"});
  EXPECT_FALSE(fs::exists(scene / "out" / "low_color.png"));
}

// Pictures that cannot be baked: one message, exit code 3, and no map.
TEST(MapsCommand, RefusesBadPictures) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::string brick = scene / "brick.png";
  const auto refuse = [&](const Words& more, const std::string& word) {
    const ProcessResult result = bake(scene, more);
    expect_exit(result, 3, {word});
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_TRUE(!fs::exists(scene / "out") || fs::is_empty(scene / "out"));
  };
  std::ofstream(scene / "empty.png");
  refuse({"--transfer", scene / "empty.png"}, "empty");
  std::ofstream(scene / "words.png") << "no picture";
  refuse({"--transfer", scene / "words.png"}, "words.png");
  const std::string whole = test::read_file(brick);
  std::ofstream(scene / "cut.png", std::ios::binary) << whole.substr(0, whole.size() - 20);
  refuse({"--transfer", scene / "cut.png"}, "truncated");
  // 100,000 x 1 texels by its header alone: refused before anything is taken for it.
  std::string wide = whole;
  const std::string size("\x00\x01\x86\xa0\x00\x00\x00\x01", 8);
  wide.replace(16, 8, size);
  std::ofstream(scene / "wide.png", std::ios::binary) << wide;
  refuse({"--transfer", scene / "wide.png"}, "wide.png");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  save_image({2, 1, 3, {nan, 0, 1, 1, 0, 0}}, scene / "nan.exr", {ImageFormat::exr_float});
  const ProcessResult holes = bake(scene, {"--transfer", scene / "nan.exr"});
  EXPECT_EQ(holes.exit_code, 0) << holes.errors;
  EXPECT_NE(holes.errors.find("1 number that is NaN"), std::string::npos) << holes.errors;
  fs::remove_all(scene / "out");
  // Materials that name themselves, and a picture that is a file of materials.
  std::ofstream(scene / "high.mtl") << "mtllib high.mtl\nnewmtl brick\nmap_Kd high.mtl\n";
  refuse({"--maps", "color"}, "high.mtl");
  // No UVs for the picture to lie over.
  Mesh bare = test::plane(2, 1);
  bare.uvs.clear();
  bare.uv_triangles.clear();
  save_obj(bare, scene / "high.obj");
  refuse({"--transfer", brick}, "no UVs");
}

TEST(MapsCommand, DrawsMapsOverTheMesh) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  ASSERT_EQ(bake(scene, {"--maps", "normal,color,ao", "--ao-rays", "8"}).exit_code, 0);
  const std::string color = scene / "out" / "low_color.png", low = scene / "low.obj";
  const std::string picture = scene / "picture.png";
  const Words front = {"--view", "0,0", "--size", "64", "--out", picture};
  const auto render = [&](Words words) {
    words.insert(words.begin(), {"render", low});
    words.insert(words.end(), front.begin(), front.end());
    return call_kiln(words);
  };
  ASSERT_EQ(render({"--show", color, "--show", scene / "out" / "low_ao.png"}).exit_code, 0);
  const Image sheet = load_image(picture);
  EXPECT_GT(sheet.width, 128U);
  ASSERT_EQ(render({"--color", color, "--occlusion", scene / "out" / "low_ao.png"}).exit_code, 0);
  const Image lit = load_image(picture);
  const float* red = lit.at(lit.width / 4, lit.height / 2);
  EXPECT_GT(red[0], 0.3F);
  EXPECT_LT(red[1], 0.05F) << "brick is red";
  expect_exit(render({"--show", color, "--normal", color}), 2, {"--show"});
}

TEST(MapsCommand, LightensEdgesAndDarkensCavities) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto draw = [&](const Words& more) {
    Words words = {"render", scene / "low.obj", "--view", "0,0",   "--size",
                   "64",     "--ambient-rays",  "0",      "--out", scene / "picture.png"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return load_image(scene / "picture.png");
  };
  // Quarters of the square: the strongest edge, half of it, flat, and the strongest cavity.
  Image map{64, 1, 1, {}};
  for (const float value : {0.75F, 0.625F, 0.5F, 0.25F}) {
    map.pixels.insert(map.pixels.end(), 16, value);
  }
  save_image(map, scene / "bend.png", {ImageFormat::png16});
  const Image plain = draw({}), bent = draw({"--curvature", scene / "bend.png"});
  const auto light = [](float value) { return std::pow((value + 0.055) / 1.055, 2.4); };
  const auto at = [](const Image& image, std::size_t quarter) {
    return image.at(image.width * (2 * quarter + 1) / 8, image.height / 2);
  };
  const std::array<double, 4> factors = {1.5, 1.25, 1, 0.75};
  for (std::size_t quarter = 0; quarter < factors.size(); ++quarter) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double before = light(at(plain, quarter)[c]), after = light(at(bent, quarter)[c]);
      ASSERT_LT(before * 1.5, 1) << "nothing is clamped";
      EXPECT_NEAR(after / before, factors[quarter], 0.025) << quarter << " " << c;
    }
  }
  // Neither units nor what lies beyond the strongest 5% matter; numbers that are NaN are flat.
  for (float& value : map.pixels) value = 40 * value - 20;
  map.pixels[40] = std::numeric_limits<float>::quiet_NaN();
  map.pixels[0] = 1000;
  save_image(map, scene / "bend.exr", {ImageFormat::exr_float});
  const Image of_exr = draw({"--curvature", scene / "bend.exr"});
  for (std::size_t i = 0; i < of_exr.pixels.size(); ++i) {
    ASSERT_NEAR(of_exr.pixels[i], bent.pixels[i], 1.01 / 255) << i;
  }
  const auto refused = [&](const Words& more, int code, const std::string& word) {
    Words words = {"render", scene / "low.obj", "--out", scene / "picture.png"};
    words.insert(words.end(), more.begin(), more.end());
    expect_exit(call_kiln(words), code, {word});
  };
  refused({"--curvature", scene / "bend.png", "--flat"}, 2, "--curvature");
  refused({"--curvature", scene / "bend.png", "--show", scene / "bend.png"}, 2, "--curvature");
  refused({"--curvature", scene / "none.png"}, 3, "none.png");
  refused({"--curvature", scene / "brick.png"}, 3, "grey");
  refused({"--curvature", scene / "picture.png"}, 2, "picture.png");
}

}  // namespace
}  // namespace kiln
