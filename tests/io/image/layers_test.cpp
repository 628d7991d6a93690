// Files of several layers.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <string>
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

}  // namespace
}  // namespace kiln
