// Means of pictures over parallelograms, against integrals in closed form.
#include "image/texture_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "base/parallel.h"
#include "base/srgb.h"
#include "kiln/error.h"
#include "kiln/image.h"

namespace kiln {
namespace {

/// A picture of squares, black at its upper left.
Image checkerboard(std::uint32_t width, std::uint32_t height, std::uint32_t cell) {
  Image image{width, height, 1, std::vector<float>(std::size_t{width} * height)};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      *image.at(x, y) = static_cast<float>((x / cell + y / cell) % 2);
    }
  }
  return image;
}

/// The mean of the square wave that is -1 on [0, 1), 1 on [1, 2) and so on, over [begin, end].
double wave(double begin, double end) {
  const auto integral = [](double x) {
    const double turn = x - 2 * std::floor(x / 2);
    return turn < 1 ? -turn : turn - 2;
  };
  return (integral(end) - integral(begin)) / (end - begin);
}

std::shared_ptr<const Image> shared(Image image) {
  return std::make_shared<const Image>(std::move(image));
}

float mean_of(const FilteredTexture& texture, double u, double v,
              const FilteredTexture::ParallelogramSides& sides) {
  float value[4] = {};
  texture.mean(u, v, sides, value);
  return value[0];
}

TEST(TextureFilter, MeansOfACheckerboardAreItsIntegrals) {
  constexpr std::uint32_t kSide = 256, kCell = 16;
  const FilteredTexture texture(shared(checkerboard(kSide, kSide, kCell)), TextureKind::linear);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2, 2), size(2, 48);
  double squares = 0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    // A rectangle of texels.
    const double u = place(random), v = place(random), w = size(random), h = size(random);
    const double x = u * kSide, y = (1 - v) * kSide;
    const double exact = 0.5 - 0.5 * wave((x - w / 2) / kCell, (x + w / 2) / kCell) *
                                   wave((y - h / 2) / kCell, (y + h / 2) / kCell);
    const double mean = mean_of(texture, u, v, {{{w / kSide, 0}, {0, h / kSide}}});
    // Bilinear reading spreads an edge over two texels of the level, which is at most half the shorter side
    // wide: it moves at most 1/16 of a step to the wrong side of a border, and rectangles have four.
    EXPECT_NEAR(mean, exact, 0.125) << u << " " << v << " " << w << " " << h;
    squares += (mean - exact) * (mean - exact);
  }
  EXPECT_LT(std::sqrt(squares / kTrials), 0.015);
}

TEST(TextureFilter, SkewedAndLongAreasAreIntegratedToo) {
  constexpr std::uint32_t kSide = 256;
  // Stripes along x: the mean over any parallelogram is that of its shadow on y.
  Image stripes{kSide, kSide, 1, std::vector<float>(std::size_t{kSide} * kSide)};
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) *stripes.at(x, y) = static_cast<float>(y / 8 % 2);
  }
  const FilteredTexture texture(shared(stripes), TextureKind::linear);
  // 200 texels along x by 3 along y: a filter as wide as it is long would be grey everywhere.
  for (int y = 4; y < 250; y += 8) {
    const double v = 1 - y / double{kSide};
    const double sides = mean_of(texture, 0.3, v, {{{200.0 / kSide, 0}, {0, 3.0 / kSide}}});
    EXPECT_NEAR(sides, y / 8 % 2, 0.02) << y;
  }
  // Sheared: its shadow on y is 64 texels long, four whole periods.
  EXPECT_NEAR(mean_of(texture, 0.1, 0.77, {{{40.0 / kSide, 64.0 / kSide}, {0.001, 0}}}), 0.5, 0.02);
}

/// A thin area along a diagonal, given by two sides that are nearly one: it is as wide as they are apart.
TEST(TextureFilter, ThinAreasOfTwoLongSidesAreNotBlurred) {
  constexpr std::uint32_t kSide = 256;
  Image stripes{kSide, kSide, 1, std::vector<float>(std::size_t{kSide} * kSide)};
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      *stripes.at(x, y) = static_cast<float>((x + kSide - y) / 16 % 2);
    }
  }
  const FilteredTexture texture(shared(stripes), TextureKind::linear);
  // x - y is the same along a side of (60, 60) texels, and differs by 3 along one of (60, 63).
  const FilteredTexture::ParallelogramSides sides{
      {{60.0 / kSide, -60.0 / kSide}, {60.0 / kSide, -63.0 / kSide}}};
  for (int stripe = 0; stripe < 16; ++stripe) {
    const double x = 128, y = x + kSide - 16 * stripe - 8;  // in the stripe's middle
    if (y < 0) continue;
    EXPECT_NEAR(mean_of(texture, x / kSide, 1 - y / kSide, sides), stripe % 2, 0.02) << stripe;
  }
}

TEST(TextureFilter, ColoursAreMeansOfLight) {
  Image image{64, 64, 3, std::vector<float>(std::size_t{64} * 64 * 3)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = i / 3 % 2 == 0 ? 1.0F : 0.0F;  // columns of white and black
  }
  const FilteredTexture texture(shared(image), TextureKind::srgb);
  const double light = mean_of(texture, 0.5, 0.5, {{{0.5, 0}, {0, 0.5}}});
  EXPECT_NEAR(light, 0.5, 1e-6);
  EXPECT_NEAR(to_srgb(static_cast<float>(light)), 0.735357, 1e-5);  // not 0.5
}

TEST(TextureFilter, TakesAnySizeAndRepeats) {
  const FilteredTexture line(shared(checkerboard(100000, 1, 50000)), TextureKind::linear);
  EXPECT_NEAR(mean_of(line, 0.25, 0.5, {{{0.1, 0}, {0, 1}}}), 0, 1e-6);
  EXPECT_NEAR(mean_of(line, 7.75, -3.2, {{{0.1, 0}, {0, 1}}}), 1, 1e-6);
  EXPECT_NEAR(mean_of(line, 0.5, 0.5, {{{1, 0}, {0, 1}}}), 0.5, 1e-4);
  const FilteredTexture odd(shared(checkerboard(37, 101, 37)), TextureKind::linear);
  double sum = 0;
  for (std::uint32_t y = 0; y < 101; ++y) sum += y / 37 % 2;
  EXPECT_NEAR(mean_of(odd, 0.5, 0.5, {{{1e9, 0}, {0, 1e9}}}), sum / 101, 1e-5)
      << "odd sides lose nothing on the way down";
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(mean_of(odd, 0.5, 0.5, {{{infinity, 0}, {0, 1}}}), sum / 101, 1e-5);
}

TEST(TextureFilter, ClampsAndMirrorsAsAPictureThatIsLaidOutSo) {
  // Noise of 16 x 8 texels, and five pictures of it side by side as each wrap has them, the middle one itself.
  constexpr std::int64_t kWide = 16, kHigh = 8, kTimes = 5;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> noise(0, 1);
  Image image{kWide, kHigh, 1, std::vector<float>(kWide * kHigh)};
  for (float& value : image.pixels) value = noise(random);
  const FilteredTexture texture(shared(image), TextureKind::linear);
  const auto texel = [](std::int64_t place, std::int64_t size, TextureWrap wrap) {
    if (wrap == TextureWrap::clamp) return std::clamp<std::int64_t>(place, 0, size - 1);
    const std::int64_t picture = (place + 4 * size) / size - 4, rest = place - picture * size;
    return wrap == TextureWrap::mirror && picture % 2 != 0 ? size - 1 - rest : rest;
  };
  for (const auto& [across, down] : {std::pair(TextureWrap::clamp, TextureWrap::mirror),
                                     std::pair(TextureWrap::mirror, TextureWrap::repeat),
                                     std::pair(TextureWrap::repeat, TextureWrap::clamp)}) {
    Image wide{kWide * kTimes, kHigh * kTimes, 1,
               std::vector<float>(kWide * kHigh * kTimes * kTimes)};
    for (std::int64_t y = 0; y < kHigh * kTimes; ++y) {
      for (std::int64_t x = 0; x < kWide * kTimes; ++x) {
        const std::int64_t from_x = texel(x - 2 * kWide, kWide, across);
        const std::int64_t from_y = texel(y - 2 * kHigh, kHigh, down);
        *wide.at(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) =
            *image.at(static_cast<std::uint32_t>(from_x), static_cast<std::uint32_t>(from_y));
      }
    }
    const FilteredTexture laid_out(shared(wide), TextureKind::linear);
    std::uniform_real_distribution<double> place(-1.5, 2.5), size(0.01, 1.9);  // of a texel or two
    for (int i = 0; i < 2000; ++i) {
      const double u = place(random), v = place(random);
      const double w = size(random) / kWide, h = size(random) / kHigh;
      float found[4], wanted[4];
      texture.mean(u, v, {{{w, 0}, {0, h}}}, found, {across, down});
      laid_out.mean((u + 2) / kTimes, (v + 2) / kTimes, {{{w / kTimes, 0}, {0, h / kTimes}}},
                    wanted);
      EXPECT_NEAR(found[0], wanted[0], 1e-4) << u << ' ' << v;  // rounding of texels in floats
    }
  }
}

TEST(TextureFilter, NumbersThatAreNoneCountAsZero) {
  Image image{2, 1, 1, {std::numeric_limits<float>::quiet_NaN(), 1}};
  const FilteredTexture texture(shared(image), TextureKind::linear);
  EXPECT_EQ(texture.replaced_values(), 1U);
  EXPECT_NEAR(mean_of(texture, 0.5, 0.5, {{{1, 0}, {0, 1}}}), 0.5, 1e-6);
  EXPECT_THROW(FilteredTexture(shared(Image{2, 1, 1, {0, 0}}), TextureKind::normal), Error);
  EXPECT_THROW(FilteredTexture(shared(Image{}), TextureKind::srgb), Error);
}

TEST(Srgb, FollowsTheFormula) {
  for (int i = 0; i <= 100000; ++i) {
    const double linear = i / 100000.0;
    const double wanted =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    EXPECT_NEAR(to_srgb(static_cast<float>(linear)), wanted, 3e-7) << linear;
  }
  for (int i = 0; i < 256; ++i) {
    const float linear = linear_values_of_bytes()[static_cast<std::size_t>(i)];
    EXPECT_EQ(std::lround(255 * to_srgb(linear)), i);
  }
  EXPECT_EQ(to_srgb(2), 1);
  EXPECT_EQ(to_srgb(-1), 0);
  EXPECT_EQ(to_srgb(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Srgb, OpacityIsNoLight) {
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    Image image{2, 1, channels, std::vector<float>(std::size_t{2} * channels, 0.25F)};
    to_srgb(image);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const bool is_opacity = i % channels == 3;
      EXPECT_EQ(image.pixels[i], is_opacity ? 0.25F : to_srgb(0.25F)) << channels << ' ' << i;
    }
  }
}

TEST(TextureFilter, ThreadsThatReadItsLevelsFirstAgree) {
  constexpr std::uint32_t kSide = 256;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(0, 1);
  Image noise{kSide, kSide, 3, std::vector<float>(std::size_t{kSide} * kSide * 3)};
  for (float& number : noise.pixels) number = value(random);
  const auto picture = shared(std::move(noise));
  // Each place of a size that takes another level, coarse ones first.
  const auto read = [](const FilteredTexture& texture, std::size_t place) {
    const double side = 1.0 / static_cast<double>(std::size_t{1} << (place % 8));
    return mean_of(texture, 0.37 * static_cast<double>(place), 0.21, {{{side, 0}, {0, side}}});
  };
  const FilteredTexture alone(picture, TextureKind::linear);
  for (int trial = 0; trial < 20; ++trial) {
    const FilteredTexture texture(picture, TextureKind::linear);
    parallel_for(
        64, 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t place = begin; place < end; ++place) {
            EXPECT_EQ(read(texture, place), read(alone, place));
          }
        },
        4);
  }
}

/// Opaque texels of one colour among transparent ones of another.
Image stripes(std::uint32_t channels) {
  Image image{64, 64, channels, {}};
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    for (std::uint32_t c = 0; c + 1 < channels; ++c) {
      image.pixels.push_back(i % 64 % 3 == 0 ? 0.5F : 0.0F);
    }
    image.pixels.push_back(i % 64 % 3 == 0 ? 1.0F : 0.0F);
  }
  return image;
}

TEST(TextureFilter, TransparentTexelsHaveNoWeight) {
  for (const std::uint32_t channels : {2U, 4U}) {
    const FilteredTexture weighted(shared(stripes(channels)), TextureKind::srgb,
                                   {.by_alpha = true});
    const FilteredTexture plain(shared(stripes(channels)), TextureKind::srgb);
    EXPECT_TRUE(weighted.is_weighted());
    for (const double texels : {1e-3, 2.0, 7.0, 40.0, 300.0}) {
      float with[4] = {}, without[4] = {};
      const FilteredTexture::ParallelogramSides sides = {{{texels / 64, 0}, {0, texels / 64}}};
      weighted.mean(0.5 + 1.5 / 64, 0.4, sides, with);
      plain.mean(0.5 + 1.5 / 64, 0.4, sides, without);
      EXPECT_NEAR(with[0], from_srgb(0.5), 1e-5) << texels;
      EXPECT_NEAR(with[channels - 1], without[channels - 1], 1e-5) << texels;
      if (texels > 2) EXPECT_LT(without[0], 0.6 * from_srgb(0.5));
    }
  }
  // Where nothing has weight, it is what is there.
  const Image clear{4, 4, 4, [] {
                      std::vector<float> pixels;
                      for (int i = 0; i < 16; ++i) {
                        pixels.insert(pixels.end(), {0.25F, 1, 0, 0});
                      }
                      return pixels;
                    }()};
  const FilteredTexture nothing(shared(clear), TextureKind::linear, {.by_alpha = true});
  float value[4] = {};
  nothing.mean(0.3, 0.3, {{{0.1, 0}, {0, 0.1}}}, value);
  EXPECT_NEAR(value[0], 0.25, 1e-6);
  EXPECT_EQ(value[3], 0);
}

TEST(TextureFilter, OpaquePicturesAreTheSameToTheBit) {
  std::mt19937 random(5);
  Image image{37, 29, 4, {}};
  for (std::size_t i = 0; i < 37 * 29 * 4; ++i) {
    image.pixels.push_back(i % 4 == 3 ? 1.0F : static_cast<float>(random() % 256) / 255);
  }
  const FilteredTexture weighted(shared(image), TextureKind::srgb, {.by_alpha = true});
  const FilteredTexture plain(shared(image), TextureKind::srgb);
  EXPECT_FALSE(weighted.is_weighted());
  for (int i = 0; i < 100; ++i) {
    float a[4] = {}, b[4] = {};
    const double u = i * 0.137, size = i * 0.004;
    weighted.mean(u, u, {{{size, 0}, {0, size}}}, a);
    plain.mean(u, u, {{{size, 0}, {0, size}}}, b);
    for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(a[c], b[c]);
  }
}

TEST(TextureFilter, EmptyTexelsShowWhereNothingElseDoes) {
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    // The left half holds 0.8, the right one nothing, in black.
    Image image{64, 64, channels, {}};
    TexelBits empty(64, 64);
    for (std::size_t i = 0; i < 64 * 64; ++i) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        image.pixels.push_back(c == 3 ? 1.0F : i % 64 < 32 ? 0.8F : 0.1F);
      }
    }
    for (std::size_t y = 0; y < 64; ++y) empty.add(y, 32, 64);
    const FilteredTexture filled(shared(image), TextureKind::linear, {.empty = &empty});
    for (const double texels : {1e-3, 3.0, 20.0}) {
      float value[4] = {};
      const FilteredTexture::ParallelogramSides sides = {{{texels / 64, 0}, {0, texels / 64}}};
      filled.mean(0.5, 0.4, sides, value);  // on the border
      EXPECT_NEAR(value[0], 0.8, 1e-4) << channels << " " << texels;
      filled.mean(0.8, 0.4, {{{1e-3, 0}, {0, 1e-3}}}, value);  // far out
      EXPECT_NEAR(value[0], 0.1, 1e-4) << channels;
    }
  }
}

}  // namespace
}  // namespace kiln
