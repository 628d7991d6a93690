// Dithered 8-bit normals show no band in the highlight of a large bevel.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "kiln/image.h"

namespace kiln {
namespace {

constexpr std::uint32_t kWidth = 1024, kHeight = 64;
constexpr double kBend = 10;    // degrees that the bevel turns over the map's width
constexpr double kPower = 400;  // of the highlight

double radians(std::uint32_t column) {
  return ((column + 0.5) / kWidth - 0.5) * kBend * std::numbers::pi / 180;
}

/// A bevel along u: n/2 + 1/2.
Image bevel() {
  Image map{kWidth, kHeight, 3, {}};
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      map.pixels.push_back(static_cast<float>(std::sin(radians(x)) / 2 + 0.5));
      map.pixels.push_back(0.5F);
      map.pixels.push_back(static_cast<float>(std::cos(radians(x)) / 2 + 0.5));
    }
  }
  return map;
}

/// The highlight of a light in front, which an eye or a screen sees over a few pixels: means of squares of 8.
std::vector<double> highlight(const Image& map) {
  constexpr std::uint32_t kSquare = 8;
  std::vector<double> means(kWidth / kSquare);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      const float* texel = map.at(x, y);
      const double n[3] = {2.0 * texel[0] - 1, 2.0 * texel[1] - 1, 2.0 * texel[2] - 1};
      const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      // Half-way between eye and light, off the middle so that the highlight has a flank.
      const double half[3] = {std::sin(0.05), 0, std::cos(0.05)};
      const double cosine = (n[0] * half[0] + n[1] * half[1] + n[2] * half[2]) / size;
      means[x / kSquare] += std::pow(std::max(0.0, cosine), kPower) / (kSquare * kHeight);
    }
  }
  return means;
}

/// The largest difference from the exact highlight, and that of steps from square to square.
struct Bands {
  double most = 0, step = 0;
};

Bands bands(const Image& map, const std::vector<double>& exact) {
  const std::vector<double> shown = highlight(map);
  Bands result;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    result.most = std::max(result.most, std::abs(shown[i] - exact[i]));
    if (i == 0) continue;
    result.step =
        std::max(result.step, std::abs((shown[i] - shown[i - 1]) - (exact[i] - exact[i - 1])));
  }
  return result;
}

TEST(Dither, LeavesNoBandInTheHighlightOfALargeBevel) {
  const Image map = bevel();
  const std::vector<double> exact = highlight(map);
  const auto stored = [&](const SaveImageOptions& options) {
    return load_image(encode(map, options));
  };
  const Bands rounded = bands(stored({.format = ImageFormat::png8}), exact);
  const Bands dithered = bands(stored({.format = ImageFormat::png8, .dither = true}), exact);
  const Bands fine = bands(stored({.format = ImageFormat::png16}), exact);
  // Steps of the screen, which has 255 levels: of four an eye sees the edge, of one and a half it does not.
  EXPECT_GT(rounded.step, 4 / 255.0);
  EXPECT_LT(dithered.step, 1.5 / 255.0);
  EXPECT_LT(dithered.most, 2 / 255.0);
  EXPECT_LT(dithered.step, 0.25 * rounded.step);
  EXPECT_LT(fine.step, 0.1 / 255);
  std::printf("steps, of 255 levels: rounded %.2f, dithered %.2f, 16 bits %.3f\n",
              rounded.step * 255, dithered.step * 255, fine.step * 255);
}

TEST(Dither, IsTheSameOnAnyNumberOfThreads) {
  SaveImageOptions options{.format = ImageFormat::png8, .dither = true};
  options.threads = 1;
  const std::vector<std::byte> one = encode(bevel(), options);
  options.threads = 3;
  EXPECT_EQ(encode(bevel(), options), one);
  EXPECT_EQ(encode(bevel(), options), one);
}

}  // namespace
}  // namespace kiln
