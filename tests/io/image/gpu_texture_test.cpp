// Textures as GPUs take them: blocks against an exhaustive search, KTX 2 and DDS against their specifications, and
// what is said of their errors against what comes back.
#include "io/image/gpu_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "kiln/image.h"
#include "support/environment.h"
#ifdef KILN_HAS_ZSTD
#include <zstd.h>
#endif

namespace kiln {
namespace {

double squares(const BlockValues& a, const BlockValues& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return sum;
}

/// The least squared error of any two ends, by their definition (Direct3D 11.3, 19.5.11).
double least_squares(const BlockValues& values) {
  double least = 1e30;
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      std::vector<double> shades = {double(a), double(b)};
      const int steps = a > b ? 7 : 5;
      for (int k = 1; k < steps; ++k) shades.push_back(((steps - k) * a + k * b) / double(steps));
      if (steps == 5) shades.insert(shades.end(), {0, 255});
      double sum = 0;
      for (const float value : values) {
        double best = 1e30;
        for (const double shade : shades) best = std::min(best, (value - shade) * (value - shade));
        sum += best;
      }
      least = std::min(least, sum);
    }
  }
  return least;
}

BlockValues noise_block(std::mt19937& random, int kind) {
  const auto unit = [&] { return static_cast<float>(random() % 100001) / 100000; };
  const float base = unit() * 200, range = kind % 3 == 0 ? 3 : kind % 3 == 1 ? 30 : 255;
  BlockValues values{};
  for (float& value : values) {
    value = std::clamp(base + range * (unit() - 0.3F), 0.0F, 255.0F);
    if (kind % 4 == 3 && random() % 3 == 0) value = random() % 2 == 0 ? 0 : 255;
  }
  return values;
}

TEST(GpuTexture, BlocksAreNearTheBest) {
  std::mt19937 random(7);
  double sum = 0, best_sum = 0;
  for (int kind = 0; kind < 24; ++kind) {
    const BlockValues values = noise_block(random, kind);
    const double best = least_squares(values);
    const double found = squares(values, decode_bc4(encode_bc4(values)));
    EXPECT_LE(found, 1.25 * best + 0.01) << kind;  // the search looks at some 30 of 65,536 pairs
    sum += found;
    best_sum += best;
  }
  EXPECT_LE(sum, 1.03 * best_sum);
}

TEST(GpuTexture, BlocksOfTwoBytesAreExact) {
  std::mt19937 random(3);
  for (int i = 0; i < 500; ++i) {
    const auto a = static_cast<float>(random() % 256), b = static_cast<float>(random() % 256);
    BlockValues values{};
    for (float& value : values) value = random() % 2 == 0 ? a : b;
    EXPECT_EQ(decode_bc4(encode_bc4(values)), values) << a << ' ' << b;
    values[0] = 0;  // and 0 and 255 beside one of them
    values[1] = 255;
    for (std::size_t k = 2; k < values.size(); ++k) values[k] = a;
    EXPECT_EQ(decode_bc4(encode_bc4(values)), values) << a;
  }
}

Image ramp(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  Image image{width, height, channels, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        const double at = 0.37 * x + 0.21 * y + 1.3 * c;
        image.pixels.push_back(static_cast<float>(0.5 + 0.49 * std::sin(at)));
      }
    }
  }
  return image;
}

/// An image and its mip-maps; what they hold does not matter here.
std::vector<Image> chain(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  std::vector<Image> levels = {ramp(width, height, channels)};
  while (width > 1 || height > 1) {
    width = std::max(1U, width / 2);
    height = std::max(1U, height / 2);
    levels.push_back(ramp(width, height, channels));
  }
  return levels;
}

std::vector<const Image*> pointers(const std::vector<Image>& levels) {
  std::vector<const Image*> list;
  for (const Image& level : levels) list.push_back(&level);
  return list;
}

std::uint32_t word(const std::vector<std::byte>& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, &bytes.at(at + 3) - 3, 4);
  return value;
}

struct Kind {
  std::uint32_t width, height, channels;
  TextureUse use;
  std::uint32_t vulkan, dxgi, texel_bytes, block_bytes;  // of R8 and so on, or of BC
};
const Kind kKinds[] = {
    {8, 4, 1, TextureUse::values, 139, 80, 0, 8},
    {16, 8, 2, TextureUse::values, 141, 83, 0, 16},
    {8, 8, 3, TextureUse::tangent_normal, 141, 83, 0, 16},
    {8, 8, 3, TextureUse::normal, 37, 28, 4, 0},
    {7, 5, 1, TextureUse::values, 9, 61, 1, 0},
    {6, 4, 3, TextureUse::tangent_normal, 16, 49, 2, 0},
    {8, 8, 3, TextureUse::color, 43, 29, 4, 0},
    {8, 8, 1, TextureUse::color, 43, 29, 4, 0},
    {5, 3, 4, TextureUse::values, 37, 28, 4, 0},
    {1, 1, 3, TextureUse::color, 43, 29, 4, 0},
};

std::size_t level_bytes(const Kind& kind, const Image& level) {
  const std::size_t blocks = std::size_t{(level.width + 3) / 4} * ((level.height + 3) / 4);
  return kind.block_bytes != 0 ? blocks * kind.block_bytes
                               : std::size_t{level.width} * level.height * kind.texel_bytes;
}

TEST(GpuTexture, DdsHasEveryLevel) {
  for (const Kind& kind : kKinds) {
    const std::vector<Image> levels = chain(kind.width, kind.height, kind.channels);
    const std::vector<std::byte> file = encode_dds(pointers(levels), kind.use);
    std::size_t size = 148;
    for (const Image& level : levels) size += level_bytes(kind, level);
    ASSERT_EQ(file.size(), size);
    EXPECT_EQ(word(file, 0), 0x20534444U);
    EXPECT_EQ(word(file, 12), kind.height);
    EXPECT_EQ(word(file, 16), kind.width);
    EXPECT_EQ(word(file, 28), levels.size());
    EXPECT_EQ(word(file, 128), kind.dxgi);
    // Flags say whether the next number is that of all bytes of a compressed level, or of a row.
    const bool blocks = kind.block_bytes != 0;
    EXPECT_EQ(word(file, 8),
              0x1007U | (blocks ? 0x80000U : 0x8U) | (levels.size() > 1 ? 0x20000U : 0U));
    EXPECT_EQ(word(file, 20),
              level_bytes(kind, levels[0]) / (blocks ? 1 : std::size_t{kind.height}));
    EXPECT_EQ(word(file, 108), levels.size() > 1 ? 0x401008U : 0x1000U);
    // Alpha mode of the DX10 header: straight where the picture has alpha, else unknown.
    EXPECT_EQ(word(file, 144), kind.channels == 4 ? 1U : 0U) << kind.vulkan;
  }
}

#ifdef KILN_HAS_ZSTD
std::uint64_t long_word(const std::vector<std::byte>& bytes, std::size_t at) {
  return word(bytes, at) | std::uint64_t{word(bytes, at + 4)} << 32U;
}

/// Samples of the basic descriptor block (Khronos Data Format 1.3, section 5.8 to 5.12): where each channel lies, by the
/// format's own definition, and its least and greatest number.
void expect_samples(const std::vector<std::byte>& file, std::size_t at, const Kind& kind) {
  struct Sample {
    std::uint32_t first_bit, bits, channel;
    bool is_linear;  // though the others are sRGB
  };
  const std::vector<Sample> samples =
      kind.vulkan == 139   ? std::vector<Sample>{{0, 64, 0, false}}  // BC4: data
      : kind.vulkan == 141 ? std::vector<Sample>{{0, 64, 0, false}, {64, 64, 1, false}}  // BC5
      : kind.vulkan == 9   ? std::vector<Sample>{{0, 8, 0, false}}
      : kind.vulkan == 16  ? std::vector<Sample>{{0, 8, 0, false}, {8, 8, 1, false}}
                           : std::vector<Sample>{{0, 8, 0, false},
                                                 {8, 8, 1, false},
                                                 {16, 8, 2, false},
                                                 {24, 8, 15, kind.vulkan == 43}};
  ASSERT_GE(file.size(), at + 16 * samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::uint32_t first = word(file, at + 16 * k);
    const auto& [first_bit, bits, channel, is_linear] = samples[k];
    EXPECT_EQ(first & 0xFFFFU, first_bit) << kind.vulkan << ' ' << k;
    EXPECT_EQ(first >> 16U & 0xFFU, bits - 1) << kind.vulkan << ' ' << k;
    EXPECT_EQ(first >> 24U & 0xFU, channel) << kind.vulkan << ' ' << k;
    EXPECT_EQ(first >> 28U, is_linear ? 1U : 0U) << kind.vulkan << ' ' << k;
    EXPECT_EQ(word(file, at + 16 * k + 4), 0U) << "where the texel lies in its block";
    EXPECT_EQ(word(file, at + 16 * k + 8), 0U) << "least";
    EXPECT_EQ(word(file, at + 16 * k + 12), bits == 64 ? 0xFFFFFFFFU : 255U) << "greatest";
  }
}

TEST(GpuTexture, Ktx2HoldsWhatDdsHolds) {
  for (const Kind& kind : kKinds) {
    const std::vector<Image> levels = chain(kind.width, kind.height, kind.channels);
    const std::vector<std::byte> file = encode_ktx2(pointers(levels), kind.use);
    const std::vector<std::byte> dds = encode_dds(pointers(levels), kind.use);
    EXPECT_EQ(word(file, 12), kind.vulkan);
    EXPECT_EQ(word(file, 16), 1U);
    EXPECT_EQ(word(file, 20), kind.width);
    EXPECT_EQ(word(file, 24), kind.height);
    EXPECT_EQ(word(file, 36), 1U);  // faces
    EXPECT_EQ(word(file, 40), levels.size());
    EXPECT_EQ(word(file, 44), 2U);  // Zstandard
    const std::uint32_t descriptor = word(file, 48), samples = (word(file, 52) - 28) / 16;
    EXPECT_EQ(word(file, descriptor), word(file, 52));
    EXPECT_EQ(word(file, descriptor + 12) >> 16U & 255U, kind.use == TextureUse::color ? 2U : 1U);
    const std::uint32_t texel = kind.block_bytes + kind.texel_bytes;
    EXPECT_EQ(word(file, descriptor + 20), texel);  // bytes of the plane
    EXPECT_EQ(samples, kind.block_bytes != 0 ? texel / 8 : texel);
    expect_samples(file, descriptor + 28, kind);
    std::size_t in_dds = 148;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const std::size_t entry = 80 + 24 * k, size = level_bytes(kind, levels[k]);
      const std::uint64_t at = long_word(file, entry), packed = long_word(file, entry + 8);
      ASSERT_EQ(long_word(file, entry + 16), size);
      ASSERT_LE(at + packed, file.size());
      std::vector<std::byte> texels(size);
      ASSERT_EQ(ZSTD_decompress(texels.data(), size, file.data() + at, packed), size);
      EXPECT_EQ(std::memcmp(texels.data(), dds.data() + in_dds, size), 0);
      in_dds += size;
    }
  }
}
#endif

TEST(GpuTexture, StoredErrorIsThatOfWhatComesBack) {
  std::vector<std::pair<ImageFormat, std::string>> formats = {{ImageFormat::png8, "PNG"},
                                                              {ImageFormat::tga, "TGA"},
                                                              {ImageFormat::webp, "WebP"},
                                                              {ImageFormat::tiff8, "TIFF"}};
  const std::vector<std::string> read = picture_formats();
  for (const auto& [format, name] : formats) {
    if (std::find(read.begin(), read.end(), name) == read.end()) continue;
    for (const auto& [width, height] : {std::pair(33U, 21U), std::pair(1U, 1U)}) {
      for (const bool dither : {false, true}) {
        const Image image = ramp(width, height, 3);
        SaveImageOptions options = {format, dither};
        options.use = TextureUse::normal;
        const Image back = load_image(encode(image, options), "a.tga");
        const ImageDifference is = compare_images(image, back);
        const StoredError normals = stored_error(image, options);
        EXPECT_NEAR(normals.mean, is.mean_angle_degrees, 1e-9) << name;
        EXPECT_NEAR(normals.max, is.max_angle_degrees, 1e-9) << name;
        options.use = TextureUse::values;
        EXPECT_NEAR(stored_error(image, options).max, is.max_error * 255, 1e-4) << name;
        EXPECT_LE(is.max_error * 255, dither && format != ImageFormat::tiff8 ? 1.0 : 0.5001);
      }
    }
  }
}

/// Formats of bytes may store more channels than the picture has, or fewer: those of both count, each of them.
TEST(GpuTexture, StoredErrorIsOfTheChannelsOfBoth) {
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    for (std::uint32_t off = 0; off < channels; ++off) {
      Image image{4, 3, channels, {}};  // no blocks: values are bytes
      for (std::uint32_t i = 0; i < 12 * channels; ++i) {
        const bool is_off = i % channels == off;
        image.pixels.push_back(
            static_cast<float>((static_cast<double>(i * 31 % 251) + (is_off ? 0.375 : 0)) / 255));
      }
      for (const ImageFormat format : {ImageFormat::png8, ImageFormat::dds, ImageFormat::tga}) {
        for (const TextureUse use : {TextureUse::values, TextureUse::color}) {
          if (use == TextureUse::color && channels == 2) continue;  // DDS has no colours of two
          SaveImageOptions options{format};
          options.use = use;
          const StoredError error = stored_error(image, options);
          EXPECT_NEAR(error.max, 0.375, 1e-3) << channels << ' ' << off << ' ' << int(format);
          EXPECT_NEAR(error.mean, 0.375, 1e-3) << channels << ' ' << off << ' ' << int(format);
        }
      }
    }
  }
}

TEST(GpuTexture, PicturesOfBytesComeBack) {
  for (const auto& [format, name] :
       {std::pair(ImageFormat::tga, "TGA"), std::pair(ImageFormat::webp, "WebP")}) {
    const std::vector<std::string> read = picture_formats();
    if (std::find(read.begin(), read.end(), name) == read.end()) continue;
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
      Image image{5, 3, channels, {}};
      for (std::uint32_t i = 0; i < 15 * channels; ++i) {
        image.pixels.push_back(static_cast<float>(i * 7 % 256) / 255);
      }
      if (channels == 4) image.pixels[3] = 0;  // colours stay under no opacity
      const Image back = load_image(encode(image, {format}), "a.tga");
      for (std::size_t texel = 0; texel < 15; ++texel) {
        for (std::size_t c = 0; c < back.channels; ++c) {
          const float* const from = &image.pixels[texel * channels];
          const float wanted = channels == 1 ? from[0] : c < channels ? from[c] : 0;
          ASSERT_EQ(back.pixels[texel * back.channels + c], wanted) << name << channels;
        }
      }
    }
  }
}

TEST(GpuTexture, ErrorsOfBlocksCountBakedTexelsAlone) {
  Image image{8, 8, 1, std::vector<float>(64, 0.25F)};
  image.pixels[63] = std::nanf("");
  std::vector<std::uint8_t> coverage(64, 1);
  coverage[63] = 0;
  const SaveImageOptions options = {ImageFormat::dds};
  // 63.75 lies between two bytes; BC4 finds shades in between: 64 - 2/7 and so on, at most 1/14 off.
  EXPECT_LE(stored_error(image, options, coverage).max, 1.0 / 14 + 1e-5);
  EXPECT_EQ(stored_error(image, options).max, 255);
  EXPECT_EQ(stored_error(image, {ImageFormat::png16}).max, 0);
  EXPECT_THROW(stored_error(image, options, std::span(coverage).first(5)), Error);
}

TEST(GpuTexture, NormalsOfTwoChannelsAreMeasuredAsShadersReadThem) {
  // z is 0.5 and points down: a shader that takes the root has it point up.
  const float x = 0.6F, z = -0.8F;
  const Image image{4, 4, 3, [&] {
                      std::vector<float> pixels;
                      for (int i = 0; i < 16; ++i) {
                        pixels.insert(pixels.end(), {x / 2 + 0.5F, 0.5F, z / 2 + 0.5F});
                      }
                      return pixels;
                    }()};
  SaveImageOptions options = {ImageFormat::dds};
  options.use = TextureUse::tangent_normal;
  const double turned = 180 - 2 * std::acos(0.8) * 180 / 3.14159265358979;
  EXPECT_NEAR(stored_error(image, options).max, turned, 0.5);
  options.use = TextureUse::normal;
  EXPECT_LE(stored_error(image, options).max, 0.5);
}

TEST(GpuTexture, ImpossibleImagesAreRefused) {
  const Image wide{16384, 1, 1, std::vector<float>(16384)};
  EXPECT_THROW(encode(wide, {ImageFormat::webp}), Error);
  EXPECT_NO_THROW(encode(wide, {ImageFormat::tga}));
  const Image image = ramp(4, 4, 3);
  EXPECT_THROW(save_image(image, test::scratch_folder() / "a.png", {ImageFormat::dds}), Error);
  EXPECT_THROW(save_mipmapped(image, {}, test::scratch_folder() / "a.dds", {ImageFormat::dds}),
               Error);  // without its levels
}

}  // namespace
}  // namespace kiln
