// Sizes and encodings of pictures within a number of bytes.
#include "plan/picture_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "base/srgb.h"
#include "kiln/image.h"
#include "kiln/map.h"

namespace kiln {
namespace {

Image image_of(std::uint32_t side, std::uint32_t channels) {
  Image image{side, side, channels, {}};
  image.pixels.resize(std::size_t{side} * side * channels);
  return image;
}

/// Waves of a normal map, fine enough that half the texels lose some of them.
Image waves(std::uint32_t side) {
  Image image = image_of(side, 3);
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double a = 0.3 * std::sin(0.9 * x), b = 0.3 * std::cos(0.7 * y);
      const double length = std::sqrt(a * a + b * b + 1);
      image.at(x, y)[0] = static_cast<float>(a / length / 2 + 0.5);
      image.at(x, y)[1] = static_cast<float>(b / length / 2 + 0.5);
      image.at(x, y)[2] = static_cast<float>(1 / length / 2 + 0.5);
    }
  }
  return image;
}

PictureFitOptions png_alone() {
  PictureFitOptions options;
  options.any_format = false;
  options.encode.dither = Dither::off;
  options.max_picture_bytes = 1U << 30U;
  return options;
}

PictureEncodings make_encodings(std::vector<std::pair<std::uint64_t, double>> choices,
                                double weight = 1) {
  PictureEncodings picture_encodings{PictureSlot::color, weight, {}, {}};
  for (const auto& [bytes, error] : choices) {
    PictureChoice& choice = picture_encodings.choices.emplace_back();
    choice.bytes = bytes;
    choice.error.steps = error;
  }
  return picture_encodings;
}

/// Random pictures with few encodings, so small that every byte is a class of its own: all combinations are tried.
TEST(PictureFit, IsTheBestOfAllCombinations) {
  std::mt19937 random(7);
  const auto number = [&](int most) {
    return static_cast<int>(random() % static_cast<unsigned>(most));
  };
  for (int round = 0; round < 50; ++round) {
    std::vector<PictureEncodings> encodings_by_picture;
    for (int i = 0; i < 3; ++i) {
      std::vector<std::pair<std::uint64_t, double>> choices;
      std::uint64_t bytes = 1;
      double error = 100;
      for (int k = 0; k < 5; ++k) {
        bytes += 4 + static_cast<std::uint64_t>(number(60));
        error -= 1 + number(15);
        choices.emplace_back(bytes, error);
      }
      encodings_by_picture.push_back(make_encodings(choices, 1 + i));
    }
    for (std::uint64_t most = 10; most < 700; most += 37) {
      double least = HUGE_VAL;
      for (std::size_t c = 0; c < 125; ++c) {
        const std::size_t of[] = {c % 5, c / 5 % 5, c / 25};
        std::uint64_t bytes = 0;
        double error = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          bytes += encodings_by_picture[i].choices[of[i]].bytes;
          error +=
              encodings_by_picture[i].weight * encodings_by_picture[i].choices[of[i]].error.steps;
        }
        if (bytes <= most) least = std::min(least, error);
      }
      const std::optional<PictureFit> fit = least_error(encodings_by_picture, most);
      ASSERT_EQ(fit.has_value(), least < HUGE_VAL) << most;
      if (!fit) continue;
      EXPECT_LE(fit->bytes, most);
      EXPECT_DOUBLE_EQ(fit->error, least);
    }
    EXPECT_TRUE(least_error(encodings_by_picture, least_bytes(encodings_by_picture)));
    EXPECT_FALSE(least_error(encodings_by_picture, least_bytes(encodings_by_picture) - 1));
  }
}

TEST(PictureFit, EncodingsRiseInBytesAndFallInError) {
  const Image normal = waves(128);
  AssetMaps maps;
  maps.normal = &normal;
  PictureFitOptions options;
  options.max_picture_bytes = 1U << 30U;
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, options);
  ASSERT_EQ(encodings_by_picture.size(), 1U);
  const std::vector<PictureChoice>& choices = encodings_by_picture[0].choices;
  ASSERT_GT(choices.size(), 4U);
  bool has_png = false, has_jpeg = false;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const PictureChoice& choice = choices[i];
    EXPECT_EQ(choice.bytes, (choice.data.size() + 3) / 4 * 4);
    const Image back = load_image(choice.data);
    EXPECT_EQ(back.width, choice.width);
    EXPECT_EQ(back.height, choice.height);
    EXPECT_EQ(choice.width, 128U >> choice.level);
    (choice.encoding.format == PictureFormat::png ? has_png : has_jpeg) = true;
    if (i == 0) continue;
    EXPECT_GT(choice.bytes, choices[i - 1].bytes);
    EXPECT_LT(choice.error.steps, choices[i - 1].error.steps);
  }
  EXPECT_TRUE(has_png && has_jpeg);
  // Whole and without loss: rounding to 8 bits alone, at most half a step a channel.
  EXPECT_LT(choices.back().error.steps, 0.5 * std::sqrt(3.0));
  EXPECT_EQ(choices.back().level, 0U);
  // Errors of sizes are those of their pictures without loss, and grow as sizes fall.
  const std::vector<PictureError>& levels = encodings_by_picture[0].levels;
  ASSERT_EQ(levels.size(), 4U);  // 128 to 16
  for (std::size_t level = 0; level < levels.size(); ++level) {
    if (level > 0) EXPECT_GT(levels[level].steps, levels[level - 1].steps) << level;
    for (const PictureChoice& choice : choices) {
      if (choice.level != level) continue;
      if (choice.encoding.format != PictureFormat::png) {
        EXPECT_GT(choice.error.steps, 0.9 * levels[level].steps) << level;
        continue;
      }
      EXPECT_NEAR(choice.error.steps, levels[level].steps, 1e-6) << level;
      EXPECT_NEAR(choice.error.degrees, levels[level].degrees, 1e-6) << level;
    }
  }
}

/// What is not covered has no part in smaller sizes: white on a black ground stays white.
TEST(PictureFit, GroundDoesNotBleedIntoSmallerSizes) {
  Image color = image_of(64, 3);
  std::vector<std::uint8_t> coverage(64 * 64, static_cast<std::uint8_t>(TexelState::empty));
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      if (x < 21 || y < 13) continue;
      std::fill_n(color.at(x, y), 3, 1.0F);
      coverage[y * 64 + x] = static_cast<std::uint8_t>(TexelState::baked);
    }
  }
  AssetMaps maps;
  maps.color = &color;
  maps.coverage = coverage;
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, png_alone());
  ASSERT_EQ(encodings_by_picture.size(), 1U);
  EXPECT_EQ(encodings_by_picture[0].levels.size(), 3U);  // 64, 32, 16
  for (const PictureError& level : encodings_by_picture[0].levels) EXPECT_EQ(level.steps, 0);
  // All sizes are right, so that the smallest file is the only one worth it.
  ASSERT_EQ(encodings_by_picture[0].choices.size(), 1U);
  const Image small = load_image(encodings_by_picture[0].choices[0].data);
  for (const float value : small.pixels) EXPECT_EQ(value, 1);
}

/// Texels of smaller sizes are means of the covered texels below them, of all sizes in between alike.
TEST(PictureFit, SmallerSizesAreMeansOfCoveredTexels) {
  Image color{128, 64, 3, std::vector<float>(128 * 64 * 3)};
  std::vector<std::uint8_t> coverage(128 * 64);
  std::mt19937 random(3);
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 128; ++x) {
      const bool is_covered = x < 4 || y < 4 || random() % 5 < 2;
      coverage[y * 128 + x] =
          static_cast<std::uint8_t>(is_covered ? TexelState::baked : TexelState::empty);
      std::fill_n(color.at(x, y), 3, random() % 3 == 0 ? 1.0F : 0.0F);
    }
  }
  AssetMaps maps;
  maps.color = &color;
  maps.coverage = coverage;
  std::vector<bool> is_found(3);
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, png_alone());
  for (const PictureChoice& choice : encodings_by_picture[0].choices) {
    const std::uint32_t side = 1U << choice.level;
    const Image small = load_image(choice.data);
    ASSERT_EQ(small.width * side, 128U);
    ASSERT_EQ(small.height * side, 64U);
    is_found[choice.level] = true;
    for (std::uint32_t y = 0; y < small.height; ++y) {
      for (std::uint32_t x = 0; x < small.width; ++x) {
        double sum = 0, count = 0;
        for (std::uint32_t k = 0; k < side * side; ++k) {
          const std::uint32_t at_x = side * x + k % side, at_y = side * y + k / side;
          if (coverage[at_y * 128 + at_x] == static_cast<std::uint8_t>(TexelState::empty)) continue;
          sum += color.at(at_x, at_y)[0], ++count;
        }
        if (count == 0) continue;
        EXPECT_NEAR(small.at(x, y)[0], to_srgb(static_cast<float>(sum / count)), 0.51 / 255)
            << choice.level << ": " << x << ", " << y;
      }
    }
  }
  EXPECT_EQ(is_found, std::vector<bool>(3, true));
}

/// Sizes that halve to odd ones: the last column has no neighbour in the next row.
TEST(PictureFit, FillsTheLastColumnOfAnOddSizeFromItself) {
  Image color{130, 66, 3, std::vector<float>(130 * 66 * 3)};
  std::vector<std::uint8_t> coverage(130 * 66, static_cast<std::uint8_t>(TexelState::empty));
  for (std::uint32_t y = 0; y < 66; ++y) {
    for (const std::uint32_t x : {0U, 1U, 128U, 129U}) {
      if (x > 1 && y / 2 % 2 == 1) continue;
      coverage[y * 130 + x] = static_cast<std::uint8_t>(TexelState::baked);
      std::fill_n(color.at(x, y), 3, x > 1 ? 1.0F : 0.0F);
    }
  }
  AssetMaps maps;
  maps.color = &color;
  maps.coverage = coverage;
  const Image small = load_image(encode_pictures(maps, png_alone())[0].choices[0].data);
  ASSERT_EQ(small.width, 65U);
  ASSERT_EQ(small.height, 33U);
  for (std::uint32_t y = 0; y < 33; ++y) {
    EXPECT_EQ(small.at(64, y)[0], 1) << y;
    EXPECT_EQ(small.at(0, y)[0], 0) << y;
  }
}

/// Colours are averaged as light: black and white make 188 of 255.
TEST(PictureFit, ColoursAreAveragedInLinearLight) {
  Image color = image_of(32, 3);
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x)
      std::fill_n(color.at(x, y), 3, (x + y) % 2 == 0 ? 1.0F : 0.0F);
  }
  AssetMaps maps;
  maps.color = &color;
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, png_alone());
  const Image small = load_image(encodings_by_picture[0].choices[0].data);
  ASSERT_EQ(small.width, 16U);
  EXPECT_EQ(std::lround(255 * small.at(3, 5)[0]), 188);
}

/// A mean of normals is a direction, of unit length.
TEST(PictureFit, NormalsAreAveragedAsDirections) {
  Image normal = image_of(32, 3);
  const float tilt = static_cast<float>(std::sqrt(0.5) / 2);
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      const float side = x % 2 == 0 ? tilt : -tilt;
      float* const texel = normal.at(x, y);
      texel[0] = 0.5F + side;
      texel[1] = 0.5F;
      texel[2] = 0.5F + tilt;
    }
  }
  AssetMaps maps;
  maps.normal = &normal;
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, png_alone());
  const auto& choices = encodings_by_picture[0].choices;
  const Image small = load_image(choices[0].data);
  ASSERT_EQ(small.width, 16U);
  EXPECT_EQ(std::lround(255 * small.at(8, 8)[2]), 255);
  // Each texel is 45 degrees off: by that angle, and by half its chord in steps.
  EXPECT_NEAR(choices[0].error.degrees, 45, 0.5);
  EXPECT_NEAR(choices[0].error.steps, 255 * std::sin(22.5 * 3.14159265 / 180), 1);
}

TEST(PictureFit, OptionsLeaveWaysOut) {
  const Image normal = waves(64), color = waves(64);
  AssetMaps maps;
  maps.normal = &normal;
  maps.color = &color;
  for (const PictureEncodings& picture_encodings : encode_pictures(maps, png_alone())) {
    for (const PictureChoice& choice : picture_encodings.choices) {
      EXPECT_EQ(choice.encoding.format, PictureFormat::png);
    }
  }
  PictureFitOptions jpeg = png_alone();
  jpeg.encode.format = PictureFormat::jpeg;
  jpeg.encode.quality = 77;
  jpeg.encode.max_normal_error = 0.4;
  for (const PictureEncodings& picture_encodings : encode_pictures(maps, jpeg)) {
    for (const PictureChoice& choice : picture_encodings.choices) {
      if (picture_encodings.picture == PictureSlot::color) {
        EXPECT_EQ(choice.encoding.format, PictureFormat::jpeg);
        EXPECT_EQ(choice.encoding.quality, 77U);
      } else if (choice.level == 0) {
        EXPECT_LE(choice.error.degrees, 0.4);  // or a PNG
      }
    }
  }
  // In any format a quality excludes all others, but for normals, which have a bound of their own.
  PictureFitOptions fixed = jpeg;
  fixed.any_format = true;
  fixed.encode.max_normal_error = 0;
  for (const PictureEncodings& picture_encodings : encode_pictures(maps, fixed)) {
    bool has_others = false;
    for (const PictureChoice& choice : picture_encodings.choices)
      has_others = has_others || choice.encoding.quality != 77;
    EXPECT_EQ(has_others, picture_encodings.picture == PictureSlot::normal);
  }
  // JPEG has no alpha.
  Image opacity = image_of(64, 1);
  maps.opacity = &opacity;
  jpeg.any_format = true;
  for (const PictureEncodings& picture_encodings : encode_pictures(maps, jpeg)) {
    if (picture_encodings.picture != PictureSlot::color) continue;
    for (const PictureChoice& choice : picture_encodings.choices) {
      EXPECT_EQ(choice.encoding.format, PictureFormat::png);
      EXPECT_EQ(load_image(choice.data).channels, 4U);
    }
  }
}

/// What cannot fit is not kept; the smallest size always is.
TEST(PictureFit, KeepsWhatMayFit) {
  const Image normal = waves(256);
  AssetMaps maps;
  maps.normal = &normal;
  PictureFitOptions options = png_alone();
  options.max_picture_bytes = 8000;
  const std::vector<PictureEncodings> encodings_by_picture = encode_pictures(maps, options);
  EXPECT_GE(encodings_by_picture[0].choices.size(), 2U);
  EXPECT_LT(encodings_by_picture[0].choices.front().bytes, 8000U);
  options.max_picture_bytes = 1;
  EXPECT_EQ(encode_pictures(maps, options)[0].choices.size(), 1U);
}

/// Bytes and errors between two qualities of one size lie on a line in log-log scale.
TEST(PictureFit, EstimatesQualitiesBetweenThoseTried) {
  PictureEncodings picture_encodings;
  const auto add = [&](std::size_t level, PictureFormat format, std::uint32_t quality,
                       std::uint64_t bytes, double error) {
    PictureChoice& choice = picture_encodings.choices.emplace_back();
    choice.level = level;
    choice.width = choice.height = 256U >> level;
    choice.encoding.format = format;
    choice.encoding.quality = quality;
    choice.bytes = bytes;
    choice.error = {error, error / 2};
  };
  add(1, PictureFormat::jpeg, 50, 1000, 8);
  add(0, PictureFormat::jpeg, 35, 3000, 2.9);
  add(1, PictureFormat::jpeg, 65, 8000, 1);
  add(0, PictureFormat::jpeg, 50, 24000, 0.5);
  add(0, PictureFormat::png, 0, 90000, 0.1);
  add_intermediate_qualities(picture_encodings);
  struct Rung {
    std::size_t level;
    std::uint32_t quality;
    std::uint64_t bytes;
    double error;
  };
  // 4000 bytes of half the size at quality 60 have an error of 2; 6000 bytes of the whole size have 1.61.
  const std::vector<Rung> wanted = {
      {1, 50, 1000, 8},        {1, 55, 2000, 4},       {0, 35, 3000, 2.9},
      {1, 60, 4000, 2},        {0, 40, 6000, 1.61427}, {1, 65, 8000, 1},
      {0, 45, 12000, 0.89841}, {0, 50, 24000, 0.5},    {0, 0, 90000, 0.1}};
  ASSERT_EQ(picture_encodings.choices.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const PictureChoice& choice = picture_encodings.choices[i];
    EXPECT_EQ(choice.level, wanted[i].level) << i;
    EXPECT_EQ(choice.width, 256U >> wanted[i].level) << i;
    EXPECT_EQ(choice.encoding.quality, wanted[i].quality) << i;
    EXPECT_NEAR(static_cast<double>(choice.bytes), static_cast<double>(wanted[i].bytes), 1) << i;
    EXPECT_NEAR(choice.error.steps, wanted[i].error, 1e-3) << i;
    EXPECT_NEAR(choice.error.degrees, wanted[i].error / 2, 1e-3) << i;
  }
}

/// Over all budgets, estimates from a few qualities are nearer to the best of all qualities than the few are.
TEST(PictureFit, EstimatesAreNearAllQualities) {
  const Image normal = waves(128);
  AssetMaps maps;
  maps.normal = &normal;
  PictureFitOptions options;
  options.max_picture_bytes = 1U << 30U;
  const std::vector<PictureEncodings> few = encode_pictures(maps, options);
  std::vector<PictureEncodings> estimated = few;
  add_intermediate_qualities(estimated[0]);
  options.all_qualities = true;
  const std::vector<PictureEncodings> all = encode_pictures(maps, options);
  double deviation_of_few = 0, deviation_of_estimates = 0;
  for (double budget = 1.1 * static_cast<double>(least_bytes(all)); budget < 30000;
       budget *= 1.03) {
    const auto bytes = static_cast<std::uint64_t>(budget);
    const double error = least_error(all, bytes)->error;
    deviation_of_few += std::abs(std::log(least_error(few, bytes)->error / error));
    deviation_of_estimates += std::abs(std::log(least_error(estimated, bytes)->error / error));
  }
  EXPECT_LT(deviation_of_estimates, 0.6 * deviation_of_few);
}

/// Each slot has a picture_encodings of its own use, in the order of slots: emission is averaged as light, roughness as a number.
TEST(PictureFit, EverySlotHasALadder) {
  const Image normal = waves(32);
  Image color = image_of(32, 3), emission = image_of(32, 3), roughness = image_of(32, 1);
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      const bool is_light = (x + y) % 2 == 0;
      color.at(x, y)[1] = is_light ? 1.0F : 0.0F;
      emission.at(x, y)[2] = is_light ? 1.0F : 0.0F;
      roughness.at(x, y)[0] = is_light ? 1.0F : 0.0F;
    }
  }
  AssetMaps maps;
  maps.normal = &normal;
  maps.color = &color;
  maps.emission = &emission;
  maps.roughness = &roughness;
  const std::vector<PictureEncodings> encodings = encode_pictures(maps, png_alone());
  ASSERT_EQ(encodings.size(), 4U);
  EXPECT_EQ(encodings[0].picture, PictureSlot::normal);
  EXPECT_EQ(encodings[1].picture, PictureSlot::color);
  EXPECT_EQ(encodings[2].picture, PictureSlot::surface);
  EXPECT_EQ(encodings[3].picture, PictureSlot::emission);
  const auto half = [](const PictureEncodings& picture_encodings, std::size_t channel) {
    const Image small = load_image(picture_encodings.choices.front().data);
    EXPECT_EQ(small.width, 16U);
    return std::lround(255 * small.at(7, 2)[channel]);
  };
  EXPECT_EQ(half(encodings[1], 1), 188);
  EXPECT_EQ(half(encodings[3], 2), 188);
  EXPECT_EQ(half(encodings[3], 0), 0);
  EXPECT_NEAR(static_cast<double>(half(encodings[2], 1)), 127.5, 1);
}

/// Normals whose mean is nothing face the viewer.
TEST(PictureFit, OppositeNormalsBecomeTheSurfacesOwn) {
  Image normal = image_of(32, 3);
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      normal.at(x, y)[0] = x % 2 == 0 ? 1.0F : 0.0F;
      normal.at(x, y)[1] = normal.at(x, y)[2] = 0.5F;
    }
  }
  AssetMaps maps;
  maps.normal = &normal;
  const Image small = load_image(encode_pictures(maps, png_alone())[0].choices[0].data);
  ASSERT_EQ(small.width, 16U);
  EXPECT_EQ(std::lround(255 * small.at(3, 5)[0]), 128);
  EXPECT_EQ(std::lround(255 * small.at(3, 5)[1]), 128);
  EXPECT_EQ(std::lround(255 * small.at(3, 5)[2]), 255);
}

/// The ground is filled from far, in pictures that are taller than wide as in wide ones.
TEST(PictureFit, TallPicturesAreFilledToTheirEnd) {
  for (const auto& [width, height] : {std::pair{32U, 256U}, std::pair{256U, 32U}}) {
    Image color{width, height, 3, std::vector<float>(std::size_t{3} * width * height)};
    std::vector<std::uint8_t> coverage(std::size_t{width} * height,
                                       static_cast<std::uint8_t>(TexelState::empty));
    // Noise where nothing is covered: the whole size is no small file.
    std::mt19937 random(5);
    for (float& value : color.pixels) value = static_cast<float>(random() % 256) / 255;
    for (std::uint32_t k = 0; k < 2; ++k) {
      for (std::uint32_t i = 0; i < 2; ++i) {
        std::copy_n(std::array<float, 3>{1, 0, 0}.data(), 3, color.at(i, k));
        coverage[k * width + i] = static_cast<std::uint8_t>(TexelState::baked);
      }
    }
    AssetMaps maps;
    maps.color = &color;
    maps.coverage = coverage;
    const Image small = load_image(encode_pictures(maps, png_alone())[0].choices[0].data);
    ASSERT_EQ(small.width, width / 2);
    ASSERT_EQ(small.height, height / 2);
    for (std::uint32_t y = 0; y < small.height; ++y) {
      for (std::uint32_t x = 0; x < small.width; ++x) {
        ASSERT_EQ(small.at(x, y)[0], 1) << x << ' ' << y;
        ASSERT_EQ(small.at(x, y)[1], 0) << x << ' ' << y;
      }
    }
  }
}

/// A lossy picture of normals is kept only within the bound of its encoding at its own size.
TEST(PictureFit, LossyNormalsStayWithinTheirBound) {
  const Image normal = waves(64);
  AssetMaps maps;
  maps.normal = &normal;
  PictureFitOptions options;
  options.max_picture_bytes = 1U << 30U;
  options.encode.dither = Dither::off;
  const auto count_lossy = [&](double bound) {
    options.encode.max_normal_error = bound;
    std::size_t count = 0;
    const std::vector<PictureEncodings> encodings = encode_pictures(maps, options);
    for (const PictureChoice& choice : encodings[0].choices) {
      if (!choice.encoding.is_lossy()) continue;
      ++count;
      if (choice.level == 0) EXPECT_LE(choice.error.degrees, bound);
    }
    return count;
  };
  EXPECT_EQ(count_lossy(1e-3), 0U);
  EXPECT_GT(count_lossy(60), 0U);
}

}  // namespace
}  // namespace kiln
