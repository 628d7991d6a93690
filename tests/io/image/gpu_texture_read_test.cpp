// KTX 2 and DDS read: blocks by their definitions and against another decoder's bytes, containers written by hand.
#include <gtest/gtest.h>
#include <zlib.h>
#ifdef KILN_HAS_ZSTD
#include <zstd.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "hostile.h"
#include "io/image/block_decode.h"
#include "io/image/gpu_texture.h"
#include "io/image/picture.h"
#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::little_endian;

/// Bytes by a linear congruence, the highest eight bits of each number.
std::vector<std::uint8_t> drawn_bytes(std::uint32_t seed, std::size_t count) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < count; ++i) {
    seed = seed * 1664525U + 1013904223U;
    bytes.push_back(static_cast<std::uint8_t>(seed >> 24U));
  }
  return bytes;
}

// FNV-1a of the texels' bytes of 512 blocks a mode, as texture2ddecoder 1.0.6 (PyPI) decodes them: all 64 partitions
// occur in each mode that has any.
TEST(BlockDecode, Bc7HasTheBytesOfAnotherDecoderInEveryMode) {
  constexpr std::array<std::uint64_t, 8> kHashes = {
      0xe223a4534b168a10, 0x9b73f38b13fdded3, 0x3eb0528629dfbdc9, 0x0e0a0342d10bb8dd,
      0x232f47d15d38dca4, 0x372460c42b26c05b, 0x3267ed5dbc98bc42, 0x42b743e08d33e58a};
  constexpr std::size_t kBlocks = 512;
  for (std::uint32_t mode = 0; mode < 8; ++mode) {
    std::vector<std::uint8_t> bytes = drawn_bytes(mode + 1, 16 * kBlocks);
    std::uint64_t hash = 0xcbf29ce484222325;
    for (std::size_t i = 0; i < kBlocks; ++i) {
      std::uint8_t& first = bytes[16 * i];
      first = static_cast<std::uint8_t>((first & (0xFFU << (mode + 1))) | 1U << mode);
      BlockTexels texels;
      decode_block(BlockFormat::bc7, &bytes[16 * i], texels);
      for (const auto& texel : texels) {
        for (const float value : texel) {
          const float byte = value * 255;
          EXPECT_EQ(byte, std::round(byte));
          hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3;
        }
      }
    }
    EXPECT_EQ(hash, kHashes[mode]) << mode;
  }
  std::array<std::uint8_t, 16> reserved{};
  BlockTexels texels;
  decode_block(BlockFormat::bc7, reserved.data(), texels);
  EXPECT_EQ(texels[5], (std::array<float, 4>{}));
}

// Direct3D 11.3, 19.5.4 to 19.5.6: ends of 5, 6 and 5 bits, two colours between at thirds; or, where the first end is not
// the greater number, one at half and transparent black.
TEST(BlockDecode, Bc1To3AreAsTheyAreDefined) {
  std::vector<std::uint8_t> drawn = drawn_bytes(77, 16 * 256);
  for (std::size_t b = 0; b < 256; b += 8) {  // both ends the same
    std::copy_n(&drawn[16 * b + 8], 2, &drawn[16 * b + 10]);
  }
  int three = 0;
  for (std::size_t b = 0; b < 256; ++b) {
    const std::uint8_t* const block = &drawn[16 * b];
    const std::uint8_t* const colors = block + 8;
    const unsigned ends[2] = {colors[0] | colors[1] * 256U, colors[2] | colors[3] * 256U};
    double end[2][3];
    for (int e = 0; e < 2; ++e) {
      end[e][0] = (ends[e] >> 11U) / 31.0;
      end[e][1] = (ends[e] / 32 % 64) / 63.0;
      end[e][2] = (ends[e] % 32) / 31.0;
    }
    BlockTexels bc1, bc2, bc3;
    decode_block(BlockFormat::bc1, colors, bc1);
    decode_block(BlockFormat::bc2, block, bc2);
    decode_block(BlockFormat::bc3, block, bc3);
    const bool has_black = ends[0] <= ends[1];
    three += has_black ? 1 : 0;
    for (std::size_t i = 0; i < 16; ++i) {
      const unsigned index = colors[4 + i / 4] >> (2 * (i % 4)) & 3U;
      const double four_shares[4] = {0, 1, 1.0 / 3, 2.0 / 3};
      for (std::size_t c = 0; c < 3; ++c) {
        const double a = end[0][c], d = end[1][c] - end[0][c];
        const double in_four = a + d * four_shares[index];
        const double in_three = index == 3 ? 0 : index == 2 ? a + d / 2 : in_four;
        EXPECT_NEAR(bc2[i][c], in_four, 1e-6);
        EXPECT_NEAR(bc3[i][c], in_four, 1e-6);
        EXPECT_NEAR(bc1[i][c], has_black ? in_three : in_four, 1e-6);
      }
      EXPECT_EQ(bc1[i][3], has_black && index == 3 ? 0 : 1);
      EXPECT_NEAR(bc2[i][3], (i % 2 == 0 ? block[i / 2] % 16 : block[i / 2] / 16) / 15.0, 1e-6);
      EXPECT_NEAR(bc3[i][3], decode_bc4(std::span(block, 8))[i] / 255, 1e-6);
    }
  }
  EXPECT_GT(three, 50);
}

TEST(BlockDecode, SignedChannelsGoFromMinusOneToOne) {
  // Ends 127 and -127, every index in turn; then -128, which counts as -127, before 64: six shades, -1 and 1.
  std::uint8_t block[16] = {127, 0x81, 0, 0, 0, 0, 0, 0, 0x80, 64};
  std::uint64_t indices = 0;
  for (unsigned i = 0; i < 16; ++i) indices |= std::uint64_t{i % 8} << (3 * i);
  for (unsigned k = 0; k < 6; ++k) {
    block[2 + k] = block[10 + k] = static_cast<std::uint8_t>(indices >> (8 * k));
  }
  BlockTexels texels;
  decode_block(BlockFormat::bc5_signed, block, texels);
  const double first[8] = {127,
                           -127,
                           127 - 254 / 7.0,
                           127 - 2 * 254 / 7.0,
                           127 - 3 * 254 / 7.0,
                           127 - 4 * 254 / 7.0,
                           127 - 5 * 254 / 7.0,
                           127 - 6 * 254 / 7.0};
  const double second[8] = {
      -127, 64, -127 + 191 / 5.0, -127 + 2 * 191 / 5.0, -127 + 3 * 191 / 5.0, -127 + 4 * 191 / 5.0,
      -127, 127};
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_NEAR(texels[i][0], first[i % 8] / 254 + 0.5, 1e-6) << i;
    EXPECT_NEAR(texels[i][1], second[i % 8] / 254 + 0.5, 1e-6) << i;
  }
  // Equal ends are no greater first one: -1 and 1 are there.
  block[0] = block[1] = 64;
  decode_block(BlockFormat::bc4_signed, block, texels);
  for (std::size_t i = 0; i < 16; ++i) {
    const double shade = i % 8 == 6 ? -127 : i % 8 == 7 ? 127 : 64;
    EXPECT_NEAR(texels[i][0], shade / 254 + 0.5, 1e-6) << i;
  }
}

Image ramp(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  Image image{width, height, channels, {}};
  for (std::uint32_t i = 0; i < width * height * channels; ++i) {
    image.pixels.push_back(static_cast<float>(i * 37 % 256) / 255);
  }
  return image;
}

/// Both formats of an image, read again; a BC4's blocks are within what encode_bc4() says.
TEST(GpuTextureRead, WhatKilnWritesComesBack) {
  for (const ImageFormat format : {ImageFormat::ktx2, ImageFormat::dds}) {
#ifndef KILN_HAS_ZSTD
    if (format == ImageFormat::ktx2) continue;
#endif
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
      const Image image = ramp(7, 5, channels);
      const Image back = load_image(encode(image, {format}), "a");
      const std::uint32_t stored = channels == 3 ? 4 : channels;
      ASSERT_EQ(back.channels, stored);
      ASSERT_EQ(back.width, 7U);
      for (std::size_t i = 0; i < 35; ++i) {
        for (std::size_t c = 0; c < channels; ++c) {
          EXPECT_EQ(back.pixels[i * stored + c], image.pixels[i * channels + c]);
        }
      }
    }
    // Blocks of 12 x 8 texels: each shows its own values, not its neighbour's.
    Image blocks{12, 8, 2, {}};
    for (std::size_t i = 0; i < 96; ++i) {
      const std::size_t block = i % 12 / 4 + 3 * (i / 12 / 4);
      blocks.pixels.push_back(static_cast<float>(block * 40) / 255);
      blocks.pixels.push_back(static_cast<float>(255 - block * 30 - i % 2) / 255);
    }
    const Image back = load_image(encode(blocks, {format}), "a");
    ASSERT_EQ(back.channels, 2U);
    for (std::size_t i = 0; i < back.pixels.size(); ++i) {
      EXPECT_NEAR(back.pixels[i], blocks.pixels[i], 1e-6);
    }
  }
}

struct Ktx2 {
  std::uint32_t format = 37, width = 2, height = 2, layers = 0, faces = 1, scheme = 0;
  std::uint32_t model = 1, flags = 0;
  std::string keys;
  std::string level;
  std::uint64_t unpacked = 0;          // 0: as many bytes as the level has
  std::vector<std::string> mips = {};  // The smaller levels, which the file holds before the first

  std::string file() const {
    const std::string descriptor =
        little_endian(44, 4) + little_endian(0, 4) + little_endian(2U | 40U << 16U, 4) +
        little_endian(model | 1U << 8U | 1U << 16U | flags << 24U, 4) + std::string(28, '\0');
    const std::size_t at = 80 + 24 * (1 + mips.size());
    std::string bytes("\xABKTX 20\xBB\r\n\x1A\n", 12);
    const auto levels = static_cast<std::uint32_t>(1 + mips.size());
    for (const std::uint32_t word :
         {format, 1U, width, height, 0U, layers, faces, levels, scheme}) {
      bytes += little_endian(word, 4);
    }
    bytes += little_endian(at, 4) + little_endian(descriptor.size(), 4);
    bytes += little_endian(at + descriptor.size(), 4) + little_endian(keys.size(), 4);
    bytes += std::string(16, '\0');
    std::string smaller;
    for (auto mip = mips.rbegin(); mip != mips.rend(); ++mip) smaller += *mip;
    std::size_t end = at + descriptor.size() + keys.size() + smaller.size();
    bytes += little_endian(end, 8);
    bytes += little_endian(level.size(), 8);
    bytes += little_endian(unpacked != 0 ? unpacked : level.size(), 8);
    for (const std::string& mip : mips) {
      end -= mip.size();
      bytes += little_endian(end, 8) + little_endian(mip.size(), 8) + little_endian(1, 8);
    }
    return bytes + descriptor + keys + smaller + level;
  }
  static std::string key(const std::string& name, const std::string& value) {
    std::string entry = name + '\0' + value + '\0';
    entry = little_endian(entry.size(), 4) + entry;
    entry.resize((entry.size() + 3) / 4 * 4);
    return entry;
  }
};

Image read_ktx2(const Ktx2& ktx) {
  const std::string bytes = ktx.file();
  return load_image(std::as_bytes(std::span(bytes)), "hostile.ktx2");
}

TEST(GpuTextureRead, Ktx2SaysHowItsTexelsLie) {
  Ktx2 ktx;
  ktx.level = std::string("\x10\x20\x30\xFF\x40\x50\x60\x80\x00\x00\x00\x00\xFF\xFF\xFF\x33", 16);
  const Image plain = read_ktx2(ktx);
  ASSERT_EQ(plain.channels, 4U);
  EXPECT_EQ(plain.at(1, 0)[2], 96.0F / 255);
  EXPECT_EQ(plain.at(1, 1)[3], 51.0F / 255);
  // From the bottom up.
  ktx.keys = Ktx2::key("KTXwriter", "by hand") + Ktx2::key("KTXorientation", "ru");
  EXPECT_EQ(read_ktx2(ktx).at(1, 1)[2], 96.0F / 255);
  ktx.keys = Ktx2::key("KTXorientation", "lu");
  EXPECT_EQ(read_ktx2(ktx).at(0, 1)[2], 96.0F / 255);
  ktx.keys = Ktx2::key("KTXorientation", "ld");
  EXPECT_EQ(read_ktx2(ktx).at(0, 0)[2], 96.0F / 255);
  // x in red, green and blue, y in alpha, as normal maps of `ktx` are.
  ktx.keys = Ktx2::key("KTXswizzle", "ra01");
  const Image turned = read_ktx2(ktx);
  ASSERT_EQ(turned.channels, 3U);
  EXPECT_EQ(turned.at(1, 0)[0], 64.0F / 255);
  EXPECT_EQ(turned.at(1, 0)[1], 128.0F / 255);
  EXPECT_EQ(turned.at(1, 0)[2], 0);
  // Alpha multiplied in: 0x40 of 0x80 is a half.
  ktx.keys.clear();
  ktx.flags = 1;
  EXPECT_NEAR(read_ktx2(ktx).at(1, 0)[0], 64.0 / 128, 1e-6);
  EXPECT_EQ(read_ktx2(ktx).at(0, 1)[0], 0);
  ktx.flags = 0;
  ktx.format = 44;  // blue first
  EXPECT_EQ(read_ktx2(ktx).at(1, 0)[0], 96.0F / 255);
  ktx.format = 38;  // signed: 0x80 is -1, as 0x81 is
  EXPECT_EQ(read_ktx2(ktx).at(1, 0)[3], 0);
  EXPECT_NEAR(read_ktx2(ktx).at(1, 0)[0], 64.0 / 254 + 0.5, 1e-6);
  ktx.format = 91;  // 16 bits: half as many texels
  ktx.width = 1;
  EXPECT_NEAR(read_ktx2(ktx).at(0, 0)[0], 0x2010 / 65535.0, 1e-6);
  ktx.format = 109;  // floats: a quarter
  ktx.height = 1;
  const std::array<float, 4> floats{0.25F, -2, 7.5F, 1};
  std::memcpy(ktx.level.data(), floats.data(), 16);
  EXPECT_EQ(read_ktx2(ktx).at(0, 0)[2], 7.5F);
}

TEST(GpuTextureRead, Ktx2IsUnpackedFromZlib) {
  Ktx2 ktx;
  ktx.format = 9;
  ktx.width = ktx.height = 64;
  const Image image = ramp(64, 64, 1);
  std::string plain;
  for (const float value : image.pixels) plain += static_cast<char>(std::lround(value * 255));
  uLongf size = compressBound(plain.size());
  ktx.level.resize(size);
  ASSERT_EQ(compress(reinterpret_cast<Bytef*>(ktx.level.data()), &size,
                     reinterpret_cast<const Bytef*>(plain.data()), plain.size()),
            Z_OK);
  ktx.level.resize(size);
  ktx.scheme = 3;
  ktx.unpacked = plain.size();
  EXPECT_EQ(read_ktx2(ktx).pixels, image.pixels);
}

#ifdef KILN_HAS_ZSTD
/// The first level of a chain is read, whatever the format says of its transfer function.
TEST(GpuTextureRead, Ktx2IsUnpackedFromZstandard) {
  const auto pack = [](const std::string& plain) {
    std::string packed(ZSTD_compressBound(plain.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 3));
    return packed;
  };
  struct Format {
    std::uint32_t linear, srgb, channels;  // VkFormat
  };
  for (const Format& format : {Format{9, 15, 1}, {16, 22, 2}, {23, 29, 3}, {37, 43, 4}}) {
    const Image image = ramp(16, 8, format.channels);
    std::string plain;
    for (const float value : image.pixels) plain += static_cast<char>(std::lround(value * 255));
    for (const std::uint32_t number : {format.linear, format.srgb}) {
      for (const std::size_t levels : {std::size_t{1}, std::size_t{5}}) {
        Ktx2 ktx;
        ktx.format = number;
        ktx.width = 16, ktx.height = 8;
        ktx.scheme = 2;
        ktx.level = pack(plain);
        ktx.unpacked = plain.size();
        for (std::size_t level = 1; level < levels; ++level) {
          ktx.mips.push_back(pack(std::string(plain.size() >> (2 * level), 'x')));
        }
        const Image back = read_ktx2(ktx);
        EXPECT_EQ(back.channels, format.channels) << number;
        EXPECT_EQ(back.pixels, image.pixels) << number << ", " << levels;
      }
    }
  }
}
#endif

TEST(GpuTextureRead, Ktx2ThatCannotBeReadSaysWhy) {
  const auto refused = [](const Ktx2& ktx, const std::vector<std::string>& words) {
    test::expect_words(
        test::refusal(ktx.file(),
                      [](const ByteSource& source) { parse_ktx2(source, "hostile.ktx2"); }),
        words);
  };
  Ktx2 ktx;
  ktx.level = std::string(16, 'x');
  Ktx2 other = ktx;
  other.model = 166, other.format = 0, other.scheme = 2;
  refused(other, {"Basis Universal (UASTC)", "ktx transcode"});
  const std::string uastc = other.file();
  EXPECT_NE(explain_unreadable_ktx2(std::as_bytes(std::span(uastc))).find("UASTC"),
            std::string::npos);
  const std::string good = ktx.file();
  EXPECT_EQ(explain_unreadable_ktx2(std::as_bytes(std::span(good))), "");
  other.model = 163, other.scheme = 1;
  refused(other, {"Basis Universal (ETC1S)"});
  other = ktx, other.faces = 6;
  refused(other, {"several pictures"});
  other = ktx, other.format = 147;
  refused(other, {"VkFormat 147"});
  other = ktx, other.scheme = 9;
  refused(other, {"supercompression scheme is 9"});
  other = ktx, other.width = 3;
  refused(other, {"level 0", "24 bytes"});
  other = ktx, other.level.resize(8);
  refused(other, {"level 0"});
  other = ktx, other.width = other.height = 60000;
  refused(other, {"pixels"});
  other = ktx, other.width = 0;
  refused(other, {"0 x 2"});
#ifdef KILN_HAS_ZSTD
  other = ktx, other.scheme = 2, other.unpacked = 16;
  refused(other, {"Zstandard"});
  other.width = other.height = 4096, other.unpacked = 4096 * 4096 * 4;  // of 16 bytes
  refused(other, {"level 0", "need 67108864 bytes"});
#endif
  for (const std::size_t size : {12U, 50U, 103U, 110U, 160U}) {
    test::refusal(ktx.file().substr(0, size),
                  [](const ByteSource& source) { parse_ktx2(source, "hostile.ktx2"); });
  }
}

struct Dds {
  std::uint32_t width = 4, height = 4, flags = 4, bits = 0, caps2 = 0;
  std::string letters = std::string(4, '\0');
  std::array<std::uint32_t, 4> masks{};
  std::array<std::uint32_t, 5> dx10{};
  std::string pixels;

  std::string file() const {
    std::string bytes = "DDS " + little_endian(124, 4) + little_endian(0x1007, 4) +
                        little_endian(height, 4) + little_endian(width, 4) + std::string(56, '\0') +
                        little_endian(32, 4) + little_endian(flags, 4) + letters +
                        little_endian(bits, 4);
    for (const std::uint32_t mask : masks) bytes += little_endian(mask, 4);
    bytes += little_endian(0x1000, 4) + little_endian(caps2, 4) + std::string(12, '\0');
    if (letters == "DX10") {
      for (const std::uint32_t word : dx10) bytes += little_endian(word, 4);
    }
    return bytes + pixels;
  }
};

Image read_dds(const Dds& dds) {
  const std::string bytes = dds.file();
  return load_image(std::as_bytes(std::span(bytes)), "hostile.dds");
}

TEST(GpuTextureRead, DdsOfBeforeDirect3D10IsRead) {
  Dds dds;
  dds.letters = "DXT5";
  // Alpha 255 everywhere but in one texel; red and blue ends, all red.
  dds.pixels = std::string("\xFF\x00\x08\x00\x00\x00\x00\x00\x00\xF8\x1F\x00\x00\x00\x00\x00", 16);
  const Image with_alpha = read_dds(dds);
  ASSERT_EQ(with_alpha.channels, 4U);
  EXPECT_EQ(with_alpha.at(1, 0)[3], 0);
  EXPECT_EQ(with_alpha.at(2, 0)[3], 1);
  EXPECT_EQ(with_alpha.at(2, 0)[0], 1);
  EXPECT_EQ(with_alpha.at(2, 0)[2], 0);
  dds.pixels[2] = 0;
  EXPECT_EQ(read_dds(dds).channels, 3U);  // opaque
  dds.letters = "DXT1";
  dds.pixels = dds.pixels.substr(8);
  EXPECT_EQ(read_dds(dds).channels, 3U);
  // 16 bits: 5, 6, 5.
  dds = {};
  dds.flags = 0x40, dds.bits = 16, dds.width = 2, dds.height = 1;
  dds.masks = {0xF800, 0x07E0, 0x001F, 0};
  dds.pixels = std::string("\x00\xF8\x1F\x04", 4);
  const Image packed = read_dds(dds);
  ASSERT_EQ(packed.channels, 3U);
  EXPECT_EQ(packed.at(0, 0)[0], 1);
  EXPECT_NEAR(packed.at(1, 0)[1], 32.0 / 63, 1e-6);
  EXPECT_EQ(packed.at(1, 0)[2], 1);
  // 32 bits with alpha, blue first.
  dds.flags = 0x41, dds.bits = 32, dds.width = 1;
  dds.masks = {0xFF0000, 0xFF00, 0xFF, 0xFF000000};
  dds.pixels = std::string("\x10\x20\x30\x40", 4);
  const Image four = read_dds(dds);
  ASSERT_EQ(four.channels, 4U);
  EXPECT_EQ(four.pixels, (std::vector<float>{48.0F / 255, 32.0F / 255, 16.0F / 255, 64.0F / 255}));
  // Alpha alone, of black (A8): of flag and mask, and not the second of two channels.
  dds.flags = 0x2, dds.bits = 8, dds.width = 2, dds.height = 1, dds.masks = {0, 0, 0, 0xFF};
  dds.pixels = "\x40\xC0";
  const Image alpha = read_dds(dds);
  ASSERT_EQ(alpha.channels, 4U);
  EXPECT_EQ(alpha.pixels, (std::vector<float>{0, 0, 0, 64.0F / 255, 0, 0, 0, 192.0F / 255}));
  // Luminance and alpha.
  dds.flags = 0x20001, dds.bits = 16, dds.width = 1, dds.masks = {0xFF, 0, 0, 0xFF00};
  const Image grey = read_dds(dds);
  ASSERT_EQ(grey.channels, 2U);
  EXPECT_EQ(grey.pixels, (std::vector<float>{64.0F / 255, 192.0F / 255}));
  // Luminance.
  dds.flags = 0x20000, dds.bits = 8, dds.masks = {0xFF, 0, 0, 0};
  dds.pixels = "\x80";
  EXPECT_EQ(read_dds(dds).channels, 1U);
  EXPECT_EQ(read_dds(dds).pixels[0], 128.0F / 255);
}

TEST(GpuTextureRead, DdsThatCannotBeReadSaysWhy) {
  const auto refused = [](const Dds& dds, const std::vector<std::string>& words) {
    test::expect_words(
        test::refusal(dds.file(),
                      [](const ByteSource& source) { parse_dds(source, "hostile.dds"); }),
        words);
  };
  Dds dds;
  dds.letters = "DXT1";
  dds.pixels = std::string(8, 'x');
  EXPECT_NO_THROW(read_dds(dds));
  Dds other = dds;
  other.pixels.pop_back();
  refused(other, {"pixels", "8 bytes", "7"});
  other = dds, other.letters = "UYVY";
  refused(other, {"\"UYVY\""});
  other = dds, other.caps2 = 0x200;
  refused(other, {"several pictures"});
  other = dds, other.letters = "DX10", other.dx10 = {95, 3, 0, 1, 0};
  refused(other, {"DXGI_FORMAT 95"});
  other.dx10 = {98, 3, 0, 6, 0};
  refused(other, {"several pictures"});
  other = dds, other.width = 70000;
  refused(other, {"70000 x 4"});
  other = dds, other.flags = 0x40, other.bits = 12;
  refused(other, {"12 bits"});
  for (const std::size_t size : {4U, 100U, 127U}) {
    test::refusal(dds.file().substr(0, size),
                  [](const ByteSource& source) { parse_dds(source, "hostile.dds"); });
  }
}

TEST(GpuTextureRead, FloatsAreLinearLight) {
  const auto folder = test::scratch_folder();
  Ktx2 ktx;
  ktx.format = 109;
  ktx.level = std::string(64, '\0');
  const auto write = [&](const std::string& bytes) {
    std::ofstream(folder / "a.ktx2", std::ios::binary) << bytes;
    return holds_linear_light(folder / "a.ktx2");
  };
  EXPECT_TRUE(write(ktx.file()));
  ktx.format = 43;
  EXPECT_FALSE(write(ktx.file()));
  Dds dds;
  dds.letters = "DX10", dds.dx10 = {10, 3, 0, 1, 0};
  EXPECT_TRUE(write(dds.file()));
}

}  // namespace
}  // namespace kiln
