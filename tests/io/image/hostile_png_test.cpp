// PNGs whose header promises what their image data cannot hold.
#include <sys/stat.h>
#include <zlib.h>

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "hostile.h"
#include "io/image/image_reader.h"
#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::expect_words;

const std::string kSignature = "\x89PNG\r\n\x1a\n";

std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto* bytes = reinterpret_cast<const Bytef*>(body.data());
  return test::big_endian(static_cast<std::uint32_t>(data.size())) + body +
         test::big_endian(
             static_cast<std::uint32_t>(crc32(0, bytes, static_cast<uInt>(body.size()))));
}

std::string header(std::uint32_t width, std::uint32_t height, int bits, int colour,
                   int interlaced = 0) {
  std::string data = test::big_endian(width) + test::big_endian(height);
  for (const int value : {bits, colour, 0, 0, interlaced}) data += static_cast<char>(value);
  return kSignature + chunk("IHDR", data);
}

std::string deflated(const std::string& raw) {
  std::string packed(compressBound(raw.size()), '\0');
  uLongf size = packed.size();
  EXPECT_EQ(compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                      reinterpret_cast<const Bytef*>(raw.data()), raw.size(), 9),
            Z_OK);
  packed.resize(size);
  return packed;
}

std::string image_data(const std::string& raw) {
  return chunk("IDAT", deflated(raw)) + chunk("IEND", "");
}

std::string refusal(const std::string& bytes, const ImageLimits& limits = {}) {
  const test::AddressLimit limited;
  return test::refusal(
      bytes, [&](const ByteSource& source) { parse_image(source, "hostile.png", limits); });
}

TEST(HostilePng, LittleDataForAHugeHeader) {
  const std::string text = refusal(header(30000, 30000, 8, 2) + image_data("abc"));
  expect_words(text, {"IHDR", "30000 x 30000", "IDAT", "Export"});
  // The same of an interlaced one.
  expect_words(refusal(header(30000, 30000, 8, 2, 1) + image_data("abc")), {"IHDR", "IDAT"});
}

TEST(HostilePng, TextHoldsNoPixels) {
  const std::string note = chunk("tEXt", std::string("Comment") + '\0' + std::string(1100000, 'x'));
  for (const std::string& bytes : {header(20000, 20000, 8, 6) + note + image_data("abc"),
                                   header(20000, 20000, 8, 6) + image_data("abc") + note}) {
    expect_words(refusal(bytes), {"IHDR", "20000 x 20000", "IDAT"});
  }
}

TEST(HostilePng, TooManyPixelsAreRefusedBeforeTheyAreRead) {
  // 131 KB that hold 2^30 pixels.
  const std::string bytes =
      header(32768, 32768, 1, 0) + image_data(std::string((32768 / 8 + 1) * 32768, '\0'));
  EXPECT_LT(bytes.size(), 140000u);
  const std::clock_t start = std::clock();
  expect_words(refusal(bytes), {"IHDR", "32768 x 32768", "at most 1073741823", "Scale"});
  EXPECT_LT(std::clock() - start, 2 * CLOCKS_PER_SEC) << "reading them takes 25 s of the processor";
  expect_words(refusal(header(0, 5, 8, 0) + image_data("")), {"IHDR", "0 x 5"});
  expect_words(refusal(header(65537, 5, 8, 0) + image_data("")), {"IHDR", "65537 x 5"});
  expect_words(refusal(header(40, 40, 8, 0) + image_data(std::string(40 * 41, '\0')), {1599}),
               {"at most 1599"});
}

TEST(HostilePng, WhatMemoryCannotTakeIsRefused) {
#ifndef __SANITIZE_ADDRESS__
  // It holds what it says: 2^28 pixels of 4 floats, 4 GiB, of 33 KB.
  const std::string palette = chunk("PLTE", std::string(6, '\0')) + chunk("tRNS", "\1\2");
  const std::string bytes =
      header(16384, 16384, 1, 3) + palette + image_data(std::string((16384 / 8 + 1) * 16384, '\0'));
  expect_words(refusal(bytes), {"IHDR", "16384 x 16384", "MiB", "memory limit"});
#endif
}

TEST(HostilePng, TextsAreNotKept) {
  std::string bytes = header(1, 1, 8, 0);
  const std::string bomb =
      chunk("zTXt", std::string("Comment") + '\0' + '\0' + deflated(std::string(7900000, '\0')));
  for (int i = 0; i < 100; ++i) bytes += bomb;
  bytes += image_data(std::string(2, '\0'));
  const std::uint64_t before = test::peak_bytes();
  EXPECT_EQ(parse_image(*bytes_in_memory(bytes), "hostile.png").pixels, std::vector<float>{0});
  EXPECT_LT(test::peak_bytes() - before, std::uint64_t{200} << 20);
}

TEST(HostilePng, CutShortAnywhere) {
  for (const int interlaced : {0, 1}) {
    std::string raw;
    for (int i = 0; i < 9 * 40; ++i) raw += static_cast<char>(i % 9 == 0 ? 0 : i * 7);
    // Adam7's seven passes of 8 x 40.
    if (interlaced == 1) raw = std::string(10 + 10 + 15 + 30 + 50 + 100 + 180, '\0');
    const std::string whole =
        header(8, 40, 8, 0, interlaced) + chunk("tIME", "1234567") + image_data(raw);
    EXPECT_EQ(parse_image(*bytes_in_memory(whole), "hostile.png").height, 40u);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      SCOPED_TRACE(length);
      refusal(whole.substr(0, length));
    }
  }
}

TEST(HostilePng, ChunksThatReachBeyondTheFile) {
  std::string bytes = header(4, 4, 8, 0);
  bytes += test::big_endian(0xFFFFFFFFU) + "IDAT" + std::string(100, 'x');
  expect_words(refusal(bytes), {"chunk at byte 33", "truncated"});
  expect_words(refusal(header(4, 4, 8, 5) + image_data("")), {"IHDR", "colour type 5"});
  expect_words(refusal(kSignature + chunk("IDAT", std::string(13, '\0'))), {"IHDR"});
}

TEST(HostilePng, OnlyRegularFiles) {
  const std::filesystem::path pipe = test::scratch_folder() / "pipe.png";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& path : {pipe, std::filesystem::path("/dev/zero")}) {
    try {
      load_image(path);
      ADD_FAILURE() << path << " was read";
    } catch (const Error& error) {
      expect_words(error.what(), {path.string(), "not a regular file", "Copy"});
    }
  }
}

}  // namespace
}  // namespace kiln
