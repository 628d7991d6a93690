#include "kiln/image.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace kiln {
namespace {

Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels, unsigned seed) {
  Image image{width, height, channels, {}};
  image.pixels.resize(std::size_t{width} * height * channels);
  std::mt19937 random(seed);
  for (float& value : image.pixels) value = static_cast<float>(random()) / 4294967296.0F;
  return image;
}

Image normals(std::vector<std::vector<float>> vectors) {
  Image image{static_cast<std::uint32_t>(vectors.size()), 1, 3, {}};
  for (const auto& n : vectors) {
    for (const float c : n) image.pixels.push_back(c / 2 + 0.5F);
  }
  return image;
}

TEST(CompareImages, KnownAngles) {
  const Image a = normals({{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}});
  const Image b =
      normals({{0, 0, 1}, {0, 1, 0}, {0, 0, -1}, {0.5F, 0.5F, 0}, {0, 0, 0}, {1, 0, 0}});
  const ImageDifference difference = compare_images(a, b);
  EXPECT_EQ(difference.compared_texels, 6u);
  EXPECT_NEAR(difference.mean_angle_degrees, (0 + 90 + 180 + 45 + 0 + 180) / 6.0, 1e-12);
  EXPECT_EQ(difference.max_angle_degrees, 180.0);
  EXPECT_EQ(difference.worst_x, 2u);  // the first of equals
  EXPECT_EQ(difference.max_error, 1.0);
  EXPECT_NEAR(difference.mean_error, (0.5 + 0.5 + 1 + 0.25 + 0.25 + 0.5) / 18, 1e-12);
}

TEST(CompareImages, TinyAnglesAreNotLost) {
  // acos of a dot product would give 0 below about 0.0001 degrees in double, 0.02 in float.
  const Image a = normals({{0, 0, 1}});
  Image b = a;
  b.pixels[0] = std::nextafter(0.5F, 1.0F);
  EXPECT_NEAR(compare_images(a, b).max_angle_degrees, std::ldexp(1.0, -23) * 57.29577951308232,
              1e-12);
}

TEST(CompareImages, AnImageEqualsItself) {
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    Image image = noise(130, 77, channels, channels);
    image.pixels[5] = std::numeric_limits<float>::quiet_NaN();
    image.pixels[17] = std::numeric_limits<float>::infinity();
    const ImageDifference difference = compare_images(image, image);
    EXPECT_EQ(difference.compared_texels, 130u * 77);
    EXPECT_EQ(difference.max_angle_degrees, 0.0);
    EXPECT_EQ(difference.p95_angle_degrees, 0.0);
    EXPECT_EQ(difference.max_error, 0.0);
    EXPECT_EQ(difference.mean_error, 0.0);
  }
}

TEST(CompareImages, WhatIsNotFiniteInOneImageOnlyCountsInFull) {
  const Image a = noise(10, 10, 3, 1);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Image b = a;
    b.at(7, 3)[1] = bad;
    for (const ImageDifference& difference : {compare_images(a, b), compare_images(b, a)}) {
      EXPECT_EQ(difference.max_angle_degrees, 180.0);
      EXPECT_EQ(difference.max_error, 1.0);
      EXPECT_EQ(difference.worst_x, 7u);
      EXPECT_EQ(difference.worst_y, 3u);
    }
  }
}

TEST(CompareImages, FewerChannelsThanThreeHaveErrorsOnly) {
  const Image a{4, 3, 2, std::vector<float>(24, 0.25F)};
  Image b = a;
  b.at(2, 1)[1] = 0.75F;
  const ImageDifference difference = compare_images(a, b);
  EXPECT_EQ(difference.max_angle_degrees, 0.0);
  EXPECT_EQ(difference.max_error, 0.5);
  EXPECT_EQ(difference.mean_error, 0.5 / 24);
  EXPECT_EQ(difference.worst_x, 2u);
  EXPECT_EQ(difference.worst_y, 1u);
}

TEST(CompareImages, TheMaskLeavesTexelsOut) {
  Image a = noise(200, 150, 3, 1);
  a.at(150, 140)[0] = 0.25F;
  Image b = a;
  Image mask{200, 150, 1, std::vector<float>(200 * 150, 1.0F)};
  b.at(150, 140)[0] += 1.0F;
  mask.at(150, 140)[0] = 0.0F;
  EXPECT_EQ(compare_images(a, b).max_error, 1.0);
  const ImageDifference difference = compare_images(a, b, &mask);
  EXPECT_EQ(difference.compared_texels, 200u * 150 - 1);
  EXPECT_EQ(difference.max_error, 0.0);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 0.0F);
  const ImageDifference nothing = compare_images(a, b, &mask);
  EXPECT_EQ(nothing.compared_texels, 0u);
  EXPECT_EQ(nothing.max_angle_degrees, 0.0);
}

// Percentiles against sorting, with and without a mask.
RC_GTEST_PROP(CompareImages, PercentilesAreOfNearestRank, ()) {
  const auto width = *rc::gen::inRange<std::uint32_t>(1, 200);
  const auto height = *rc::gen::inRange<std::uint32_t>(1, 60);
  const auto seed = *rc::gen::inRange(0U, 1000U);
  const Image a = noise(width, height, 3, seed);
  const Image b = noise(width, height, 3, seed + 1);
  Image mask = noise(width, height, 2, seed + 2);
  for (float& value : mask.pixels) value = value < 0.3F ? 0.0F : value;
  std::vector<double> angles;
  double sum = 0;
  for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
    if (mask.pixels[2 * i] == 0.0F) continue;
    double dot = 0, aa = 0, bb = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double x = 2.0 * static_cast<double>(a.pixels[3 * i + c]) - 1;
      const double y = 2.0 * static_cast<double>(b.pixels[3 * i + c]) - 1;
      dot += x * y, aa += x * x, bb += y * y;
    }
    if (std::min(aa, bb) < 4e-4) {  // shorter than 0.01, or nearly so: no direction
      mask.pixels[2 * i] = 0;
      continue;
    }
    angles.push_back(std::acos(std::clamp(dot / std::sqrt(aa * bb), -1.0, 1.0)) * 180 / M_PI);
    sum += angles.back();
  }
  const ImageDifference difference = compare_images(a, b, &mask);
  RC_ASSERT(difference.compared_texels == angles.size());
  if (angles.empty()) return;
  std::sort(angles.begin(), angles.end());
  const auto rank = [&](double share) {
    return angles[static_cast<std::size_t>(
        std::max(0.0, std::ceil(share * static_cast<double>(angles.size()) - 1e-9) - 1))];
  };
  // acos loses half the digits near 0 and 180 degrees: 1e-6 degrees.
  RC_ASSERT(std::abs(difference.p95_angle_degrees - rank(0.95)) < 1e-5);
  RC_ASSERT(std::abs(difference.p99_angle_degrees - rank(0.99)) < 1e-5);
  RC_ASSERT(std::abs(difference.max_angle_degrees - angles.back()) < 1e-5);
  RC_ASSERT(std::abs(difference.mean_angle_degrees - sum / static_cast<double>(angles.size())) <
            1e-5);
}

TEST(CompareImages, SameNumbersOnEveryRunAndEitherWayRound) {
  const Image a = noise(500, 300, 3, 8);
  const Image b = noise(500, 300, 3, 9);
  const ImageDifference first = compare_images(a, b);
  for (const ImageDifference& again : {compare_images(a, b), compare_images(b, a)}) {
    EXPECT_EQ(first.mean_angle_degrees, again.mean_angle_degrees);
    EXPECT_EQ(first.p95_angle_degrees, again.p95_angle_degrees);
    EXPECT_EQ(first.mean_error, again.mean_error);
    EXPECT_EQ(first.worst_x, again.worst_x);
  }
}

TEST(CompareImages, DifferentShapesAreRefused) {
  const Image a = noise(4, 3, 3, 1);
  Image broken = a;
  broken.pixels.pop_back();
  for (const Image& b : {noise(3, 4, 3, 1), noise(4, 3, 4, 1), broken, Image{}}) {
    EXPECT_THROW(compare_images(a, b), Error);
  }
  for (const Image& mask : {noise(3, 4, 3, 1), broken, Image{}}) {
    EXPECT_THROW(compare_images(a, a, &mask), Error);
  }
}

}  // namespace
}  // namespace kiln
