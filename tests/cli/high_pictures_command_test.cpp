// HIGH's pictures as other people's files name them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/image.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;
using Words = std::vector<std::string>;

struct Baked {
  ProcessResult result;
  Image map;
};

Baked bake_map(const fs::path& high, const fs::path& low, const Words& more,
               const std::string& name) {
  const fs::path out = test::scratch_folder() / "out";
  fs::remove_all(out);
  Words words = {"bake", high, low, "--out", out, "--size", "32", "--recall", "0"};
  words.insert(words.end(), more.begin(), more.end());
  Baked baked{call_kiln(words), {}};
  EXPECT_EQ(baked.result.exit_code, 0) << baked.result.errors;
  const fs::path map = out / (low.stem().string() + "_" + name + ".png");
  if (baked.result.exit_code == 0) baked.map = load_image(map);
  return baked;
}

TEST(HighPicturesCommand, UdimTilesShowOnTheirOwnSquares) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases/udim_high");
  const fs::path folder = *test::shared_data("cases/udim_high");
  const Image left = load_image(folder / "u.1001.png"), right = load_image(folder / "u.1002.png");
  const auto check = [&](const Baked& baked) {
    for (std::size_t c = 0; c < 3; ++c) {
      // A tile's texel is half as wide as one of the map.
      EXPECT_NEAR(baked.map.at(5, 10)[c], left.at(11, 10)[c], 1e-3);
      EXPECT_NEAR(baked.map.at(26, 10)[c], right.at(21, 10)[c], 1e-3);
    }
  };
  const fs::path high = folder / "udim.obj", low = folder / "low.obj";
  check(bake_map(high, low, {"--maps", "color"}, "color"));
  const std::string token = folder / "u.<UDIM>.png";
  const Baked named =
      bake_map(high, low, {"--maps", "color", "--transfer", token + ":color"}, "color");
  check(named);
  EXPECT_EQ(named.result.errors.find("udim"), std::string::npos) << named.result.errors;
  const std::string number = folder / "u.1001.png";
  const Baked guessed = bake_map(high, low, {"--transfer", number + ":skin"}, "skin");
  check(guessed);
  EXPECT_NE(guessed.result.errors.find("UDIM"), std::string::npos) << guessed.result.errors;
}

TEST(HighPicturesCommand, NormalMapsOfTwoChannelsAreRebuilt) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases/normals2");
  const fs::path folder = *test::shared_data("cases/normals2");
  const std::array<double, 3> right = {0.5, 0.3, 0.812};
  for (const char* file : {"nm_full.png", "bc5_blue0.png", "bc5_blue255.png", "dxt5nm.png"}) {
    const Words words = {"--transfer", (folder / file).string() + ":bumps:normal"};
    const Baked baked = bake_map(folder / "high.obj", folder / "low.obj", words, "bumps");
    for (std::size_t c = 0; c < 3; ++c) {
      // Two roundings to bytes, each half a step of 2/255.
      EXPECT_NEAR(2 * double{baked.map.at(16, 16)[c]} - 1, right[c], 0.008) << file;
    }
    const bool told = baked.result.errors.find("--high-normal-map") != std::string::npos;
    EXPECT_EQ(told, std::string(file) != "nm_full.png") << baked.result.errors;
    Words down = words;
    down.insert(down.end(), {"--high-normal-map", "two-channel-dx"});
    const Baked turned = bake_map(folder / "high.obj", folder / "low.obj", down, "bumps");
    EXPECT_NEAR(2 * double{turned.map.at(16, 16)[1]} - 1, -0.3, 0.008) << file;
  }
}

// A GLB whose picture is KTX 2 (KHR_texture_basisu), of bytes that can be read, and of Basis Universal.
TEST(HighPicturesCommand, GltfMayHavePicturesOfKtx2) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Image red{4, 4, 4, {}};
  for (int i = 0; i < 16; ++i) red.pixels.insert(red.pixels.end(), {1, 0, 0, 1});
  std::vector<std::byte> bytes;
  try {
    bytes = encode(red, {ImageFormat::ktx2, false, TextureUse::color});
  } catch (const Error&) {
    GTEST_SKIP() << "built without Zstandard";
  }
  const auto write = [&](const char* name) {
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  write("a.ktx2");
  bytes[12] = bytes[13] = std::byte{0};  // VK_FORMAT_UNDEFINED
  const auto descriptor = static_cast<std::size_t>(bytes[48]);
  bytes[descriptor + 12] = std::byte{166};
  write("b.ktx2");
  for (const char* picture : {"a.ktx2", "b.ktx2"}) {
    std::ofstream(folder / "h.gltf")
        << R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_texture_basisu"],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"mode":6,"material":0,"attributes":{"POSITION":0,"TEXCOORD_0":1}}]}],
"images":[{"uri":")"
        << picture << R"("}],"textures":[{"extensions":{"KHR_texture_basisu":{"source":0}}}],
"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1],"baseColorTexture":{"index":0}}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32}],
"buffers":[{"byteLength":80,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAgD8="}]})";
    const Baked baked =
        bake_map(folder / "h.gltf", folder / "h.gltf", {"--maps", "color"}, "color");
    const float* const color = baked.map.at(16, 16);
    EXPECT_NEAR(color[0], 1, 1e-3);
    const bool reads = std::string(picture) == "a.ktx2";
    EXPECT_NEAR(color[1], reads ? 0 : 0.7354, 1e-3) << picture;  // 0.5 in linear light
    EXPECT_EQ(baked.result.errors.find("UASTC") == std::string::npos, reads) << baked.result.errors;
  }
}

}  // namespace
}  // namespace kiln
