// Padding under which box-filtered mip levels keep the charts' mean: against sums in double precision.
#include "image/mip_padding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "image/gutter.h"

namespace kiln {
namespace {

struct Atlas {
  Image image;
  std::vector<std::uint8_t> coverage;

  float& at(std::size_t x, std::size_t y, std::size_t c) {
    return image.pixels[(y * image.width + x) * image.channels + c];
  }
};

/// Discs of four sizes on a grid, whose values fall off towards their borders: copies of the nearest texels are darker
/// than the charts. Two texels of padding around each; elsewhere the background, 0.
Atlas discs(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  Atlas atlas{{width, height, channels, {}}, {}};
  atlas.image.pixels.resize(std::size_t{width} * height * channels);
  atlas.coverage.assign(std::size_t{width} * height, kCoverageEmpty);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::uint32_t cell = 64, i = x / cell, j = y / cell;
      const double u = x % cell - 31.5, v = y % cell - 31.5, r = std::hypot(u, v);
      const double radius = 14 + 5.0 * ((i * 7 + j * 3) % 4);
      if (r > radius + 2) continue;
      atlas.coverage[y * width + x] = r <= radius ? kCoverageBaked : kCoverageGutter;
      const double across = std::min(1.0, r / radius);
      for (std::uint32_t c = 0; c < channels; ++c) {
        const double tint = 0.5 + 0.08 * ((i + 2 * j + c) % 6);
        atlas.at(x, y, c) = static_cast<float>(tint * (1 - 0.3 * across * across));
      }
    }
  }
  return atlas;
}

bool in_chart(std::uint8_t coverage) {
  return coverage == kCoverageBaked || coverage == kCoverageMissed;
}

/// Largest difference over levels, steps of 1/255, between the charts' mean and the mean of a box-filtered level,
/// weighted by the charts' area under its texels.
double largest_bias(const Atlas& atlas, std::uint32_t channel) {
  std::uint32_t width = atlas.image.width, height = atlas.image.height;
  std::vector<double> value(atlas.coverage.size()), weight(value.size());
  double mean = 0, all = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] = atlas.image.pixels[i * atlas.image.channels + channel];
    weight[i] = in_chart(atlas.coverage[i]) ? 1 : 0;
    mean += weight[i] * value[i];
    all += weight[i];
  }
  mean /= all;
  double largest = 0;
  for (;;) {
    double sum = 0;
    for (std::size_t i = 0; i < value.size(); ++i) sum += weight[i] * value[i];
    largest = std::max(largest, 255 * std::abs(sum / all - mean));
    if (width == 1 && height == 1) return largest;
    const std::uint32_t w = width / 2, h = height / 2;
    std::vector<double> next(std::size_t{w} * h), area(next.size());
    for (std::uint32_t y = 0; y < h; ++y) {
      for (std::uint32_t x = 0; x < w; ++x) {
        for (const std::size_t i :
             {std::size_t{2 * y} * width + 2 * x, std::size_t{2 * y} * width + 2 * x + 1,
              std::size_t{2 * y + 1} * width + 2 * x, std::size_t{2 * y + 1} * width + 2 * x + 1}) {
          next[y * w + x] += value[i] / 4;
          area[y * w + x] += weight[i];
        }
      }
    }
    value = std::move(next);
    weight = std::move(area);
    width = w;
    height = h;
  }
}

TEST(MipPadding, AllLevelsKeepTheMeanOfTheCharts) {
  for (const std::uint32_t channels : {1U, 3U}) {
    Atlas atlas = discs(512, 512, channels);
    const Atlas before = atlas;
    ASSERT_GT(largest_bias(before, 0), 20);
    pad_for_mips(atlas.image, atlas.coverage);
    for (std::uint32_t c = 0; c < channels; ++c) EXPECT_LT(largest_bias(atlas, c), 0.4) << c;
  }
}

TEST(MipPadding, ChartsAndTheirNearestPaddingStay) {
  Atlas atlas = discs(128, 96, 3);
  atlas.coverage[(31) * 128 + 31] = kCoverageMissed;
  const Atlas before = atlas;
  pad_for_mips(atlas.image, atlas.coverage);
  std::size_t filled = 0;
  for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float was = before.image.pixels[3 * i + c], is = atlas.image.pixels[3 * i + c];
      if (before.coverage[i] != kCoverageEmpty) {
        EXPECT_EQ(was, is) << i;
      } else {
        filled += is != was ? 1 : 0;
      }
    }
  }
  EXPECT_GT(filled, 10000U);
}

/// Padding beyond two texels gives way: that of one texel's value would bleed.
TEST(MipPadding, FarPaddingIsReplaced) {
  Atlas atlas = discs(128, 128, 1);
  for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
    const double u = static_cast<double>(i % 128 % 64) - 31.5,
                 v = static_cast<double>(i / 128 % 64) - 31.5;
    if (atlas.coverage[i] != kCoverageEmpty || std::hypot(u, v) < 34) continue;
    atlas.coverage[i] = kCoverageGutter;
    atlas.image.pixels[i] = 7;
  }
  pad_for_mips(atlas.image, atlas.coverage);
  EXPECT_LT(*std::max_element(atlas.image.pixels.begin(), atlas.image.pixels.end()), 7);
  EXPECT_LT(largest_bias(atlas, 0), 0.5);
}

TEST(MipPadding, OneValueIsThatEverywhere) {
  Atlas atlas = discs(96, 160, 4);
  for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      atlas.image.pixels[4 * i + c] =
          atlas.coverage[i] == kCoverageEmpty ? 0 : 0.25F * static_cast<float>(c);
    }
  }
  pad_for_mips(atlas.image, atlas.coverage);
  for (std::size_t i = 0; i < atlas.image.pixels.size(); ++i)
    ASSERT_EQ(atlas.image.pixels[i], 0.25F * static_cast<float>(i % 4)) << i;
}

TEST(MipPadding, ValuesStayInTheChartsRangeInPicturesOfAnySize) {
  for (const auto& [width, height] : {std::pair{37U, 53U}, std::pair{1U, 40U}, std::pair{300U, 9U},
                                      std::pair{2U, 1U}, std::pair{129U, 131U}}) {
    Atlas atlas = discs(width, height, 2);
    atlas.coverage[0] = kCoverageBaked;
    atlas.at(0, 0, 0) = 0.3F;
    float low = 1, high = 0;
    for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
      if (atlas.coverage[i] != kCoverageBaked) continue;
      low = std::min(low, atlas.image.pixels[2 * i]);
      high = std::max(high, atlas.image.pixels[2 * i]);
    }
    pad_for_mips(atlas.image, atlas.coverage);
    for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
      if (atlas.coverage[i] == kCoverageGutter) continue;
      ASSERT_GE(atlas.image.pixels[2 * i], low) << width << " x " << height;
      ASSERT_LE(atlas.image.pixels[2 * i], high) << width << " x " << height;
    }
  }
}

TEST(MipPadding, WithoutChartsNothingChanges) {
  Atlas atlas = discs(64, 64, 1);
  std::fill(atlas.coverage.begin(), atlas.coverage.end(), std::uint8_t{kCoverageEmpty});
  const std::vector<float> before = atlas.image.pixels;
  pad_for_mips(atlas.image, atlas.coverage);
  EXPECT_EQ(atlas.image.pixels, before);
}

}  // namespace
}  // namespace kiln
