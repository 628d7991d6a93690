// PNGs of assets: packed for bytes, dithered where it is needed.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "io/image/picture.h"
#include "io/image/png.h"
#include "kiln/image.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

/// Noise of a generator that is the same everywhere, in [0, 1].
struct Noise {
  std::uint32_t state = 1;
  double operator()() {
    state = state * 1664525U + 1013904223U;
    return static_cast<double>(state >> 8) / (1U << 24);
  }
};

/// \param noise  in steps of 1/255
Image picture(std::uint32_t width, std::uint32_t height, std::uint32_t channels, double noise) {
  Image image{width, height, channels, {}};
  Noise random;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        const double value =
            0.5 + 0.4 * std::sin(0.013 * x + c) * std::cos(0.017 * y) + noise / 255 * random();
        image.pixels.push_back(static_cast<float>(value));
      }
    }
  }
  return image;
}

std::size_t bytes_with(const Image& image, Deflate deflate) {
  std::size_t sum = 0;
  write_png(image, {.bits = 8, .deflate = deflate}, "memory",
            [&](std::string_view piece) { sum += piece.size(); });
  return sum;
}

/// The picture as the usual libraries pack it: the filter of least sums of absolute values a row, zlib's level 6.
std::size_t usual_bytes(const Image& image) {
  const std::size_t row = std::size_t{image.width} * image.channels, pixel = image.channels;
  std::vector<std::uint8_t> above(row, 0), values(row), raw;
  for (std::size_t y = 0; y < image.height; ++y) {
    quantise_row(image, 8, DitherBlocks(), y, values.data());
    std::vector<std::uint8_t> best;
    long least = -1;
    for (int filter = 0; filter < 5; ++filter) {
      std::vector<std::uint8_t> to = {static_cast<std::uint8_t>(filter)};
      long sum = 0;
      for (std::size_t i = 0; i < row; ++i) {
        const int a = i >= pixel ? values[i - pixel] : 0, b = above[i],
                  c = i >= pixel ? above[i - pixel] : 0;
        const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
        const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
        const int guesses[] = {0, a, b, (a + b) / 2, paeth};
        to.push_back(static_cast<std::uint8_t>(values[i] - guesses[filter]));
        sum += std::abs(static_cast<std::int8_t>(to.back()));
      }
      if (least >= 0 && sum >= least) continue;
      least = sum;
      best = to;
    }
    raw.insert(raw.end(), best.begin(), best.end());
    std::swap(values, above);
  }
  uLongf size = compressBound(static_cast<uLong>(raw.size()));
  std::vector<std::uint8_t> packed(size);
  compress2(packed.data(), &size, raw.data(), static_cast<uLong>(raw.size()), 6);
  return size;
}

/// Pixels stay, whatever packs them; sides of one texel, a row past a sample, and two channels are no exceptions.
TEST(PngDeflate, PixelsStay) {
  for (const auto& [width, height] : {std::pair{1U, 1U}, {1U, 65U}, {257U, 64U}, {100U, 81U}}) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
      const Image image = picture(width, height, channels, 3);
      const Image fast = load_image(encode(image, {.format = ImageFormat::png8}));
      for (const bool smallest : {false, true}) {
        const Image small = load_image(encode_picture(image, {.smallest = smallest}));
        ASSERT_EQ(small.channels, fast.channels);
        ASSERT_EQ(small.pixels, fast.pixels) << width << " x " << height << ", " << channels;
      }
    }
  }
}

/// The filter type of each row: the first byte of each row of the inflated stream (PNG, 3rd edition, section 9).
std::vector<std::uint8_t> filters_of(std::span<const std::byte> file, const Image& image) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  std::vector<std::uint8_t> packed;
  for (std::size_t at = 8; at + 12 <= file.size();) {
    const std::size_t length = std::size_t{bytes[at]} << 24 | std::size_t{bytes[at + 1]} << 16 |
                               std::size_t{bytes[at + 2]} << 8 | bytes[at + 3];
    if (std::memcmp(bytes + at + 4, "IDAT", 4) == 0) {
      packed.insert(packed.end(), bytes + at + 8, bytes + at + 8 + length);
    }
    at += 12 + length;
  }
  const std::size_t row = std::size_t{image.width} * image.channels + 1;
  std::vector<std::uint8_t> raw(row * image.height);
  auto size = static_cast<uLongf>(raw.size());
  EXPECT_EQ(uncompress(raw.data(), &size, packed.data(), static_cast<uLong>(packed.size())), Z_OK);
  EXPECT_EQ(size, raw.size());
  std::vector<std::uint8_t> filters;
  for (std::size_t y = 0; y < image.height; ++y) filters.push_back(raw[y * row]);
  return filters;
}

/// Pictures each of whose rows suits one filter by turns: noise, slopes along rows, along columns, along both, and steps
/// of two directions that meet where Paeth's three differences tie.
TEST(PngDeflate, EachOfTheFiveFiltersIsUsedAndUndone) {
  std::array<std::size_t, 5> used{};
  std::array<std::size_t, 2> paeth_ties{};
  for (std::uint32_t seed = 1; seed <= 24; ++seed) {
    for (const std::uint32_t channels : {1U, 3U}) {
      Noise random{seed};
      const int along = static_cast<int>(seed % 4) * 3, down = static_cast<int>(seed / 4 % 3) * 5;
      const int grain = static_cast<int>(seed % 5) * 2 + 1;
      Image image{40, 48, channels, {}};
      std::vector<int> values;
      for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 40; ++x) {
          for (std::uint32_t c = 0; c < channels; ++c) {
            const bool is_noisy = y % 16 >= 12;
            const int value =
                is_noisy ? static_cast<int>(255 * random())
                         : along * x + down * (y % 16) + static_cast<int>(grain * random());
            values.push_back(value & 0xFF);
            image.pixels.push_back(static_cast<float>(value & 0xFF) / 255);
          }
        }
      }
      for (const bool smallest : {false, true}) {
        const std::vector<std::byte> file = encode_picture(image, {.smallest = smallest});
        const Image back = load_image(file);
        ASSERT_EQ(back.pixels.size(), values.size());
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < values.size(); ++i) {
          wrong += std::lround(back.pixels[i] * 255) == values[i] ? 0 : 1;
        }
        EXPECT_EQ(wrong, 0U) << seed << ' ' << channels << ' ' << smallest;
        const std::vector<std::uint8_t> filters = filters_of(file, image);
        for (std::size_t y = 0; y < filters.size(); ++y) {
          ASSERT_LT(filters[y], 5);
          ++used[filters[y]];
          if (filters[y] != 4 || y == 0) continue;
          const std::size_t row = std::size_t{40} * channels;
          for (std::size_t i = y * row + channels; i < (y + 1) * row; ++i) {
            const int a = values[i - channels], b = values[i - row], c = values[i - row - channels];
            const int to_a = std::abs(b - c), to_b = std::abs(a - c),
                      to_c = std::abs(a + b - 2 * c);
            paeth_ties[0] += to_a == to_c && to_a < to_b && a != c ? 1 : 0;
            paeth_ties[1] += to_b == to_c && to_b < to_a && b != c ? 1 : 0;
          }
        }
      }
    }
  }
  for (std::size_t filter = 0; filter < 5; ++filter) EXPECT_GT(used[filter], 20U) << filter;
  for (std::size_t tie = 0; tie < 2; ++tie) EXPECT_GT(paeth_ties[tie], 20U) << tie;
}

/// The fast encoding writes bands of rows, each after the last row of the one above: all their pixels are the rounded
/// values.
TEST(PngDeflate, PixelsOfAllBandsAreTheRoundedValues) {
  for (const std::uint32_t channels : {1U, 3U, 4U}) {
    const Image image = picture(1100, 400, channels, 20);  // two bands of 2^18 bytes at least
    for (const auto& [format, steps] :
         {std::pair{ImageFormat::png8, 255.0}, std::pair{ImageFormat::png16, 65535.0}}) {
      const Image back = load_image(encode(image, {.format = format}));
      ASSERT_EQ(back.channels, channels);
      ASSERT_EQ(back.pixels.size(), image.pixels.size());
      std::size_t off = 0;
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double value = std::clamp(double{image.pixels[i]}, 0.0, 1.0);
        off += std::abs(back.pixels[i] * steps - value * steps) > 0.5 + 1e-2 ? 1 : 0;
      }
      EXPECT_EQ(off, 0U) << channels << " channels, steps of 1/" << steps;
    }
  }
}

/// For fewer bytes than the usual libraries take: of smooth maps, grain, and one colour.
TEST(PngDeflate, TakesNoMoreBytesThanTheUsualLibraries) {
  for (const double noise : {0.0, 1.5, 20.0}) {
    const Image image = picture(512, 512, 3, noise);
    const std::size_t small = bytes_with(image, Deflate::small), usual = usual_bytes(image);
    EXPECT_LE(small, usual) << noise;
    EXPECT_LE(bytes_with(image, Deflate::smallest), small);
    EXPECT_LE(small, bytes_with(image, Deflate::fast));
  }
  EXPECT_LT(
      bytes_with({512, 512, 3, std::vector<float>(std::size_t{3} << 18, 0.3F)}, Deflate::small),
      2000U);
}

TEST(PngDeflate, BytesAreTheSameOnAnyNumberOfThreads) {
  const Image image = picture(300, 300, 3, 2);
  set_thread_limit(1);
  const std::vector<std::byte> one = encode_picture(image, {.dither = Dither::automatic});
  set_thread_limit(3);
  const std::vector<std::byte> three = encode_picture(image, {.dither = Dither::automatic});
  set_thread_limit(0);
  EXPECT_EQ(one, three);
}

/// A ramp in the first channel from left to right.
/// \param steps  of 1/255 over 32 texels
Image ramp(double steps) {
  Image image{128, 64, 3, {}};
  for (std::size_t i = 0; i < std::size_t{128} * 64; ++i) {
    image.pixels.push_back(static_cast<float>(0.3 + steps / 255 * (i % 128) / 32));
    image.pixels.push_back(0.7003F);
    image.pixels.push_back(static_cast<float>(0.9 + 0.3 / 255 * (i % 128) / 32));
  }
  return image;
}

/// Values of a channel in one column.
std::size_t values_in(const Image& image, std::uint32_t x, std::uint32_t channel) {
  std::vector<float> values;
  for (std::uint32_t y = 0; y < image.height; ++y) values.push_back(image.at(x, y)[channel]);
  std::sort(values.begin(), values.end());
  return static_cast<std::size_t>(std::unique(values.begin(), values.end()) - values.begin());
}

std::size_t dithered_columns(const Image& image, std::uint32_t channel) {
  std::size_t count = 0;
  for (std::uint32_t x = 0; x < image.width; ++x) count += values_in(image, x, channel) > 1 ? 1 : 0;
  return count;
}

Image stored(const Image& image, Dither dither, TextureUse use = TextureUse::values) {
  return load_image(encode_picture(image, {.dither = dither, .use = use}));
}

/// Slow ramps are dithered, and those alone: neither what changes by a step within 32 texels nor what does not change.
TEST(DitherByNeed, OnlySlowRampsAreDithered) {
  // Rows of a column are alike, so a column of two values is dithered.
  EXPECT_GT(dithered_columns(stored(ramp(0.8), Dither::automatic), 0), 64U);
  EXPECT_EQ(dithered_columns(stored(ramp(1.2), Dither::automatic), 0), 0U);
  EXPECT_EQ(dithered_columns(stored(ramp(0.05), Dither::automatic), 0), 0U);
  EXPECT_EQ(dithered_columns(stored(ramp(0.8), Dither::automatic), 1), 0U);
  EXPECT_GT(dithered_columns(stored(ramp(0.8), Dither::on), 1), 64U);
  EXPECT_EQ(dithered_columns(stored(ramp(0.8), Dither::off), 0), 0U);
  // Each channel by itself, and of normals z is rounded.
  EXPECT_GT(dithered_columns(stored(ramp(1.2), Dither::automatic), 2), 32U);
  EXPECT_EQ(dithered_columns(stored(ramp(1.2), Dither::automatic, TextureUse::normal), 2), 0U);
  EXPECT_GT(dithered_columns(stored(ramp(0.8), Dither::automatic, TextureUse::normal), 0), 64U);
  const Image tangent = stored(ramp(0.8), Dither::automatic, TextureUse::tangent_normal);
  EXPECT_EQ(dithered_columns(tangent, 2), 0U);
  EXPECT_GT(dithered_columns(tangent, 0), 64U);
}

/// The mean of a dithered ramp is the ramp: by 8 x 8 texels within 1/64 of a step, and what the ramp changes by in 8.
TEST(DitherByNeed, LeavesNoBand) {
  const Image image = ramp(0.8), back = stored(image, Dither::automatic);
  const Image rounded = stored(image, Dither::off);
  double most = 0, most_rounded = 0;
  for (std::uint32_t x = 0; x + 8 <= image.width; x += 8) {
    double sum = 0, sum_rounded = 0, exact = 0;
    for (std::uint32_t y = 0; y < 8; ++y) {
      for (std::uint32_t k = 0; k < 8; ++k) {
        sum += back.at(x + k, y)[0];
        sum_rounded += rounded.at(x + k, y)[0];
        exact += image.at(x + k, y)[0];
      }
    }
    most = std::max(most, std::abs(sum - exact) / 64 * 255);
    most_rounded = std::max(most_rounded, std::abs(sum_rounded - exact) / 64 * 255);
  }
  EXPECT_LT(most, 0.1);
  EXPECT_GT(most_rounded, 0.3);
}

/// What errors say is what comes back.
TEST(DitherByNeed, ErrorsAreThoseOfWhatComesBack) {
  const Image image = ramp(0.8);
  for (const Dither dither : {Dither::off, Dither::automatic, Dither::on}) {
    const Image back = stored(image, dither);
    double most = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      most = std::max(most, std::abs(double{back.pixels[i]} - image.pixels[i]) * 255);
    }
    EXPECT_NEAR(picture_error(image, {.dither = dither}, {}).max, most, 1e-3);
  }
}

}  // namespace
}  // namespace kiln
