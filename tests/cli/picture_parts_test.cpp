// Parts of pictures that commands draw: ticks of axes, colour scales, and sheets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "picture/plot.h"
#include "picture/sheet.h"

namespace kiln::cli {
namespace {

/// Ticks are powers of four, each four times the one before, that enclose the range as tightly as two ticks allow.
TEST(PlotTicks, EncloseTheRange) {
  for (const auto& [least, most] : {std::pair(0.5, 3.0),
                                    {1.0, 4.0},
                                    {2.5, 2.6},
                                    {4.0, 4.0},
                                    {3.9, 4.1},
                                    {17.0, 5000.0},
                                    {1.0 / 256, 1.0}}) {
    const Json ticks = power_of_four_ticks(least, most);
    ASSERT_GE(ticks.size(), 2U);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      const double power = std::log2(ticks[i].number()) / 2;
      EXPECT_EQ(power, std::round(power)) << least << ' ' << most;
      if (i > 0) EXPECT_EQ(ticks[i].number(), 4 * ticks[i - 1].number());
    }
    EXPECT_LE(ticks[0].number(), least);
    EXPECT_GT(4 * ticks[0].number(), least);
    EXPECT_GE(ticks.back().number(), most);
    if (ticks.size() > 2) EXPECT_LT(ticks.back().number() / 4, most);
  }
}

/// The end of a scale is the smallest of its round numbers that at most 3% of the values exceed.
TEST(ColourScale, EndsAtTheFirstRoundNumberThatFewValuesExceed) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<double> values(1 + random() % 220);
    for (double& value : values) {
      // Some values are round numbers themselves.
      value = random() % 3 == 0 ? std::pow(10.0, static_cast<double>(random() % 3))
                                : std::pow(10.0, static_cast<double>(random() % 4000) / 1000 - 1);
    }
    const double end = round_scale_end(values);
    double expected = 1e-9;
    const auto beyond = [&](double limit) {
      return static_cast<double>(std::count_if(
          values.begin(), values.end(), [&](double value) { return value > limit * (1 + 1e-9); }));
    };
    for (bool found = false; !found;) {
      for (const double step : {1.0, 2.0, 5.0}) {
        if (100 * beyond(step * expected) > 3 * static_cast<double>(values.size())) continue;
        expected *= step;
        found = true;
        break;
      }
      if (!found) expected *= 10;
    }
    EXPECT_NEAR(end / expected, 1, 1e-6) << trial;
  }
  EXPECT_NEAR(round_scale_end({}), 1e-9, 1e-15);
}

/// Means are over the pixels that both meshes cover, a difference of 0 included; others are white or of one mesh.
TEST(AnglePictures, CountWhatBothMeshesCover) {
  AnglePictures pictures;
  pictures.add(Image{5, 1, 1, {-1, -2, 0, 1, 5}});
  pictures.add(Image{2, 1, 1, {-1, -2}});
  EXPECT_DOUBLE_EQ(pictures.mean(0), 2);
  EXPECT_DOUBLE_EQ(pictures.mean(1), 0);
  const Scale scale = pictures.scale();
  EXPECT_DOUBLE_EQ(scale.end, 5);
  const Image picture = pictures.picture(0, scale);
  const auto expect_colour = [&](std::size_t x, const Colour& colour) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(picture.at(x, 0)[c], colour[c]) << x;
  };
  expect_colour(0, Colour{1, 1, 1});
  expect_colour(1, scale.others.at(0).first);
  for (std::size_t x = 2; x < 5; ++x)
    expect_colour(x, scale_colour(std::vector{0.0, 0.2, 1.0}[x - 2]));
}

/// The scale runs from the first to the last of its colours, and beyond stays at them.
TEST(ColourScale, RunsThroughItsColours) {
  EXPECT_EQ(scale_colour(-1), scale_colour(0));
  EXPECT_EQ(scale_colour(2), scale_colour(1));
  const Colour last = scale_colour(1);
  EXPECT_EQ(last[1], 1.0F);
  double before = 0;
  for (int i = 1; i <= 80; ++i) {
    const Colour a = scale_colour((i - 1) / 80.0), b = scale_colour(i / 80.0);
    double step = 0, light = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      step = std::max(step, std::abs(double{b[c]} - a[c]));
      light += double{b[c]};
    }
    EXPECT_LT(step, 0.05) << i;  // without a jump
    EXPECT_GT(light, before) << i;
    before = light;
  }
}

/// Panels fill rows from left to right.
TEST(Sheet, FillsRowsFromTheLeft) {
  std::vector<Panel> panels;
  for (int i = 0; i < 5; ++i) {
    const auto shade = 0.1F * static_cast<float>(i);
    panels.push_back({Image{40, 20, 3, std::vector<float>(std::size_t{40} * 20 * 3, shade)}, {}});
  }
  const Image sheet = make_sheet(panels, {}, 3);
  std::vector<std::vector<double>> rows;
  // Distinct shades along lines of the sheet
  for (std::uint32_t y = 0; y < sheet.height; ++y) {
    std::vector<double> shades;
    for (std::uint32_t x = 0; x < sheet.width; ++x) {
      const double value = std::round(10 * double{sheet.at(x, y)[0]}) / 10;
      if (value < 0.45 && (shades.empty() || shades.back() != value)) shades.push_back(value);
    }
    if (!shades.empty() && (rows.empty() || rows.back() != shades)) rows.push_back(shades);
  }
  EXPECT_EQ(rows, (std::vector<std::vector<double>>{{0, 0.1, 0.2}, {0.3, 0.4}}));
}

}  // namespace
}  // namespace kiln::cli
