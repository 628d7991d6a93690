// Channels of normal maps: pictures by formula, encoded as exporters and decoders leave them.
#include "image/normal_channels.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "image/texture_filter.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSide = 64;
using Normal = std::array<double, 3>;

/// Normals of the height field h = a sin(u f) cos(v g), +Y up, by rows from the top.
std::vector<Normal> bumps(double height = 1) {
  std::vector<Normal> normals;
  constexpr double kU = 12, kV = 17, kAmplitude = 0.05;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const double u = (x + 0.5) / kSide, v = 1 - (y + 0.5) / kSide;
      const double p = height * kAmplitude * kU * std::cos(u * kU) * std::cos(v * kV);
      const double q = -height * kAmplitude * kV * std::sin(u * kU) * std::sin(v * kV);
      const double size = std::sqrt(p * p + q * q + 1);
      normals.push_back({-p / size, -q / size, 1 / size});
    }
  }
  return normals;
}

using Encode = std::function<std::vector<double>(const Normal&)>;
Image encoded(const std::vector<Normal>& normals, const Encode& encode) {
  Image image{kSide, static_cast<std::uint32_t>(normals.size() / kSide), 0, {}};
  for (const Normal& n : normals) {
    const std::vector<double> channels = encode(n);
    image.channels = static_cast<std::uint32_t>(channels.size());
    for (const double value : channels) {
      image.pixels.push_back(static_cast<float>(std::round((value / 2 + 0.5) * 255) / 255));
    }
  }
  return image;
}

struct Kind {
  const char* name;
  Encode encode;
  bool two;
};
const Kind kKinds[] = {
    {"three channels",
     [](const Normal& n) {
       return std::vector{n[0], n[1], n[2]};
     },
     false},
    {"three and opacity",
     [](const Normal& n) {
       return std::vector{n[0], n[1], n[2], 1.0};
     },
     false},
    {"BC5, blue 0",
     [](const Normal& n) {
       return std::vector{n[0], n[1], -1.0};
     },
     true},
    {"BC5, blue 255",
     [](const Normal& n) {
       return std::vector{n[0], n[1], 1.0};
     },
     true},
    {"BC5, blue 128",
     [](const Normal& n) {
       return std::vector{n[0], n[1], 0.004};
     },
     true},
    {"blue turned over",
     [](const Normal& n) {
       return std::vector{n[0], n[1], -n[2]};
     },
     true},
    {"BC5, two channels",
     [](const Normal& n) {
       return std::vector{n[0], n[1]};
     },
     true},
    {"BC5, with alpha",
     [](const Normal& n) {
       return std::vector{n[0], n[1], 1.0, 1.0};
     },
     true},
    {"DXT5nm, Unity",
     [](const Normal& n) {
       return std::vector{1.0, n[1], 1.0, n[0]};
     },
     true},
    {"DXT5nm, grey",
     [](const Normal& n) {
       return std::vector{n[1], n[1], n[1], n[0]};
     },
     true},
    {"DXT5nm, red 0",
     [](const Normal& n) {
       return std::vector{-1.0, n[1], -1.0, n[0]};
     },
     true},
    {"RXGB",
     [](const Normal& n) {
       return std::vector{-1.0, n[1], n[2], n[0]};
     },
     true},
};

std::array<float, 3> read(const Image& image, NormalTextureFormat format, std::size_t x,
                          std::size_t y) {
  TextureReading reading;
  reading.normals = NormalChannels::of(image, format);
  const FilteredTexture texture(std::make_shared<const Image>(image), TextureKind::normal, reading);
  float value[4] = {};
  texture.mean((x + 0.5) / image.width, 1 - (y + 0.5) / image.height, {{{1e-6, 0}, {0, 1e-6}}},
               value);
  return {value[0], value[1], value[2]};
}

TEST(NormalChannels, AutomaticFindsWhereXAndYAre) {
  const std::vector<Normal> normals = bumps();
  for (const Kind& kind : kKinds) {
    const Image image = encoded(normals, kind.encode);
    const NormalChannels channels = NormalChannels::of(image, NormalTextureFormat::automatic);
    EXPECT_EQ(channels.computes_z, kind.two) << kind.name;
    EXPECT_FALSE(channels.down) << kind.name;
    EXPECT_FALSE(holds_heights(image, NormalTextureFormat::automatic)) << kind.name;
    for (const std::size_t at : {5U, 30U, 61U}) {
      const auto found = read(image, NormalTextureFormat::automatic, at, 63 - at);
      const Normal& n = normals[(63 - at) * kSide + at];
      // A step of a byte is 1/255 of x and y; z is at least 0.6 here, so that it moves by less than 1.4 times as much.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], n[c], 1.5 / 255) << kind.name << c;
    }
  }
}

TEST(NormalChannels, WhatIsAskedForIsDoneAndDoubted) {
  const std::vector<Normal> normals = bumps();
  const Normal& n = normals[20 * kSide + 10];
  for (const Kind& kind : kKinds) {
    const Image image = encoded(normals, kind.encode);
    if (image.channels < 3) {
      EXPECT_THROW(NormalChannels::of(image, NormalTextureFormat::opengl).check(image), Error);
    } else {
      const NormalChannels gl = NormalChannels::of(image, NormalTextureFormat::opengl);
      EXPECT_FALSE(gl.computes_z);
      EXPECT_EQ(gl.contradicts_format, kind.two) << kind.name;
      EXPECT_TRUE(NormalChannels::of(image, NormalTextureFormat::directx).down);
    }
    // Of three channels x and y say the same.
    const auto down = read(image, NormalTextureFormat::two_channel_directx, 10, 20);
    EXPECT_NEAR(down[0], n[0], 1.5 / 255) << kind.name;
    EXPECT_NEAR(down[1], -n[1], 1.5 / 255) << kind.name;
    EXPECT_NEAR(down[2], n[2], 1.5 / 255) << kind.name;
    EXPECT_FALSE(NormalChannels::of(image, NormalTextureFormat::two_channel).contradicts_format)
        << kind.name;
  }
}

/// Waves along the diagonal, where x is y, are no grey picture, whatever their opacity.
TEST(NormalChannels, EqualXAndYAreNoGrey) {
  std::vector<Normal> normals;
  for (std::size_t i = 0; i < std::size_t{kSide} * kSide; ++i) {
    const double slope = 0.5 * std::sin(0.37 * static_cast<double>(i));
    normals.push_back({slope, slope, std::sqrt(1 - 2 * slope * slope)});
  }
  const Image image = encoded(normals, [](const Normal& n) {
    return std::vector{n[0], n[1], n[2], 0.3};
  });
  EXPECT_FALSE(NormalChannels::of(image, NormalTextureFormat::automatic).computes_z);
  EXPECT_FALSE(NormalChannels::of(image, NormalTextureFormat::opengl).contradicts_format);
}

TEST(NormalChannels, MapsOfThreeChannelsStayAsTheyAre) {
  // Flat, nearly flat, and flat beside a few bumps: blue is all but constant.
  const std::vector<Normal> flat(std::size_t{kSide} * kSide, {0, 0, 1});
  std::vector<Normal> dent = flat;
  dent[5] = {0.6, 0, 0.8};
  const Encode three = kKinds[0].encode;
  for (const auto& normals : {flat, dent, bumps(0.01), bumps(0.1)}) {
    EXPECT_FALSE(
        NormalChannels::of(encoded(normals, three), NormalTextureFormat::automatic).computes_z);
  }
  // Their x and y alone are not.
  for (const double height : {0.5, 1.0}) {
    EXPECT_TRUE(
        NormalChannels::of(encoded(bumps(height), kKinds[3].encode), NormalTextureFormat::automatic)
            .computes_z);
  }
  std::vector<Normal> dents = flat;
  for (std::size_t i = 100; i < 105; ++i) dents[i] = {0.6, 0, 0.8};
  EXPECT_TRUE(NormalChannels::of(encoded(dents, kKinds[3].encode), NormalTextureFormat::automatic)
                  .computes_z);
  EXPECT_TRUE(NormalChannels::of(encoded(flat, kKinds[2].encode), NormalTextureFormat::automatic)
                  .computes_z);
  // Not of unit length, but with a blue that says something: a blend of maps.
  const Image blend = encoded(bumps(), [](const Normal& n) {
    return std::vector{0.6 * n[0], 0.6 * n[1], 0.6 * n[2] + 0.2};
  });
  EXPECT_FALSE(NormalChannels::of(blend, NormalTextureFormat::automatic).computes_z);
}

/// Filtering and lossy blocks make x and y too long for a unit vector: z is then 0, not the root of a negative number.
TEST(NormalChannels, RebuiltZIsNeverNan) {
  const Image image = encoded(bumps(), kKinds[3].encode);
  const NormalChannels channels = NormalChannels::of(image, NormalTextureFormat::two_channel);
  ASSERT_TRUE(channels.computes_z);
  for (const auto& [x, y, z] : {std::array{0.8F, 0.7F, 0.0F}, std::array{-1.0F, 1.0F, 0.0F},
                                std::array{0.0F, 0.0F, 1.0F}, std::array{0.6F, 0.0F, 0.8F}}) {
    std::array<float, 4> texel{x, y, 0.5F, 1};
    channels.apply(texel);
    EXPECT_NEAR(texel[2], z, 1e-6) << x << ' ' << y;
  }
}

TEST(NormalChannels, GreyPicturesAreHeights) {
  const std::vector<Normal> normals = bumps();
  const auto holds = [&](const Encode& encode) {
    return holds_heights(encoded(normals, encode), NormalTextureFormat::automatic);
  };
  EXPECT_TRUE(holds([](const Normal& n) { return std::vector{n[0]}; }));
  EXPECT_TRUE(holds([](const Normal& n) { return std::vector{n[0], n[0], n[0]}; }));
  EXPECT_TRUE(holds([](const Normal& n) { return std::vector{n[0], 1.0}; }));
  EXPECT_TRUE(holds([](const Normal& n) { return std::vector{n[0], n[0], n[0], 1.0}; }));
  // Grey near the middle lies in the unit disc whatever the other channel is: opaque alpha is no y, and no x.
  EXPECT_TRUE(holds([](const Normal& n) { return std::vector{0.1 * n[0], 1.0}; }));
  EXPECT_TRUE(holds([](const Normal& n) {
    return std::vector{0.1 * n[0], 0.1 * n[0], 0.1 * n[0], 1.0};
  }));
  // Cut out: alpha of 0 and 1 is no x.
  EXPECT_TRUE(holds([](const Normal& n) {
    return std::vector{n[0], n[0], n[0], n[1] > 0 ? 1.0 : -1.0};
  }));
  EXPECT_FALSE(holds([](const Normal& n) { return std::vector{n[0], n[1]}; }));
}

TEST(NormalChannels, SlopesOfASurfaceTellTheDirectionOfGreen) {
  const Image up = encoded(bumps(), kKinds[0].encode);
  Image down = up;
  for (std::size_t i = 1; i < down.pixels.size(); i += 3) down.pixels[i] = 1 - down.pixels[i];
  const NormalChannels three;
  const GreenEvidence right = GreenEvidence::of(up, three), wrong = GreenEvidence::of(down, three);
  EXPECT_LT(right.up, 0.05 * right.down);
  EXPECT_NEAR(wrong.down, right.up, 1e-9);
  EXPECT_FALSE(right.suggests_down());
  EXPECT_TRUE(wrong.suggests_down());
  NormalChannels turned;
  turned.down = true;
  EXPECT_FALSE(GreenEvidence::of(down, turned).suggests_down());
  // Noise is no surface's either way, and stripes along an axis are both ways'.
  std::mt19937 random(3);
  Image noise = up, stripes = up;
  for (float& value : noise.pixels) value = 0.4F + 0.2F * static_cast<float>(random() % 256) / 255;
  for (std::size_t i = 0; i < stripes.pixels.size(); i += 3) stripes.pixels[i] = 0.5F;
  for (std::size_t i = 2; i < noise.pixels.size(); i += 3) noise.pixels[i] = 1;
  EXPECT_FALSE(GreenEvidence::of(noise, three).suggests_down());
  const Image flat = encoded(std::vector<Normal>(kSide * 4, {0, 0, 1}), kKinds[0].encode);
  EXPECT_FALSE(GreenEvidence::of(flat, three).suggests_down());
}

}  // namespace
}  // namespace kiln
