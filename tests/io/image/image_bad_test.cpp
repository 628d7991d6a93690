// Images that cannot be read or written: damaged files, impossible sizes, a full disk.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "io/image/image_samples.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::kFormats;
using test::noise;

void put(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string error_of(ErrorCode code, const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(ImageIo, UnreadableFilesAreNamed) {
  const fs::path folder = test::scratch_folder();
  const auto message = [&](const fs::path& path) {
    const std::string text = error_of(ErrorCode::input, [&] { load_image(path); });
    EXPECT_NE(text.find(path.string()), std::string::npos) << text;
    return text;
  };
  EXPECT_NE(message(folder / "missing.png").find("no such file"), std::string::npos);
  EXPECT_NE(message(folder).find("directory"), std::string::npos);
  put(folder / "empty.png", "");
  EXPECT_NE(message(folder / "empty.png").find("empty"), std::string::npos);
  put(folder / "text.png", "This is no image.");
  EXPECT_NE(message(folder / "text.png").find("none of the kinds that Kiln reads (PNG, OpenEXR"),
            std::string::npos);
  put(folder / "short.png", "\x89P");
  message(folder / "short.png");
}

TEST(ImageIo, ImpossibleSizesAreRefused) {
  const fs::path path = test::scratch_folder() / "image.png";
  for (const Image& image :
       {Image{}, Image{0, 1, 1, {}}, Image{1, 1, 0, {}}, Image{1, 1, 5, {1, 2, 3, 4, 5}},
        Image{2, 2, 1, {1, 2, 3}}, Image{70000, 1, 1, std::vector<float>(70000)}}) {
    for (const ImageFormat format : kFormats) {
      error_of(ErrorCode::usage, [&] { save_image(image, path, {.format = format}); });
    }
  }
  error_of(ErrorCode::usage, [&] { save_image(Image{1, 1, 1, {0}}, path, {.threads = -1}); });
  EXPECT_FALSE(fs::exists(path));
}

TEST(ImageIo, AFullDiskLeavesNoFile) {
  std::signal(SIGXFSZ, SIG_IGN);
  const fs::path folder = test::scratch_folder();
  const Image image = noise(400, 300, 3, 1);
  for (const ImageFormat format : kFormats) {
    save_image(image, folder / "whole", {.format = format});
    const std::uintmax_t size = fs::file_size(folder / "whole");
    fs::remove(folder / "whole");
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    for (const std::uintmax_t share : {std::uintmax_t{1}, size / 2, size - 1}) {
      rlimit limit = before;
      limit.rlim_cur = share;
      ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
      const std::string text = error_of(
          ErrorCode::output, [&] { save_image(image, folder / "map", {.format = format}); });
      ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
      EXPECT_NE(text.find("map"), std::string::npos) << text;
      EXPECT_NE(text.find("File too large"), std::string::npos) << text;
      EXPECT_TRUE(fs::is_empty(folder));
    }
  }
  if (fs::exists("/dev/full")) {
    const std::string text = error_of(
        ErrorCode::output, [&] { save_image(image, "/dev/full", {.format = ImageFormat::png16}); });
    EXPECT_NE(text.find("No space left"), std::string::npos) << text;
  }
}

// Damaged files give an error or an image, never a crash, a hang or gigabytes.
class DamagedImages : public testing::TestWithParam<ImageFormat> {
 protected:
  // Valid images or Error(input); returns whether it was read.
  bool try_load(const std::string& bytes) {
    put(path_, bytes);
    try {
      const Image image = load_image(path_);
      EXPECT_EQ(image.pixels.size(), std::size_t{image.width} * image.height * image.channels);
      return true;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      EXPECT_NE(std::string(error.what()).find(path_.string()), std::string::npos) << error.what();
      return false;
    }
  }
  fs::path path_ = test::scratch_folder() / "damaged";
};

std::string format_name(const testing::TestParamInfo<ImageFormat>& test_case) {
  constexpr std::array kNames = {"ExrHalf", "ExrFloat", "Png16", "Png8"};
  return kNames[static_cast<std::size_t>(test_case.param)];
}
INSTANTIATE_TEST_SUITE_P(Formats, DamagedImages, testing::ValuesIn(kFormats), format_name);

TEST_P(DamagedImages, TruncatedAnywhereAreErrors) {
  const Image image = noise(37, 70, 3, 2);
  save_image(image, path_, {.format = GetParam()});
  const std::string whole = test::read_file(path_);
  for (std::size_t length = 0; length < whole.size();
       length += length < 600 ? 1 : whole.size() / 150 + 1) {
    EXPECT_FALSE(try_load(whole.substr(0, length))) << length << " of " << whole.size();
  }
  EXPECT_FALSE(try_load(whole.substr(0, whole.size() - 1)));
  EXPECT_TRUE(try_load(whole));
}

TEST_P(DamagedImages, FlippedBytesNeverCrash) {
  save_image(noise(23, 40, 3, 3), path_, {.format = GetParam()});
  const std::string whole = test::read_file(path_);
  std::mt19937 random(11);
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = whole;
    const int flips = 1 + i % 3;
    for (int k = 0; k < flips; ++k) {
      // Mostly in the header, where sizes are.
      const std::size_t range =
          i % 2 == 0 ? std::min<std::size_t>(400, bytes.size()) : bytes.size();
      bytes[random() % range] = static_cast<char>(random());
    }
    if (!try_load(bytes)) ++refused;
  }
  EXPECT_GT(refused, 300);
}

// One large word at every place of the header: sizes, counts, types.
TEST_P(DamagedImages, HugeNumbersInTheHeaderTakeNoMemory) {
  save_image(noise(23, 40, 3, 3), path_, {.format = GetParam()});
  const std::string whole = test::read_file(path_);
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  for (const char* word :
       {"\xff\xff\xff\x7f", "\x7f\xff\xff\xff", "\xff\xff\0\0", "\0\0\xff\xff"}) {
    for (std::size_t at = 8; at < std::min<std::size_t>(400, whole.size() - 4); ++at) {
      std::string bytes = whole;
      bytes.replace(at, 4, std::string(word, 4));
      try_load(bytes);
    }
  }
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 1 << 20) << "KiB";
}

TEST(ImageIo, AHeaderThatPromisesTooMuchIsRefused) {
  const fs::path path = test::scratch_folder() / "image.png";
  save_image(noise(8, 8, 3, 1), path, {.format = ImageFormat::png16});
  std::string bytes = test::read_file(path);
  // Width and height of 60000, with the right checksum.
  for (const std::size_t at : {std::size_t{16}, std::size_t{20}}) {
    bytes.replace(at, 4, std::string("\x00\x00\xea\x60", 4));
  }
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= static_cast<unsigned char>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  crc = ~crc;
  for (std::size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<char>(crc >> (24 - 8 * i));
  put(path, bytes);
  const std::string text = error_of(ErrorCode::input, [&] { load_image(path); });
  EXPECT_NE(text.find("60000 x 60000"), std::string::npos) << text;
}

TEST(ImageBad, WhatFuzzersFoundIsRefused) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(test::test_data("fuzz") / "exr")) {
    ++count;
    const std::string text = error_of(ErrorCode::input, [&] { load_image(entry.path()); });
    EXPECT_NE(text.find("bytes, which no chlist has"), std::string::npos)
        << entry.path() << ": " << text;
  }
  EXPECT_EQ(count, 2U);
}

}  // namespace
}  // namespace kiln
