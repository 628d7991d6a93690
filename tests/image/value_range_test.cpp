// Ranges of a picture's channel, against all of the texels that bilinear lookups read.
#include "image/value_range.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace kiln {
namespace {

constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 8> kSizes = {
    {{1, 1}, {1, 7}, {5, 3}, {8, 8}, {16, 9}, {33, 17}, {64, 2}, {31, 64}}};
constexpr std::array<TextureWrap, 3> kWraps = {TextureWrap::repeat, TextureWrap::clamp,
                                               TextureWrap::mirror};

/// The number of a texel in the row that a sampler shows at any number: by the glTF specification, samplers.
std::int64_t shown_texel(std::int64_t i, std::int64_t size, TextureWrap wrap) {
  if (wrap == TextureWrap::clamp) return std::clamp<std::int64_t>(i, 0, size - 1);
  const std::int64_t period = wrap == TextureWrap::mirror ? 2 * size : size;
  const std::int64_t in = (i % period + period) % period;
  return in < size ? in : period - 1 - in;
}

TEST(BoundedChannel, RangesHoldTheTexelsThatLookupsRead) {
  std::mt19937 random(11);
  const auto unit = [&] { return static_cast<double>(random() % 100001) / 100000; };
  for (const auto& [width, height] : kSizes) {
    Image image{width, height, 2, {}};
    for (std::size_t i = 0; i < std::size_t{width} * height * 2; ++i)
      image.pixels.push_back(static_cast<float>(unit()));
    for (std::uint32_t channel = 0; channel < 2; ++channel) {
      const BoundedChannel bounded(image, channel);
      EXPECT_EQ(bounded.texels_across(), width);
      EXPECT_EQ(bounded.texels_down(), height);
      float least = 2, most = -1;
      for (std::size_t i = channel; i < image.pixels.size(); i += 2) {
        least = std::min(least, image.pixels[i]);
        most = std::max(most, image.pixels[i]);
      }
      const BoundedChannel::Range whole = bounded.over(-3, -3, 3, 3);
      EXPECT_EQ(whole.least, least);
      EXPECT_EQ(whole.most, most);
      for (int round = 0; round < 60; ++round) {
        const BoundedChannel::Wraps wraps{kWraps[random() % 3], kWraps[random() % 3]};
        const double u = 5 * unit() - 2.5, v = 5 * unit() - 2.5;
        // Every other rectangle is a few texels wide: its range is exact.
        const double share = round % 2 == 0 ? 1.2 : 0.0;
        const double across = (share > 0 ? share : 0.9 / width) * unit(),
                     down = (share > 0 ? share : 0.9 / height) * unit();
        const BoundedChannel::Range range = bounded.over(u, v, u + across, v + down, wraps);
        const auto texel = [](double at) { return static_cast<std::int64_t>(std::floor(at)); };
        float fewest = 2, greatest = -1;
        for (std::int64_t y = texel((1 - v - down) * height - 0.5);
             y <= texel((1 - v) * height - 0.5) + 1; ++y) {
          for (std::int64_t x = texel(u * width - 0.5); x <= texel((u + across) * width - 0.5) + 1;
               ++x) {
            const auto i = static_cast<std::size_t>(shown_texel(y, height, wraps[1]) * width +
                                                    shown_texel(x, width, wraps[0]));
            fewest = std::min(fewest, image.pixels[2 * i + channel]);
            greatest = std::max(greatest, image.pixels[2 * i + channel]);
          }
        }
        EXPECT_LE(range.least, fewest) << width << " x " << height << " " << round;
        EXPECT_GE(range.most, greatest) << width << " x " << height << " " << round;
        EXPECT_GE(range.least, least);
        EXPECT_LE(range.most, most);
        if (share == 0 && width > 3 && height > 3) {
          EXPECT_EQ(range.least, fewest) << width << " x " << height << " " << round;
          EXPECT_EQ(range.most, greatest) << width << " x " << height << " " << round;
        }
        for (int k = 0; k < 8; ++k) {
          const double value = bounded.at(u + across * unit(), v + down * unit(), wraps);
          EXPECT_GE(value, range.least - 1e-6);
          EXPECT_LE(value, range.most + 1e-6);
        }
      }
    }
  }
}

TEST(BoundedChannel, MissingChannelsAreOneAndWhatIsNotFiniteIsZero) {
  const Image grey{2, 1, 1, {0.25F, std::numeric_limits<float>::quiet_NaN()}};
  EXPECT_EQ(BoundedChannel(grey, 3).over(0, 0, 1, 1).least, 1);
  EXPECT_EQ(BoundedChannel(grey, 0).over(0, 0, 1, 1).least, 0);
  EXPECT_EQ(BoundedChannel(grey, 0).over(0, 0, 1, 1).most, 0.25F);
  // Alpha of a picture of grey and alpha is its second channel.
  const Image grey_alpha{1, 1, 2, {0.25F, 0.75F}};
  EXPECT_EQ(BoundedChannel(grey_alpha, 3).at(0, 0), 0.75);
  EXPECT_EQ(BoundedChannel(grey_alpha, 0).at(0, 0), 0.25);
}

/// Texel centres hold their texels: the first row is the upper one, at v near 1.
TEST(BoundedChannel, CentresHoldTheirTexels) {
  Image image{5, 3, 1, {}};
  for (int i = 0; i < 15; ++i) image.pixels.push_back(static_cast<float>(i));
  const BoundedChannel bounded(image, 0);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      EXPECT_NEAR(bounded.at((x + 0.5) / 5, 1 - (y + 0.5) / 3), 5 * y + x, 1e-9);
    }
  }
  EXPECT_NEAR(bounded.at(0.2, 1 - 0.5 / 3), 0.5, 1e-9);
  EXPECT_NEAR(bounded.at(0, 1 - 0.5 / 3), 2, 1e-9) << "between the last and the first";
}

}  // namespace
}  // namespace kiln
