// Files of several layers.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

Image counting(std::uint32_t width, std::uint32_t height, std::uint32_t channels, float first) {
  Image image{width, height, channels, {}};
  for (std::size_t i = 0; i < std::size_t{width} * height * channels; ++i) {
    image.pixels.push_back(first + static_cast<float>(i % 1024));
  }
  return image;
}

TEST(Layers, EachChannelIsReadBackByItsName) {
  // More than one band of rows, and a part of one.
  const Image one = counting(7, 300, 1, 0), three = counting(7, 300, 3, 5),
              four = counting(7, 300, 4, 9);
  const std::vector<ImageLayer> layers = {{"ao", &one}, {"normal", &three}, {"mine", &four}};
  const auto path = test::scratch_folder() / "layers.exr";
  for (const ImageFormat format : {ImageFormat::exr_float, ImageFormat::exr_half}) {
    save_layers(layers, path, {.format = format});
    Imf::InputFile file(path.string().c_str());
    std::size_t channels = 0;
    for (auto it = file.header().channels().begin(); it != file.header().channels().end(); ++it) {
      ++channels;
    }
    EXPECT_EQ(channels, 8U);
    const auto expect = [&](const char* name, const Image& image, std::size_t channel) {
      std::vector<float> read(7 * 300);
      Imf::FrameBuffer buffer;
      buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, read.data(), Imath::V2i(0, 0), 7, 300));
      file.setFrameBuffer(buffer);
      file.readPixels(0, 299);
      for (std::size_t i = 0; i < read.size(); ++i) {
        ASSERT_EQ(read[i], image.pixels[i * image.channels + channel]) << name << " " << i;
      }
    };
    expect("ao.Y", one, 0);
    expect("normal.R", three, 0);
    expect("normal.B", three, 2);
    expect("mine.A", four, 3);
  }
}

TEST(Layers, RefusesWhatIsNoFileOfLayers) {
  const Image small = counting(4, 4, 1, 0), large = counting(5, 4, 1, 0);
  const auto path = test::scratch_folder() / "layers.exr";
  const auto code = [&](std::vector<ImageLayer> layers, ImageFormat format) {
    try {
      save_layers(layers, path, {.format = format});
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code({{"a", &small}, {"b", &large}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{"a", &small}, {"a", &small}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{"a.b", &small}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{"", &small}}, ImageFormat::exr_half), ErrorCode::usage);
  // OpenEXR would end the names at the 0, and "a.R" stand for both.
  EXPECT_EQ(code({{std::string("a\0b", 3), &small}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{std::string(129, 'a'), &small}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{"a", nullptr}}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({{"a", &small}}, ImageFormat::png8), ErrorCode::usage);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_EQ(code({{std::string(128, 'a'), &small, {}, {{std::string(79, 'k'), "text"}}}},
                 ImageFormat::exr_half),
            ErrorCode::internal);
}

/// What is refused is said of the layer that it is, here the second of three.
TEST(Layers, RefusalsNameTheLayer) {
  const Image good = counting(4, 3, 2, 0);
  const auto path = test::scratch_folder() / "layers.exr";
  const auto refusal = [&](const Image* image) -> std::string {
    const std::vector<ImageLayer> layers = {{"first", &good}, {"second", image}, {"third", &good}};
    try {
      save_layers(layers, path, {.format = ImageFormat::exr_half});
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(&good), "");
  const std::string mismatch =
      "The layer 'second' has no pixels, or their number does not match its size.";
  EXPECT_NE(refusal(nullptr).find(mismatch), std::string::npos);
  for (const auto& [width, height, channels, values] :
       {std::array<std::uint32_t, 4>{0, 3, 2, 0}, std::array<std::uint32_t, 4>{4, 0, 2, 0},
        std::array<std::uint32_t, 4>{4, 3, 0, 0}, std::array<std::uint32_t, 4>{4, 3, 5, 60},
        std::array<std::uint32_t, 4>{4, 3, 2, 23}, std::array<std::uint32_t, 4>{4, 3, 2, 25}}) {
    const Image bad{width, height, channels, std::vector<float>(values)};
    EXPECT_NE(refusal(&bad).find(mismatch), std::string::npos) << width << ' ' << height;
  }
  for (const auto& [width, height] : {std::pair{5U, 3U}, std::pair{4U, 2U}}) {
    const Image other = counting(width, height, 2, 0);
    const std::string size = std::to_string(width) + " x " + std::to_string(height);
    const std::string text = refusal(&other);
    EXPECT_NE(text.find("Layers must be of one size, but there are "), std::string::npos) << text;
    EXPECT_NE(text.find("4 x 3"), std::string::npos) << text;
    EXPECT_NE(text.find(size), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace kiln
