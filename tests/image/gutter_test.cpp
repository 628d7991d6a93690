#include "image/gutter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "image/push_pull.h"
#include "kiln/render.h"
#include "reference/gutter.h"
#include "support/environment.h"

namespace kiln {
namespace {

struct Scene {
  Image image;
  std::vector<std::uint8_t> coverage;
};

// Every texel has a value of its own, also the empty ones: a copy shows where it came from.
Scene make_scene(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  Scene scene;
  scene.image = {width, height, channels, {}};
  scene.image.pixels.resize(std::size_t{width} * height * channels);
  for (std::size_t i = 0; i < scene.image.pixels.size(); ++i) {
    scene.image.pixels[i] = static_cast<float>(i) + 0.25F;
  }
  scene.coverage.assign(std::size_t{width} * height, kCoverageEmpty);
  return scene;
}

void scatter(Scene& scene, double share, Coverage what, unsigned seed) {
  std::mt19937 random(seed);
  for (std::uint8_t& state : scene.coverage) {
    if (static_cast<double>(random()) < share * 4294967296.0) state = what;
  }
}

std::uint64_t fill(Scene& scene, const GutterOptions& options) {
  return fill_gutter(context_of(*test::device()), scene.image, scene.coverage, options);
}

// Compares a filled scene with the oracle, texel by texel, exactly.
void expect_nearest(const Scene& before, const Scene& after, int radius, std::uint64_t count,
                    bool missed_is_source = true) {
  const int width = static_cast<int>(before.image.width);
  const int height = static_cast<int>(before.image.height);
  const std::size_t channels = before.image.channels;
  std::vector<bool> source(before.coverage.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    source[i] = before.coverage[i] == kCoverageBaked ||
                (missed_is_source && before.coverage[i] == kCoverageMissed);
  }
  std::uint64_t expected_count = 0;
  std::size_t wrong = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto texel =
          static_cast<std::size_t>(y) * before.image.width + static_cast<std::size_t>(x);
      if (before.coverage[texel] == kCoverageMissed && !missed_is_source) continue;
      std::uint8_t state = before.coverage[texel];
      reference::Place from{x, y};
      if (state == kCoverageEmpty) {
        if (const auto found = reference::nearest_source(source, width, height, x, y, radius)) {
          from = *found;
          state = kCoverageGutter;
          ++expected_count;
        }
      }
      const float* expected =
          before.image.at(static_cast<std::size_t>(from.x), static_cast<std::size_t>(from.y));
      if (after.coverage[texel] != state ||
          !std::equal(expected, expected + channels, &after.image.pixels[texel * channels])) {
        if (wrong++ == 0) ADD_FAILURE() << "first at " << x << ", " << y << " radius " << radius;
      }
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(count, expected_count);
}

class GutterSizes : public testing::TestWithParam<std::pair<std::uint32_t, std::uint32_t>> {};

INSTANTIATE_TEST_SUITE_P(Sizes, GutterSizes,
                         testing::Values(std::pair{1U, 1U}, std::pair{1U, 37U}, std::pair{37U, 1U},
                                         std::pair{7U, 9U}, std::pair{8U, 8U}, std::pair{64U, 64U},
                                         std::pair{65U, 33U}, std::pair{33U, 65U},
                                         std::pair{129U, 35U}),
                         [](const auto& test_case) {
                           return std::to_string(test_case.param.first) + "x" +
                                  std::to_string(test_case.param.second);
                         });

TEST_P(GutterSizes, TakesTheNearestAsTheOracleSays) {
  KILN_REQUIRE_DEVICE();
  const auto [width, height] = GetParam();
  unsigned seed = 1;
  for (const double share : {0.002, 0.05, 0.4}) {
    for (const int radius : {1, 2, 5, 16, 127, 128, 400}) {
      Scene before = make_scene(width, height, 1 + seed % 4);
      scatter(before, share, kCoverageBaked, seed);
      scatter(before, 0.02, kCoverageMissed, seed + 1000);
      ++seed;
      Scene after = before;
      const std::uint64_t count = fill(after, {.texels = radius});
      expect_nearest(before, after, radius, count);
    }
  }
}

TEST_P(GutterSizes, AllCoveredNoneCoveredAndNoGutterChangeNothing) {
  KILN_REQUIRE_DEVICE();
  const auto [width, height] = GetParam();
  for (const int texels : {-1, 0, 1, 16, 300}) {
    for (const std::uint8_t state : {kCoverageEmpty, kCoverageBaked}) {
      Scene before = make_scene(width, height, 3);
      std::fill(before.coverage.begin(), before.coverage.end(), state);
      Scene after = before;
      EXPECT_EQ(fill(after, {.texels = texels}), 0u);
      EXPECT_EQ(after.image.pixels, before.image.pixels);
      EXPECT_EQ(after.coverage, before.coverage);
    }
  }
}

// Rows are filled one piece after the other, from windows that hold no more than the rows around each piece.
TEST_P(GutterSizes, RowByRowIsTheSame) {
  KILN_REQUIRE_DEVICE();
  const auto [width, height] = GetParam();
  for (const std::uint32_t radius : {1U, 5U, 16U, 200U}) {
    Scene before = make_scene(width, height, 3);
    scatter(before, 0.05, kCoverageBaked, radius);
    scatter(before, 0.02, kCoverageMissed, radius + 1000);
    Scene whole = before;
    const std::uint64_t count = fill(whole, {.texels = static_cast<int>(radius)});
    for (const std::uint32_t step : {1U, 3U, 20U}) {
      Scene rows = before;
      std::uint64_t filled = 0;
      for (std::uint32_t first = 0; first < height; first += step) {
        const std::uint32_t last = std::min(first + step, height);
        const std::uint32_t top = first > radius ? first - radius : 0;
        const std::uint32_t bottom = std::min(last + radius, height);
        const std::size_t row = std::size_t{width} * 3;
        const auto begin = rows.image.pixels.begin() + static_cast<std::ptrdiff_t>(top * row);
        Image window{
            width, bottom - top, 3,
            std::vector<float>(begin, begin + static_cast<std::ptrdiff_t>((bottom - top) * row))};
        const GutterImage image{&window, false};
        filled += fill_gutter_rows(
            context_of(*test::device()), {&image, 1},
            std::span(rows.coverage)
                .subspan(std::size_t{top} * width, std::size_t{bottom - top} * width),
            radius, {first - top, last - top});
        std::copy(window.pixels.begin(), window.pixels.end(), begin);
      }
      EXPECT_EQ(filled, count) << radius << ' ' << step;
      EXPECT_EQ(rows.image.pixels, whole.image.pixels) << radius << ' ' << step;
      EXPECT_EQ(rows.coverage, whole.coverage) << radius << ' ' << step;
    }
  }
}

// One source in a corner or the middle: the disc around it, every tie of the circle included.
TEST(Gutter, OneSourceGivesADisc) {
  KILN_REQUIRE_DEVICE();
  for (const std::size_t at :
       {std::size_t{0}, std::size_t{40 * 83 + 41}, std::size_t{83 * 81 - 1}}) {
    Scene before = make_scene(83, 81, 2);
    before.coverage[at] = kCoverageBaked;
    Scene after = before;
    const std::uint64_t count = fill(after, {.texels = 13});
    expect_nearest(before, after, 13, count);
  }
}

// A checkerboard of sources puts every empty texel at the same distance from four of them.
TEST(Gutter, TiesGoToTheLowestRowThenColumn) {
  KILN_REQUIRE_DEVICE();
  Scene before = make_scene(40, 40, 1);
  for (std::size_t y = 0; y < 40; ++y) {
    for (std::size_t x = y % 2; x < 40; x += 2) before.coverage[y * 40 + x] = kCoverageBaked;
  }
  Scene after = before;
  const std::uint64_t count = fill(after, {.texels = 4});
  expect_nearest(before, after, 4, count);
  EXPECT_EQ(after.image.pixels[10 * 40 + 11], before.image.pixels[9 * 40 + 11]);
  EXPECT_EQ(after.image.pixels[0 * 40 + 1], before.image.pixels[0 * 40 + 0]);
}

// Nothing comes around the border.
TEST(Gutter, DoesNotWrap) {
  KILN_REQUIRE_DEVICE();
  Scene scene = make_scene(64, 64, 1);
  for (std::size_t y = 0; y < 64; ++y) scene.coverage[y * 64] = kCoverageBaked;
  EXPECT_EQ(fill(scene, {.texels = 5}), 64u * 5);
  EXPECT_EQ(scene.coverage[63], kCoverageEmpty);
}

// More rows than a band holds (2^22 keys): seams between bands must not show.
TEST(Gutter, SeveralBandsAgreeWithTheOracle) {
  KILN_REQUIRE_DEVICE();
  Scene before = make_scene(16384, 700, 1);
  std::mt19937 random(5);
  std::vector<std::size_t> sources;
  for (int i = 0; i < 3000; ++i) {
    sources.push_back(random() % before.coverage.size());
    before.coverage[sources.back()] = kCoverageBaked;
  }
  Scene after = before;
  const int radius = 30;
  const std::uint64_t count = fill(after, {.texels = radius});
  // Brute force the other way round: every source offers itself to its neighbourhood.
  std::vector<std::size_t> best(before.coverage.size(), SIZE_MAX);
  std::vector<int> distance(before.coverage.size(), radius * radius + 1);
  std::sort(sources.begin(), sources.end());
  for (const std::size_t source : sources) {
    const int sx = static_cast<int>(source % 16384);
    const int sy = static_cast<int>(source / 16384);
    for (int y = std::max(0, sy - radius); y <= std::min(699, sy + radius); ++y) {
      for (int x = std::max(0, sx - radius); x <= std::min(16383, sx + radius); ++x) {
        const auto texel = static_cast<std::size_t>(y) * 16384 + static_cast<std::size_t>(x);
        const int d = (x - sx) * (x - sx) + (y - sy) * (y - sy);
        if (d < distance[texel]) distance[texel] = d, best[texel] = source;
      }
    }
  }
  std::uint64_t expected = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < best.size(); ++i) {
    const bool gutter = best[i] != SIZE_MAX && before.coverage[i] == kCoverageEmpty;
    expected += gutter ? 1 : 0;
    const float value = before.image.pixels[gutter ? best[i] : i];
    if (after.image.pixels[i] != value || (after.coverage[i] == kCoverageGutter) != gutter) ++wrong;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(count, expected);
}

TEST(Gutter, SameBytesOnEveryRun) {
  KILN_REQUIRE_DEVICE();
  for (const int texels : {16, 200, -1}) {
    Scene first = make_scene(301, 207, 3);
    scatter(first, 0.03, kCoverageBaked, 9);
    scatter(first, 0.01, kCoverageMissed, 10);
    Scene second = first;
    const GutterOptions options = {.texels = texels, .fill_missed = true, .unit_vectors = true};
    EXPECT_EQ(fill(first, options), fill(second, options));
    EXPECT_EQ(first.image.pixels, second.image.pixels);
    EXPECT_EQ(first.coverage, second.coverage);
  }
}

TEST(Gutter, InfiniteFillsEverythingAndKeepsWhatWasBaked) {
  KILN_REQUIRE_DEVICE();
  for (const auto& [width, height] :
       {std::pair{1U, 50U}, std::pair{50U, 1U}, std::pair{129U, 65U}}) {
    Scene before = make_scene(width, height, 3);
    std::mt19937 random(3);
    for (std::size_t i = 0; i < before.coverage.size(); ++i) {
      const float a = static_cast<float>(random()) * 1e-9F;
      const float b = static_cast<float>(random()) * 1e-9F;
      float* texel = &before.image.pixels[3 * i];
      texel[0] = std::sin(a) * std::cos(b);
      texel[1] = std::sin(a) * std::sin(b);
      texel[2] = std::cos(a);
    }
    before.coverage[width * height / 3] = kCoverageBaked;
    before.coverage[width * height - 1] = kCoverageBaked;
    before.coverage[width * height / 2] = kCoverageMissed;
    Scene after = before;
    EXPECT_EQ(fill(after, {.texels = -1, .unit_vectors = true}), before.coverage.size() - 3);
    for (std::size_t i = 0; i < before.coverage.size(); ++i) {
      const float* a = &before.image.pixels[3 * i];
      const float* b = &after.image.pixels[3 * i];
      if (before.coverage[i] != kCoverageEmpty) {
        EXPECT_EQ(after.coverage[i], before.coverage[i]);
        EXPECT_TRUE(std::equal(a, a + 3, b)) << i;
      } else {
        EXPECT_EQ(after.coverage[i], kCoverageGutter);
      }
      EXPECT_NEAR(std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]), 1.0, 1e-6) << i;
    }
  }
}

// Averages and interpolations stay between the least and the greatest of what they are made of.
TEST(Gutter, InfiniteStaysWithinTheRangeOfTheBaked) {
  KILN_REQUIRE_DEVICE();
  Scene scene = make_scene(200, 100, 1);
  scatter(scene, 0.01, kCoverageBaked, 21);
  float low = 1e30F;
  float high = -1e30F;
  for (std::size_t i = 0; i < scene.coverage.size(); ++i) {
    if (scene.coverage[i] != kCoverageBaked) continue;
    low = std::min(low, scene.image.pixels[i]);
    high = std::max(high, scene.image.pixels[i]);
  }
  fill(scene, {.texels = -1});
  for (const float value : scene.image.pixels) {
    EXPECT_GE(value, low - 0.01F);  // rounding of numbers up to 20000
    EXPECT_LE(value, high + 0.01F);
  }
}

/// Between two known texels lies a ramp: a texel leans to the coarser one that is on its side.
TEST(Gutter, PushPullIsBilinear) {
  for (const bool across : {true, false}) {
    for (const std::uint32_t channels : {1U, 2U, 3U, 4U}) {
      Image image{across ? 4U : 1U, across ? 1U : 4U, channels,
                  std::vector<float>(std::size_t{4} * channels, -5)};
      std::fill_n(image.pixels.begin(), channels, 0.0F);
      std::fill_n(image.pixels.end() - channels, channels, 1.0F);
      const std::vector<std::uint8_t> known{1, 0, 0, 1}, wanted{0, 1, 1, 0};
      ASSERT_TRUE(push_pull(image, known, wanted, false));
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        constexpr std::array<float, 4> kRamp{0, 0.25F, 0.75F, 1};
        EXPECT_EQ(image.pixels[i], kRamp[i / channels]) << across << channels << i;
      }
    }
  }
}

TEST(Gutter, AConstantStaysConstant) {
  KILN_REQUIRE_DEVICE();
  Scene scene = make_scene(77, 53, 4);
  scatter(scene, 0.02, kCoverageBaked, 4);
  for (std::size_t i = 0; i < scene.coverage.size(); ++i) {
    const float value = scene.coverage[i] == kCoverageBaked ? 0.5F : 123.0F;
    std::fill_n(&scene.image.pixels[4 * i], 4, value);
  }
  fill(scene, {.texels = -1});
  for (const float value : scene.image.pixels) EXPECT_EQ(value, 0.5F);
}

TEST(Gutter, MissedTexelsAreFilledAndStayMarked) {
  KILN_REQUIRE_DEVICE();
  for (const int texels : {0, 3, -1}) {
    Scene before = make_scene(60, 40, 1);
    for (std::size_t i = 0; i < before.coverage.size(); ++i) {
      const std::size_t x = i % 60;
      if (x < 40) before.coverage[i] = x >= 10 && x < 30 ? kCoverageMissed : kCoverageBaked;
      before.image.pixels[i] = x < 10 ? 1.0F : x >= 30 && x < 40 ? 3.0F : 1000.0F;
    }
    Scene after = before;
    const std::uint64_t count = fill(after, {.texels = texels, .fill_missed = true});
    EXPECT_EQ(count, texels == 0 ? 0u : texels == 3 ? 3u * 40 : 20u * 40);
    bool between = false;
    for (std::size_t i = 0; i < before.coverage.size(); ++i) {
      if (before.coverage[i] == kCoverageBaked) {
        EXPECT_EQ(after.image.pixels[i], before.image.pixels[i]);
      } else if (before.coverage[i] == kCoverageMissed) {
        EXPECT_EQ(after.coverage[i], kCoverageMissed);
        EXPECT_GE(after.image.pixels[i], 1.0F);
        EXPECT_LE(after.image.pixels[i], 3.0F);
        between = between || (after.image.pixels[i] > 1.2F && after.image.pixels[i] < 2.8F);
      } else if (after.coverage[i] == kCoverageEmpty) {
        EXPECT_EQ(after.image.pixels[i], before.image.pixels[i]);
      } else {
        EXPECT_LE(after.image.pixels[i], 3.0F);
      }
    }
    EXPECT_TRUE(between);
  }
}

TEST(Gutter, MissedTexelsThatAreNotFilledCountAsBaked) {
  KILN_REQUIRE_DEVICE();
  Scene before = make_scene(30, 20, 2);
  before.coverage[5 * 30 + 5] = kCoverageMissed;
  before.coverage[15 * 30 + 22] = kCoverageBaked;
  Scene after = before;
  const std::uint64_t count = fill(after, {.texels = 6});
  expect_nearest(before, after, 6, count);
  after = before;
  const std::uint64_t fewer = fill(after, {.texels = 6, .fill_missed = true});
  expect_nearest(before, after, 6, fewer, false);
  EXPECT_LT(fewer, count);
}

TEST(Gutter, WithNothingBakedMissedTexelsKeepTheirValues) {
  KILN_REQUIRE_DEVICE();
  Scene before = make_scene(30, 20, 3);
  before.coverage[77] = kCoverageMissed;
  Scene after = before;
  EXPECT_EQ(fill(after, {.texels = -1, .fill_missed = true}), 0u);
  EXPECT_EQ(after.image.pixels, before.image.pixels);
  EXPECT_EQ(after.coverage, before.coverage);
}

TEST(Gutter, OppositeVectorsStillGiveUnitVectors) {
  KILN_REQUIRE_DEVICE();
  Scene scene = make_scene(64, 64, 3);
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const bool baked = i % 63 == 0;
    if (baked) scene.coverage[i] = kCoverageBaked;
    float* texel = &scene.image.pixels[3 * i];
    texel[0] = texel[1] = 0.0F;
    texel[2] = baked ? (i % 2 == 0 ? 1.0F : -1.0F) : 0.0F;
  }
  fill(scene, {.texels = -1, .unit_vectors = true});
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    EXPECT_EQ(std::abs(scene.image.pixels[3 * i + 2]), 1.0F) << i;
  }
}

TEST(Gutter, OptionsOutOfRangeAreRefused) {
  KILN_REQUIRE_DEVICE();
  Scene scene = make_scene(4, 4, 3);
  try {
    fill(scene, {.texels = -2});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
  }
  scene.coverage.pop_back();
  EXPECT_THROW(fill(scene, {}), Error);
}

// Tall enough for bands of rows that each have a mask of their own; sources lie beyond their borders, too.
TEST(GutterBands, FindSourcesOfTheBandsAround) {
  KILN_REQUIRE_DEVICE();
  constexpr int kWidth = 8, kHeight = 380000, kRadius = 5;
  Scene scene = make_scene(kWidth, kHeight, 1);
  scatter(scene, 0.02, kCoverageBaked, 11);
  scatter(scene, 0.01, kCoverageMissed, 12);
  const Scene before = scene;
  const std::uint64_t count = fill(scene, {kRadius, false, false});
  const auto place = [](int x, int y) { return static_cast<std::size_t>(y * kWidth + x); };
  std::uint64_t expected_count = 0, wrong = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      std::size_t from = place(x, y);
      const bool is_empty = before.coverage[from] == kCoverageEmpty;
      int least = kRadius * kRadius + 1;
      // Rows, then columns, upward: the first of equals decides.
      for (int row = std::max(0, y - kRadius);
           is_empty && row <= std::min(kHeight - 1, y + kRadius); ++row) {
        for (int column = 0; column < kWidth; ++column) {
          const int distance = (column - x) * (column - x) + (row - y) * (row - y);
          if (distance >= least || before.coverage[place(column, row)] == kCoverageEmpty) continue;
          least = distance;
          from = place(column, row);
        }
      }
      const bool is_filled = is_empty && from != place(x, y);
      if (is_filled) ++expected_count;
      const std::uint8_t state =
          is_filled ? std::uint8_t{kCoverageGutter} : before.coverage[place(x, y)];
      if (scene.coverage[place(x, y)] != state ||
          scene.image.pixels[place(x, y)] != before.image.pixels[from]) {
        ++wrong;
      }
    }
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(count, expected_count);
}

}  // namespace
}  // namespace kiln
