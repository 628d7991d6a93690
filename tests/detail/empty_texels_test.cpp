// Texels of pictures that hold nothing: charts against brute force, background against what somebody drew.
#include "detail/empty_texels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace kiln {
namespace {

constexpr std::uint32_t kWidth = 75, kHeight = 66;  // no multiples of 64

/// True if a texel's centre lies in a triangle, or a copy of it moved by whole pictures.
bool is_in(const ChartTexels::Corners& t, double u, double v, bool repeats) {
  // Pictures between which the centre's copies lie around the triangle.
  const auto reach = [&](std::size_t axis, double at) {
    const auto [low, high] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
    if (!repeats) return std::pair(0, 0);
    return std::pair(static_cast<int>(std::floor(low - at)),
                     static_cast<int>(std::ceil(high - at)));
  };
  const auto [first_i, last_i] = reach(0, u);
  const auto [first_j, last_j] = reach(1, v);
  for (int i = first_i; i <= last_i; ++i) {
    for (int j = first_j; j <= last_j; ++j) {
      double least = 1e30, most = -1e30;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto &a = t[k], &b = t[(k + 1) % 3];
        const double side = (b[0] - a[0]) * (v + j - a[1]) - (b[1] - a[1]) * (u + i - a[0]);
        least = std::min(least, side), most = std::max(most, side);
      }
      if (least > 0 || most < 0) return true;
    }
  }
  return false;
}

/// Nearer to an edge than rounding tells.
bool is_doubtful(const ChartTexels::Corners& t, double u, double v) {
  ChartTexels::Corners larger = t, smaller = t;
  double mu = 0, mv = 0;
  for (const auto& c : t) mu += c[0] / 3, mv += c[1] / 3;
  for (std::size_t k = 0; k < 3; ++k) {
    larger[k] = {mu + (t[k][0] - mu) * 1.01, mv + (t[k][1] - mv) * 1.01};
    smaller[k] = {mu + (t[k][0] - mu) * 0.99, mv + (t[k][1] - mv) * 0.99};
  }
  return is_in(larger, u, v, true) != is_in(smaller, u, v, true);
}

TEST(ChartTexels, AreThoseWhoseCentresTrianglesHold) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1.2, 2.2), step(-0.4, 0.4);
  constexpr std::array<TextureWrap, 2> kRepeat{TextureWrap::repeat, TextureWrap::repeat};
  int in = 0;
  for (int trial = 0; trial < 60; ++trial) {
    ChartTexels::Corners t;
    t[0] = {place(random), place(random)};
    for (std::size_t k = 1; k < 3; ++k) t[k] = {t[0][0] + step(random), t[0][1] + step(random)};
    ChartTexels repeated(kWidth, kHeight), alone(kWidth, kHeight);
    repeated.add(t, kRepeat);
    alone.add(t, std::nullopt);
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const double u = (x + 0.5) / kWidth, v = 1 - (y + 0.5) / kHeight;
        if (is_doubtful(t, u, v)) continue;
        ASSERT_EQ(repeated.bits().has(x, y), is_in(t, u, v, true)) << trial << " " << x << " " << y;
        ASSERT_EQ(alone.bits().has(x, y), is_in(t, u, v, false)) << trial << " " << x << " " << y;
        in += repeated.bits().has(x, y) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(in, 1000);
}

TEST(ChartTexels, WhatRepeatsOftenUsesAllOfThePicture) {
  ChartTexels tiled(kWidth, kHeight), nothing(kWidth, kHeight);
  tiled.add({{{0, 0}, {50, 0}, {0, 50}}}, std::array<TextureWrap, 2>{});
  nothing.add({{{0, 0}, {std::nan(""), 0}, {0, 1}}}, std::array<TextureWrap, 2>{});
  nothing.add({{{3, 0}, {4, 0}, {3, 1}}}, std::nullopt);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      ASSERT_TRUE(tiled.bits().has(x, y));
      ASSERT_FALSE(nothing.bits().has(x, y));
    }
  }
}

TEST(ChartTexels, TouchedOnesAreAllThatATriangleHoldsAPartOf) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(0.1, 0.8), step(-0.1, 0.1);
  for (int trial = 0; trial < 40; ++trial) {
    ChartTexels::Corners t;
    t[0] = {place(random), place(random)};
    for (std::size_t k = 1; k < 3; ++k) t[k] = {t[0][0] + step(random), t[0][1] + step(random)};
    if (trial % 4 == 0) t[2] = t[1];  // a line
    if (trial % 8 == 0) t[1] = t[2] = t[0];
    ChartTexels charts(32, 32);
    charts.add_touched(t, std::nullopt);
    // Points all over the triangle.
    TexelBits right(32, 32);
    constexpr int kSteps = 400;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double a = i / double{kSteps}, b = j / double{kSteps};
        const double u = t[0][0] + (t[1][0] - t[0][0]) * a + (t[2][0] - t[0][0]) * b;
        const double v = t[0][1] + (t[1][1] - t[0][1]) * a + (t[2][1] - t[0][1]) * b;
        const auto x = static_cast<std::size_t>(u * 32), y = static_cast<std::size_t>((1 - v) * 32);
        right.add(y, x, x + 1);
      }
    }
    int more = 0;
    for (std::size_t i = 0; i < 32 * 32; ++i) {
      if (right.has(i)) ASSERT_TRUE(charts.bits().has(i)) << trial;
      more += charts.bits().has(i) && !right.has(i) ? 1 : 0;
    }
    EXPECT_LE(more, 2) << trial;  // corners that points pass by
  }
}

TEST(ChartTexels, ClampedOnesUseTheOutermostTexels) {
  ChartTexels charts(8, 8);
  charts.add({{{2, 0}, {3, 0}, {2, 1}}},
             std::array<TextureWrap, 2>{TextureWrap::clamp, TextureWrap::clamp});
  EXPECT_TRUE(charts.bits().has(7, 4));
  EXPECT_FALSE(charts.bits().has(6, 4));
}

/// What leaves a mirrored picture is there the other way round: no texel that a sampler reads is missing.
TEST(ChartTexels, MirroredOnesHoldWhatIsReadBeyondTheBorder) {
  constexpr std::array<TextureWrap, 2> kMirror{TextureWrap::mirror, TextureWrap::mirror};
  const auto folded = [](double at) {
    const double two = std::fmod(std::fmod(at, 2) + 2, 2);
    return two <= 1 ? two : 2 - two;
  };
  for (const double u : {-1.3, -0.25, 0.1, 0.8, 1.4, 2.3}) {
    for (const double v : {-0.7, 0.3, 1.2}) {
      const ChartTexels::Corners t{{{u, v}, {u + 0.4, v + 0.1}, {u + 0.1, v + 0.4}}};
      ChartTexels charts(32, 32);
      charts.add(t, kMirror);
      constexpr int kSteps = 300;
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
          const double a = i / double{kSteps}, b = j / double{kSteps};
          const double x = folded(u + 0.4 * a + 0.1 * b) * 32;
          const double y = (1 - folded(v + 0.1 * a + 0.4 * b)) * 32;
          // Texels whose centres it holds: so near to one that a step of the loop does not pass by it.
          if (std::hypot(x - std::floor(x) - 0.5, y - std::floor(y) - 0.5) > 0.03) continue;
          if (i == 0 || j == 0 || i + j == kSteps) continue;
          const auto column = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
          ASSERT_TRUE(charts.bits().has(column, row))
              << u << ' ' << v << ' ' << column << ' ' << row;
        }
      }
    }
  }
}

TEST(TexelBits, AreDilatedByOneTexelAcrossWords) {
  TexelBits bits(150, 3);
  for (const std::size_t x : {0U, 63U, 64U, 127U, 149U}) bits.add(1, x, x + 1);
  const TexelBits wide = dilated(bits);
  for (std::size_t y = 0; y < 3; ++y) {
    for (std::size_t x = 0; x < 150; ++x) {
      bool near = false;
      for (const std::size_t at : {0U, 63U, 64U, 127U, 149U}) near = near || x + 1 - at <= 2;
      EXPECT_EQ(wide.has(x, y), near) << x;
    }
  }
  EXPECT_EQ(wide.row(1)[2] & ~wide.last_word(), 0U);
}

/// A picture whose left half is a chart, and the rest as a function says.
struct Atlas {
  Image image{64, 64, 3, std::vector<float>(std::size_t{64} * 64 * 3)};
  ChartTexels charts{64, 64};

  template <typename Color>
  explicit Atlas(const Color& outside) {
    charts.add({{{0, 0}, {0.5, 0}, {0.5, 1}}}, std::array<TextureWrap, 2>{});
    charts.add({{{0, 0}, {0.5, 1}, {0, 1}}}, std::array<TextureWrap, 2>{});
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        for (std::size_t c = 0; c < 3; ++c) {
          image.at(x, y)[c] = x < 32 ? 0.8F : static_cast<float>(outside(x, y));
        }
      }
    }
  }
  std::size_t empty() const {
    const auto texels = find_empty_texels(image, charts.bits());
    std::size_t count = 0;
    for (std::size_t i = 0; texels && i < 64 * 64; ++i) {
      EXPECT_FALSE(texels->has(i) && charts.bits().has(i));
      count += texels->has(i) ? 1 : 0;
    }
    return count;
  }
};

double noise(std::uint32_t x, std::uint32_t y) {
  return static_cast<double>((x * 2654435761U ^ y * 40503U) * 2246822519U >> 24U) / 255;
}

TEST(EmptyTexels, AreBackgroundOutOfCharts) {
  constexpr std::size_t kOut = 32 * 64;
  EXPECT_EQ(Atlas([](auto, auto) { return 0; }).empty(), kOut);
  EXPECT_EQ(Atlas([](auto, auto) { return 0.5; }).empty(), kOut);
  // Blended with it along the border, as painters and JPEG do.
  EXPECT_EQ(Atlas([](auto x, auto) { return x == 32 ? 0.4 : 0; }).empty(), kOut);
  EXPECT_EQ(Atlas([](auto x, auto y) { return 0.03 * noise(x, y); }).empty(), kOut);
  // Padding of four texels stays, but for the outermost, which may be blended; so does another object's chart.
  EXPECT_EQ(Atlas([](auto x, auto) { return x < 36 ? 0.8 : 0; }).empty(), kOut - 3 * 64);
  EXPECT_EQ(Atlas([](auto, auto y) { return y < 32 ? 0.6 : 0.5 * (y == 32); }).empty(),
            kOut / 2 + 32);
}

TEST(EmptyTexels, AreNoneWhereSomethingWasDrawn) {
  // A photograph goes on; padding is wide; nothing is out of charts.
  EXPECT_EQ(Atlas(noise).empty(), 0U);
  EXPECT_EQ(Atlas([](auto x, auto) { return x < 45 ? 0.8 : 0; }).empty(), 0U);
  Atlas whole([](auto, auto) { return 0; });
  whole.charts.add({{{0, 0}, {2, 0}, {0, 2}}}, std::array<TextureWrap, 2>{});
  EXPECT_EQ(whole.empty(), 0U);
}

TEST(EmptyTexels, OfNoOpacityHaveNoColour) {
  Atlas atlas([](auto, auto) { return 0; });
  Image image{64, 64, 4, {}};
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      const auto color = static_cast<float>(noise(x, y));
      image.pixels.insert(image.pixels.end(), {color, color, color, x < 32 ? 1.0F : 0.0F});
    }
  }
  ASSERT_TRUE(find_empty_texels(image, atlas.charts.bits()));
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 1;
  EXPECT_FALSE(find_empty_texels(image, atlas.charts.bits()));
}

}  // namespace
}  // namespace kiln
