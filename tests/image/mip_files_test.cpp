// Files of mip-maps: every level comes back, and a full disk leaves none.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfTiledInputFile.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <random>

#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

Image noise(std::uint32_t width, std::uint32_t height, unsigned seed) {
  Image image{width, height, 3, std::vector<float>(std::size_t{width} * height * 3)};
  std::mt19937 random(seed);
  for (float& value : image.pixels) value = static_cast<float>(random() % 4097) / 2048 - 1;
  return image;
}

std::vector<Image> noise_mips(std::uint32_t width, std::uint32_t height) {
  std::vector<Image> mips;
  while (width > 1 || height > 1) {
    width = std::max(1U, width / 2);
    height = std::max(1U, height / 2);
    mips.push_back(noise(width, height, width));
  }
  return mips;
}

TEST(SaveMipmapped, EveryLevelComesBackAndLevel0ToAnyone) {
  const std::filesystem::path folder = test::scratch_folder();
  for (const ImageFormat format : {ImageFormat::exr_half, ImageFormat::exr_float}) {
    for (const auto& [width, height] :
         {std::pair{1U, 1U}, {64U, 64U}, {300U, 700U}, {513U, 1U}, {1U, 130U}}) {
      const Image image = noise(width, height, 0);
      const std::vector<Image> mips = noise_mips(width, height);
      const std::filesystem::path path = folder / "mips.exr";
      save_mipmapped(image, mips, path, {.format = format});
      EXPECT_EQ(load_image(path).pixels, image.pixels);

      Imf::TiledInputFile file(path.c_str());
      ASSERT_EQ(file.levelMode(), Imf::MIPMAP_LEVELS);
      ASSERT_EQ(static_cast<std::size_t>(file.numLevels()), mips.size() + 1);
      for (int level = 0; level < file.numLevels(); ++level) {
        const Image& expected = level == 0 ? image : mips[static_cast<std::size_t>(level) - 1];
        ASSERT_EQ(file.levelWidth(level), static_cast<int>(expected.width));
        ASSERT_EQ(file.levelHeight(level), static_cast<int>(expected.height));
        Image found = expected;
        std::fill(found.pixels.begin(), found.pixels.end(), 99.0F);
        Imf::FrameBuffer buffer;
        for (std::size_t c = 0; c < 3; ++c) {
          buffer.insert(std::array{"R", "G", "B"}[c],
                        Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&found.pixels[c]), 12,
                                   12 * std::size_t{expected.width}));
        }
        file.setFrameBuffer(buffer);
        file.readTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
        EXPECT_EQ(found.pixels, expected.pixels) << "level " << level;
      }
    }
  }
}

TEST(SaveMipmapped, GivesTheSameBytesOnAnyNumberOfThreads) {
  const std::filesystem::path folder = test::scratch_folder();
  const Image image = noise(513, 300, 1);
  const std::vector<Image> mips = noise_mips(513, 300);
  save_mipmapped(image, mips, folder / "1.exr", {.threads = 1});
  save_mipmapped(image, mips, folder / "2.exr", {.threads = 2});
  EXPECT_TRUE(test::read_file(folder / "1.exr") == test::read_file(folder / "2.exr"));
}

TEST(SaveMipmapped, RefusesWhatItCannotHoldBeforeAnythingIsWritten) {
  const std::filesystem::path path = test::scratch_folder() / "mips.exr";
  const Image image = noise(8, 4, 0);
  const std::vector<Image> good = noise_mips(8, 4);
  const auto code = [&](const std::vector<Image>& mips, ImageFormat format) {
    try {
      save_mipmapped(image, mips, path, {.format = format});
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code(good, ImageFormat::png16), ErrorCode::usage);
  EXPECT_EQ(code({}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[1]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[2], good[1]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[1], good[2], good[2]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(SaveMipmapped, AFullDiskLeavesNoFile) {
  std::signal(SIGXFSZ, SIG_IGN);
  const std::filesystem::path folder = test::scratch_folder();
  const Image image = noise(256, 200, 0);
  const std::vector<Image> mips = noise_mips(256, 200);
  save_mipmapped(image, mips, folder / "whole.exr");
  const std::uintmax_t size = std::filesystem::file_size(folder / "whole.exr");
  std::filesystem::remove(folder / "whole.exr");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  for (const std::uintmax_t share : {std::uintmax_t{1}, size / 2, size - 1}) {
    rlimit limit = before;
    limit.rlim_cur = share;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    EXPECT_THROW(save_mipmapped(image, mips, folder / "map.exr"), Error) << share;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
  }
}

}  // namespace
}  // namespace kiln
