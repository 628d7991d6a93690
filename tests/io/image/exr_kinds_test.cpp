// Every kind of file that OpenEXR writes passes the checks before it: none is taken for damaged.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTileDescription.h>
#include <ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

constexpr int kWidth = 300;
constexpr int kHeight = 270;

/// One channel, all threes: what compresses best.
struct Flat {
  std::string pixels;
  Imf::FrameBuffer buffer;

  explicit Flat(const Imf::Header& header) {
    const Imf::PixelType type = header.channels().findChannel("Y")->type;
    const std::string bits = type == Imf::UINT   ? std::string("\x03\0\0\0", 4)
                             : type == Imf::HALF ? std::string("\0\x42", 2)
                                                 : std::string("\0\0\x40\x40", 4);
    for (int i = 0; i < kWidth * kHeight; ++i) pixels += bits;
    const Imath::Box2i window = header.dataWindow();
    const auto bytes = static_cast<std::ptrdiff_t>(bits.size());
    char* origin = pixels.data() - bytes * (window.min.x + std::ptrdiff_t{window.min.y} * kWidth);
    buffer.insert("Y", Imf::Slice(type, origin, bits.size(), bits.size() * kWidth));
  }
  Flat(const Flat&) = delete;
  Flat& operator=(const Flat&) = delete;
};

Imf::Header header_of(Imf::Compression compression, Imf::PixelType type = Imf::FLOAT) {
  Imf::Header header(kWidth, kHeight);
  header.compression() = compression;
  header.channels().insert("Y", Imf::Channel(type));
  return header;
}

/// \param within  how far values may be off: lossy kinds do not keep them
void expect_flat(const std::filesystem::path& path, float within = 0) {
  const Image image = load_image(path);
  EXPECT_EQ(image.width, static_cast<std::uint32_t>(kWidth));
  EXPECT_EQ(image.height, static_cast<std::uint32_t>(kHeight));
  EXPECT_TRUE(std::all_of(image.pixels.begin(), image.pixels.end(),
                          [&](float v) { return std::abs(v - 3) <= within; }));
}

TEST(ExrKinds, EveryCompressionOfScanLinesAndTiles) {
  const std::string path = (test::scratch_folder() / "flat.exr").string();
  for (int i = 0; i < 3 * Imf::NUM_COMPRESSION_METHODS; ++i) {
    SCOPED_TRACE(i);
    Imf::Header header =
        header_of(static_cast<Imf::Compression>(i / 3), static_cast<Imf::PixelType>(i % 3));
    const bool lossy = header.compression() == Imf::DWAA_COMPRESSION ||
                       header.compression() == Imf::DWAB_COMPRESSION;
    const float within = lossy ? 0.1F : 0.0F;
    const Flat flat(header);
    {
      Imf::OutputFile file(path.c_str(), header);
      file.setFrameBuffer(flat.buffer);
      file.writePixels(kHeight);
    }
    expect_flat(path, within);
    header.setTileDescription({64, 32, Imf::ONE_LEVEL});
    {
      Imf::TiledOutputFile file(path.c_str(), header);
      file.setFrameBuffer(flat.buffer);
      file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    }
    expect_flat(path, within);
  }
}

TEST(ExrKinds, LevelsOfTilesInAnyRounding) {
  const std::string path = (test::scratch_folder() / "levels.exr").string();
  for (const Imf::LevelMode mode : {Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS}) {
    for (const Imf::LevelRoundingMode rounding : {Imf::ROUND_DOWN, Imf::ROUND_UP}) {
      Imf::Header header = header_of(Imf::ZIP_COMPRESSION);
      header.setTileDescription({32, 64, mode, rounding});
      const Flat flat(header);
      {
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(flat.buffer);
        for (int y = 0; y < file.numYLevels(); ++y) {
          for (int x = 0; x < file.numXLevels(); ++x) {
            if (mode == Imf::MIPMAP_LEVELS && x != y) continue;
            file.writeTiles(0, file.numXTiles(x) - 1, 0, file.numYTiles(y) - 1, x, y);
          }
        }
      }
      expect_flat(path);
    }
  }
}

TEST(ExrKinds, RowsFromTheBottomAndWindowsBelowZero) {
  const std::string path = (test::scratch_folder() / "order.exr").string();
  Imf::Header header = header_of(Imf::PIZ_COMPRESSION);
  header.lineOrder() = Imf::DECREASING_Y;
  header.dataWindow() = header.displayWindow() =
      Imath::Box2i({-20, -130}, {kWidth - 21, kHeight - 131});
  const Flat flat(header);
  {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(flat.buffer);
    file.writePixels(kHeight);
  }
  expect_flat(path);
}

TEST(ExrKinds, TheFirstOfSeveralParts) {
  const std::string path = (test::scratch_folder() / "parts.exr").string();
  std::vector<Imf::Header> headers;
  for (const char* name : {"first", "second"}) {
    headers.push_back(header_of(Imf::ZIP_COMPRESSION));
    headers.back().setName(name);
    headers.back().setType(Imf::SCANLINEIMAGE);
  }
  const Flat flat(headers[0]);
  {
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 2);
    for (int part = 0; part < 2; ++part) {
      Imf::OutputPart output(file, part);
      output.setFrameBuffer(flat.buffer);
      output.writePixels(kHeight);
    }
  }
  expect_flat(path);
}

}  // namespace
}  // namespace kiln
