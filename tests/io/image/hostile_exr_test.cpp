// OpenEXR files whose headers promise what their blocks cannot hold.
#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "hostile.h"
#include "io/image/image_reader.h"
#include "io/image/match_reader.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

using test::expect_words;
using test::little_endian;

struct Box {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct Spec {
  int compression = 0;
  Box data = {}, display = {};
  std::string more = {};    // Attributes
  std::uint32_t flags = 0;  // Beside the version, 2
  std::vector<std::string> channels = {"Y"};
};

std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
  return name + '\0' + type + '\0' + little_endian(value.size(), 4) + value;
}

std::string box(const Box& b) {
  std::string bytes;
  for (const int v : {b.x0, b.y0, b.x1, b.y1}) bytes += little_endian(static_cast<unsigned>(v), 4);
  return bytes;
}

std::string number(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return little_endian(bits, 4);
}

/// Float channels.
std::string header(const Spec& spec) {
  std::string list;
  for (const std::string& name : spec.channels) {
    list += name + '\0' + little_endian(2, 4) + little_endian(0, 4) + little_endian(1, 4) +
            little_endian(1, 4);
  }
  list += '\0';
  return little_endian(20000630, 4) + little_endian(2 | spec.flags, 4) +
         attribute("channels", "chlist", list) +
         attribute("compression", "compression",
                   std::string(1, static_cast<char>(spec.compression))) +
         attribute("dataWindow", "box2i", box(spec.data)) +
         attribute("displayWindow", "box2i", box(spec.display)) +
         attribute("lineOrder", "lineOrder", std::string(1, '\0')) +
         attribute("pixelAspectRatio", "float", number(1)) +
         attribute("screenWindowCenter", "v2f", number(0) + number(0)) +
         attribute("screenWindowWidth", "float", number(1)) + spec.more + '\0';
}

/// Blocks at their places after the table.
std::string with_blocks(const std::string& header, const std::vector<std::string>& blocks) {
  std::string table, body;
  for (const std::string& block : blocks) {
    table += little_endian(header.size() + 8 * blocks.size() + body.size(), 8);
    body += block;
  }
  return header + table + body;
}

std::string scan_lines(int y, const std::string& data) {
  return little_endian(static_cast<unsigned>(y), 4) + little_endian(data.size(), 4) + data;
}

/// A file of `rows` uncompressed rows of zeros.
std::string plain(const Spec& spec) {
  const auto width = static_cast<std::size_t>(spec.data.x1 - spec.data.x0 + 1);
  std::vector<std::string> blocks;
  for (int y = spec.data.y0; y <= spec.data.y1; ++y) {
    blocks.push_back(scan_lines(y, std::string(4 * width * spec.channels.size(), '\0')));
  }
  return with_blocks(header(spec), blocks);
}

Image read(const std::string& bytes) { return parse_image(*bytes_in_memory(bytes), "hostile.exr"); }

std::string refusal(const std::string& bytes) {
  const test::AddressLimit limited;
  return test::refusal(bytes, [](const ByteSource& source) { parse_image(source, "hostile.exr"); });
}

TEST(HostileExr, WhatIsWrittenByHandIsRead) {
  const Image image = read(plain({.data = {0, 0, 6, 4}, .display = {0, 0, 6, 4}}));
  EXPECT_EQ(image.width, 7u);
  EXPECT_EQ(image.height, 5u);
}

TEST(HostileExr, AHugeDisplayWindow) {
  const std::string largest = plain({.display = {0, 0, 65535, 65535}});
  EXPECT_LT(largest.size(), 400u);
  expect_words(refusal(largest), {"displayWindow", "65536 x 65536", "at most 1073741823"});
  expect_words(refusal(plain({.display = {0, 0, 19999, 19999}})),
               {"displayWindow", "20000 x 20000", "1 x 1", "cropped"});
  expect_words(refusal(plain({.display = {0, 0, 65536, 1}})), {"displayWindow", "65537"});
  expect_words(refusal(plain({.display = {-2147483647 - 1, 0, 2147483647, 1}})),
               {"displayWindow", "4294967296"});
}

TEST(HostileExr, FramesOfFilmMayBeNearlyEmpty) {
  const Image image = read(plain({.data = {100, 50, 101, 51}, .display = {0, 0, 2047, 1079}}));
  EXPECT_EQ(image.width, 2048u);
  EXPECT_EQ(image.height, 1080u);
  EXPECT_TRUE(
      std::all_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v == 0; }));
}

TEST(HostileExr, ABlockMustHoldItsPixels) {
  const char* const names[] = {"none",  "RLE", "ZIPS", "ZIP",  "PIZ",
                               "PXR24", "B44", "B44A", "DWAA", "DWAB"};
  const int rows[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
  for (int c = 0; c < 10; ++c) {
    SCOPED_TRACE(names[c]);
    Spec spec{.compression = c, .data = {0, 0, 65535, rows[c] - 1}};
    spec.display = spec.data;
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}}) {
      expect_words(
          refusal(with_blocks(header(spec), {scan_lines(0, std::string(size, 'x'))})),
          {"dataWindow", "65536 x " + std::to_string(rows[c]), "block 0", names[c], "Export"});
    }
  }
  // All bytes there but one.
  Spec spec{.data = {0, 0, 99, 0}, .display = {0, 0, 99, 0}};
  const std::string text =
      refusal(with_blocks(header(spec), {scan_lines(0, std::string(399, 'x'))}));
  expect_words(text, {"takes 400 bytes", "but 399 bytes are stored", "at most 399"});
}

TEST(HostileExr, ATableLongerThanTheFile) {
  for (const int c : {0, 3, 9}) {
    Spec spec{.compression = c, .data = {0, 0, 29999, 29999}, .display = {0, 0, 29999, 29999}};
    expect_words(refusal(header(spec)), {"dataWindow", "30000 x 30000", "truncated"});
  }
}

TEST(HostileExr, BlocksThatShareBytes) {
  const Spec spec{.data = {0, 0, 999, 1}, .display = {0, 0, 999, 1}};
  const std::string second = scan_lines(1, std::string(4000, '\0'));
  const std::string first = scan_lines(0, second.substr(0, 4000));
  const std::size_t start = header(spec).size() + 16;
  const std::string bytes = header(spec) + little_endian(start, 8) + little_endian(start + 8, 8) +
                            first + second.substr(4000);
  expect_words(refusal(bytes), {"block 1", "overlaps another one"});
}

TEST(HostileExr, BlocksOutOfPlace) {
  const Spec spec{.data = {0, 0, 3, 1}, .display = {0, 0, 3, 1}};
  const std::string row(16, '\0');
  expect_words(refusal(with_blocks(header(spec), {scan_lines(1, row), scan_lines(0, row)})),
               {"block 0", "another block is at its position"});
  std::string hole = with_blocks(header(spec), {scan_lines(0, row), scan_lines(1, row)});
  for (const std::uint64_t at : {std::uint64_t{0}, ~std::uint64_t{0}, std::uint64_t{1} << 40}) {
    hole.replace(header(spec).size() + 8, 8, little_endian(at, 8));
    expect_words(refusal(hole), {"block 1", "stopped"});
  }
}

TEST(HostileExr, HugeTiles) {
  const auto tiled = [](std::uint32_t width, std::uint32_t height, char mode) {
    const std::string tiles =
        attribute("tiles", "tiledesc", little_endian(width, 4) + little_endian(height, 4) + mode);
    const std::string head = header({.more = tiles, .flags = 1U << 9});
    return with_blocks(head, {std::string(16, '\0') + little_endian(4, 4) + number(0.5F)});
  };
  expect_words(refusal(tiled(65536, 65536, 0)), {"tiles", "65536 x 65536", "smaller tiles"});
  expect_words(refusal(tiled(0, 1, 0)), {"tiles", "0 x 1"});
  expect_words(refusal(tiled(4294967295U, 1, 0)), {"tiles"});
  expect_words(refusal(tiled(16, 16, 3)), {"tiles", "level mode 3"});
  EXPECT_EQ(read(tiled(256, 256, 0)).pixels, std::vector<float>{0.5F});
}

/// Neither rate may be below 1; a rate of 2 is one that images do not have here.
TEST(HostileExr, SamplingRatesAreCheckedAlongBothSides) {
  const std::string whole = plain({.data = {0, 0, 1, 1}, .display = {0, 0, 1, 1}});
  const std::size_t rates = whole.find(std::string("Y\0\2\0\0\0", 6)) + 10;
  ASSERT_EQ(whole.substr(rates, 8), little_endian(1, 4) + little_endian(1, 4));
  EXPECT_EQ(read(whole).width, 2U);
  for (const std::size_t side : {0U, 4U}) {
    for (const std::uint32_t rate : {0U, 0xFFFFFFFFU, 2U}) {
      std::string bytes = whole;
      bytes.replace(rates + side, 4, little_endian(rate, 4));
      EXPECT_NE(refusal(bytes).find(rate == 2 ? "subsampled" : "a sampling rate is below 1"),
                std::string::npos)
          << side << ' ' << rate << ": " << refusal(bytes);
    }
  }
}

/// What a file holds in place of colours is listed.
TEST(HostileExr, ChannelsThatAreNoPictureAreNamed) {
  const std::string bytes =
      plain({.data = {0, 0, 1, 1}, .display = {0, 0, 1, 1}, .channels = {"P", "Q", "layer.T"}});
  EXPECT_NE(refusal(bytes).find("it holds P, Q, layer.T, but"), std::string::npos)
      << refusal(bytes);
}

TEST(HostileExr, FieldsAreNamed) {
  const Box one;
  expect_words(refusal(plain({.compression = 10})), {"compression", "10"});
  expect_words(refusal(plain({.flags = 1U << 11})), {"type", "deep"});
  expect_words(refusal(plain({.more = attribute("type", "string", "deepscanline")})), {"deep"});
  expect_words(refusal(plain({.channels = {"Q"}})), {"channels", "R, G, B, A or Y"});
  expect_words(refusal(plain({.channels = std::vector<std::string>(1025, "Y")})), {"channels"});
  expect_words(refusal(plain({.data = {0, 0, -1, 0}, .display = one})), {"dataWindow"});
  std::string huge = header({});
  huge.replace(huge.find("chlist") + 7, 4, little_endian(0xFFFFFFFF, 4));
  expect_words(refusal(huge), {"header", "truncated"});
}

TEST(HostileExr, CutShortAnywhere) {
  const std::filesystem::path path = test::scratch_folder() / "image.exr";
  std::vector<std::string> files = {plain({.data = {-2, -3, 4, 4}, .display = {-4, -4, 9, 9}})};
  Image image{40, 70, 3, std::vector<float>(std::size_t{40} * 70 * 3)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<float>(i * 7 % 31);
  }
  save_image(image, path);
  files.push_back(test::read_file(path));
  for (const std::string& whole : files) {
    read(whole);
    for (std::size_t length = 0; length < whole.size(); length += length < 700 ? 1 : 7) {
      SCOPED_TRACE(length);
      refusal(whole.substr(0, length));
    }
  }
}

TEST(HostileMatch, CutShortOrWithTooManySamples) {
  const std::filesystem::path path = test::scratch_folder() / "match.exr";
  Match match;
  match.width = match.height = 4;
  match.samples = 1;
  match.triangle.resize(16);
  match.u.resize(16), match.v.resize(16), match.distance.resize(16), match.status.resize(16);
  save_match(match, path);
  const std::string whole = test::read_file(path);
  const auto refused = [](const std::string& bytes, std::uint64_t most) {
    const test::AddressLimit limited;
    return test::refusal(
        bytes, [&](const ByteSource& source) { parse_match(source, "hostile.exr", {most}); });
  };
  for (std::size_t length = 0; length < whole.size(); ++length) {
    SCOPED_TRACE(length);
    expect_words(refused(whole.substr(0, length), 16), {"save_match()"});
  }
  expect_words(refused(whole, 15), {"dataWindow", "4 x 4", "at most 15"});
  const std::string side = little_endian(262143, 4);
  std::string huge = whole;
  for (const char* field : {"dataWindow", "displayWindow"}) {
    const std::size_t at = huge.find(field) + std::strlen(field) + 1 + 6 + 4;
    huge.replace(at + 8, 8, side + side);
  }
  expect_words(refused(huge, ~std::uint64_t{0}), {"dataWindow", "262144 x 262144"});
}

TEST(HostileMatch, OnlyRegularFiles) {
  const std::filesystem::path pipe = test::scratch_folder() / "pipe.exr";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& path : {pipe, std::filesystem::path("/dev/zero")}) {
    try {
      load_match(path);
      ADD_FAILURE() << path << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      expect_words(error.what(), {path.string(), "not a regular file", "Copy"});
    }
  }
}

}  // namespace
}  // namespace kiln
