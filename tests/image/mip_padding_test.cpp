// Padding under which box-filtered mip levels keep the charts' mean: against sums in double precision.
#include "image/mip_padding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
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

/// Largest difference as that of largest_bias() from level `first_level` on, where a level's texel is the mean of the
/// image's texels under it: fewer at the right and lower sides of an image whose sides are no multiple of its side.
double largest_ragged_bias(const Atlas& atlas, std::uint32_t channel, std::uint32_t first_level) {
  double mean = 0, all = 0, largest = 0;
  const auto is_chart = [&](std::size_t i) { return in_chart(atlas.coverage[i]) ? 1.0 : 0.0; };
  const auto value = [&](std::size_t i) {
    return double{atlas.image.pixels[i * atlas.image.channels + channel]};
  };
  for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
    mean += is_chart(i) * value(i);
    all += is_chart(i);
  }
  mean /= all;
  const std::size_t width = atlas.image.width, height = atlas.image.height;
  for (std::size_t side = std::size_t{1} << first_level; side / 2 < std::max(width, height);
       side *= 2) {
    double weighted = 0;
    for (std::size_t top = 0; top < height; top += side) {
      for (std::size_t left = 0; left < width; left += side) {
        double sum = 0, charts = 0, count = 0;
        for (std::size_t y = top; y < std::min(top + side, height); ++y) {
          for (std::size_t x = left; x < std::min(left + side, width); ++x) {
            sum += value(y * width + x);
            charts += is_chart(y * width + x);
            ++count;
          }
        }
        weighted += charts * sum / count;
      }
    }
    largest = std::max(largest, 255 * std::abs(weighted / all - mean));
  }
  return largest;
}

TEST(MipPadding, AllLevelsKeepTheMeanInPicturesOfAnySize) {
  // Charts also at the sides, where a level's texels cover less of the image.
  for (const auto& [width, height] : {std::pair{289U, 353U}, std::pair{513U, 300U}}) {
    Atlas atlas = discs(width, height, 1);
    ASSERT_GT(largest_ragged_bias(atlas, 0, 1), 20);
    pad_for_mips(atlas.image, atlas.coverage);
    EXPECT_LT(largest_ragged_bias(atlas, 0, 1), 0.4) << width << " x " << height;
  }
}

/// Cells around random points, of black, white or pure colours with stripes, `gap` texels apart: most of the padding is
/// copies of charts' borders. \param copies  width of that padding, texels
Atlas dense_cells(std::uint32_t size, std::size_t cells, double gap, std::int64_t copies) {
  Atlas atlas{{size, size, 3, {}}, {}};
  atlas.image.pixels.resize(std::size_t{3} * size * size);
  atlas.coverage.assign(std::size_t{size} * size, kCoverageEmpty);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(0, size);
  std::vector<std::array<double, 2>> points(cells);
  std::vector<std::array<double, 3>> colors(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    points[i] = {place(random), place(random)};
    for (double& channel : colors[i]) channel = random() % 2 == 0 ? 0.05 : 0.95;
  }
  const auto color_at = [&](std::int64_t x, std::int64_t y, std::size_t cell, std::size_t c) {
    const double stripe = 0.3 * std::sin(0.3 * static_cast<double>(x + 2 * y));
    return static_cast<float>(std::clamp(colors[cell][c] + stripe, 0.0, 1.0));
  };
  std::vector<std::size_t> owner(atlas.coverage.size());
  for (std::size_t i = 0; i < owner.size(); ++i) {
    const auto x = static_cast<std::int64_t>(i % size), y = static_cast<std::int64_t>(i / size);
    std::array<double, 2> near{1e9, 1e9};
    std::array<std::size_t, 2> cell{};
    for (std::size_t k = 0; k < cells; ++k) {
      const double d =
          std::hypot(points[k][0] - static_cast<double>(x), points[k][1] - static_cast<double>(y));
      if (d < near[0]) {
        near = {d, near[0]};
        cell = {k, cell[0]};
      } else if (d < near[1]) {
        near[1] = d;
        cell[1] = k;
      }
    }
    owner[i] = cell[0];
    const double between = std::hypot(points[cell[0]][0] - points[cell[1]][0],
                                      points[cell[0]][1] - points[cell[1]][1]);
    if ((near[1] * near[1] - near[0] * near[0]) / (2 * between) < gap / 2) continue;
    atlas.coverage[i] = kCoverageBaked;
    for (std::size_t c = 0; c < 3; ++c) {
      atlas.at(i % size, i / size, c) = color_at(x, y, cell[0], c);
    }
  }
  const std::vector<std::uint8_t> charts = atlas.coverage;
  const auto side = static_cast<std::int64_t>(size);
  for (std::size_t i = 0; i < owner.size(); ++i) {
    if (charts[i] != kCoverageEmpty) continue;
    const auto x = static_cast<std::int64_t>(i % size), y = static_cast<std::int64_t>(i / size);
    std::int64_t best = 1000, from = -1;
    for (std::int64_t v = std::max<std::int64_t>(0, y - copies);
         v <= std::min(side - 1, y + copies); ++v) {
      for (std::int64_t u = std::max<std::int64_t>(0, x - copies);
           u <= std::min(side - 1, x + copies); ++u) {
        const std::int64_t far = (u - x) * (u - x) + (v - y) * (v - y);
        if (charts[static_cast<std::size_t>(v * side + u)] == kCoverageEmpty || far >= best)
          continue;
        best = far;
        from = v * side + u;
      }
    }
    if (from < 0) continue;
    atlas.coverage[i] = kCoverageGutter;
    for (std::size_t c = 0; c < 3; ++c) {
      atlas.image.pixels[3 * i + c] = atlas.image.pixels[3 * static_cast<std::size_t>(from) + c];
    }
  }
  return atlas;
}

/// Also in dense atlases, where most of the padding is copies.
TEST(MipPadding, DenseAtlasesKeepTheMeanOfTheCharts) {
  for (const auto& [cells, gap] : {std::pair<std::size_t, double>{60, 4}, {300, 4}, {300, 8}}) {
    Atlas atlas = dense_cells(512, cells, gap, 2);
    pad_for_mips(atlas.image, atlas.coverage);
    for (std::uint32_t c = 0; c < 3; ++c) {
      EXPECT_LT(largest_bias(atlas, c), 0.5) << cells << " " << gap;
    }
  }
}

/// Where few texels lie two or more from a chart, and charts are black and white, no values in the charts' range meet
/// the bound: the least that is possible here is 0.56 (by linear programming over the 5,400 texels that may change).
TEST(MipPadding, NarrowPaddingComesNear) {
  Atlas atlas = dense_cells(256, 80, 4, 2);
  ASSERT_GT(largest_bias(atlas, 1), 1.6);
  pad_for_mips(atlas.image, atlas.coverage);
  for (std::uint32_t c = 0; c < 3; ++c) EXPECT_LT(largest_bias(atlas, c), 0.8);
}

/// A padding of one texel that was chosen keeps its copies, and the mean.
TEST(MipPadding, ChosenPaddingKeepsItsCopies) {
  Atlas atlas = dense_cells(512, 300, 4, 1);
  const Atlas before = atlas;
  pad_for_mips(atlas.image, atlas.coverage, /*keeps_copies=*/true);
  for (std::uint32_t c = 0; c < 3; ++c) EXPECT_LT(largest_bias(atlas, c), 0.5);
  for (std::size_t i = 0; i < atlas.coverage.size(); ++i) {
    if (atlas.coverage[i] == kCoverageEmpty) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(atlas.image.pixels[3 * i + c], before.image.pixels[3 * i + c]);
    }
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
