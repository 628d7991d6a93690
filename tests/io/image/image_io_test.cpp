// Reading and writing images: every format, and files of other programs.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "io/image/image_samples.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::kFormats;
using test::noise;

constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 6> kSizes = {
    {{1, 1}, {1, 40}, {40, 1}, {65, 33}, {233, 317}, {2000, 60}}};

// A value after it was stored: the format's own rounding, computed another way.
float stored(ImageFormat format, float value) {
  const double clamped = std::isnan(value) ? 0.0 : std::clamp(static_cast<double>(value), 0.0, 1.0);
  switch (format) {
    case ImageFormat::exr_float:
      return value;
    case ImageFormat::
        exr_half: {  // 11 significant bits, to nearest even, above the smallest normal
      if (value == 0.0F || !std::isfinite(value)) return value;
      const int exponent = std::max(std::ilogb(value), -14);
      const double unit = std::ldexp(1.0, exponent - 10);
      return static_cast<float>(std::nearbyint(static_cast<double>(value) / unit) * unit);
    }
    case ImageFormat::png16:
      return static_cast<float>(std::nearbyint(clamped * 65535.0) / 65535.0);
    default:
      return static_cast<float>(std::nearbyint(clamped * 255.0) / 255.0);
  }
}

TEST(ImageIo, EveryFormatComesBackAsStored) {
  const fs::path folder = test::scratch_folder();
  unsigned seed = 1;
  for (const ImageFormat format : kFormats) {
    for (const auto& [width, height] : kSizes) {
      for (std::uint32_t channels = 1; channels <= 4; ++channels) {
        const Image image = noise(width, height, channels, seed++);
        const fs::path path = folder / "image";
        save_image(image, path, {.format = format});
        const Image back = load_image(path);
        ASSERT_EQ(back.width, width);
        ASSERT_EQ(back.height, height);
        ASSERT_EQ(back.channels, channels);
        ASSERT_EQ(back.pixels.size(), image.pixels.size());
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
          ASSERT_EQ(back.pixels[i], stored(format, image.pixels[i])) << i;
        }
        // A stored value is kept exactly from then on.
        save_image(back, path, {.format = format});
        ASSERT_EQ(load_image(path).pixels, back.pixels);
      }
    }
  }
}

TEST(ImageIo, EveryQuantumOfPngIsKeptExactly) {
  const fs::path path = test::scratch_folder() / "image.png";
  for (const int top : {65535, 255}) {
    for (const bool dither : {false, true}) {
      Image image{256, static_cast<std::uint32_t>(top + 1) / 256, 1, {}};
      for (int i = 0; i <= top; ++i) {
        image.pixels.push_back(static_cast<float>(i) / static_cast<float>(top));
      }
      save_image(image, path,
                 {.format = top == 255 ? ImageFormat::png8 : ImageFormat::png16, .dither = dither});
      EXPECT_EQ(load_image(path).pixels, image.pixels);
    }
  }
}

TEST(ImageIo, PngClampsAndRoundsToNearest) {
  const fs::path path = test::scratch_folder() / "image.png";
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const float half_up = std::nextafter(0.5F / 65535.0F, 1.0F);
  const float half_down = std::nextafter(0.5F / 65535.0F, 0.0F);
  const Image image{
      9, 1, 1, {nan, infinity, -infinity, -0.0F, 1.5F, -3.0F, half_up, half_down, 1e-40F}};
  save_image(image, path, {.format = ImageFormat::png16});
  const float quantum = 1.0F / 65535.0F;
  EXPECT_EQ(load_image(path).pixels, (std::vector<float>{0, 1, 0, 0, 1, 0, quantum, 0, 0}));
  for (const ImageFormat format : {ImageFormat::png8, ImageFormat::png16}) {
    save_image(image, path, {.format = format, .dither = true});
    const Image back = load_image(path);
    EXPECT_EQ(std::vector<float>(back.pixels.begin(), back.pixels.begin() + 6),
              (std::vector<float>{0, 1, 0, 0, 1, 0}));
  }
}

TEST(ImageIo, ExrKeepsValuesThatPngCannot) {
  const fs::path path = test::scratch_folder() / "image.exr";
  const float infinity = std::numeric_limits<float>::infinity();
  const Image image{3, 2, 1, {-1.0F, infinity, -infinity, 1e-40F, 65504.0F, 1e20F}};
  save_image(image, path, {.format = ImageFormat::exr_float});
  EXPECT_EQ(load_image(path).pixels, image.pixels);
  save_image(image, path, {.format = ImageFormat::exr_half});
  EXPECT_EQ(load_image(path).pixels,
            (std::vector<float>{-1.0F, infinity, -infinity, 0.0F, 65504.0F, infinity}));
  const Image nan{1, 1, 1, {std::numeric_limits<float>::quiet_NaN()}};
  save_image(nan, path, {.format = ImageFormat::exr_half});
  EXPECT_TRUE(std::isnan(load_image(path).pixels[0]));
}

TEST(ImageIo, DitherKeepsTheMeanOfEveryBlock) {
  const fs::path path = test::scratch_folder() / "image.png";
  for (const float value : {0.5001F, 0.1234F, 0.9F, 0.0019F}) {
    const Image image{16, 16, 3, std::vector<float>(16 * 16 * 3, value)};
    save_image(image, path, {.format = ImageFormat::png8, .dither = true});
    const Image back = load_image(path);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t block = 0; block < 4; ++block) {
        double sum = 0;
        for (std::size_t i = 0; i < 64; ++i) {
          const float got = back.at(block % 2 * 8 + i % 8, block / 2 * 8 + i / 8)[c];
          EXPECT_LE(std::abs(got - value), 1.0F / 255.0F);
          sum += static_cast<double>(got);
        }
        // 64 thresholds, evenly spaced: the mean is right to half of a 64th of a quantum.
        EXPECT_NEAR(sum / 64, static_cast<double>(value), 0.51 / 64 / 255);
      }
    }
  }
}

TEST(ImageIo, SameBytesOnEveryRunAndNumberOfThreads) {
  const fs::path folder = test::scratch_folder();
  const Image image = noise(700, 400, 3, 5);
  for (const ImageFormat format : kFormats) {
    save_image(image, folder / "a", {.format = format, .threads = 1});
    const std::string first = test::read_file(folder / "a");
    for (const int threads : {0, 1, 7}) {
      save_image(image, folder / "a", {.format = format, .threads = threads});
      EXPECT_EQ(test::read_file(folder / "a"), first) << threads;
    }
  }
}

TEST(ImageIo, PngHasNoChunksButTheNecessary) {
  const fs::path path = test::scratch_folder() / "image.png";
  save_image(noise(300, 300, 3, 1), path, {.format = ImageFormat::png16});
  const std::string bytes = test::read_file(path);
  std::string kinds;
  for (std::size_t at = 8; at + 8 <= bytes.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
    }
    const std::string kind = bytes.substr(at + 4, 4);
    if (kinds.size() < 4 || kinds.substr(kinds.size() - 4) != kind) kinds += kind;
    at += length + 12;
  }
  EXPECT_EQ(kinds, "IHDRIDATIEND");
}

TEST(ImageIo, BlenderMapsAreRead) {
  KILN_REQUIRE_DATA("bunny_blender_normal.exr");
  KILN_REQUIRE_DATA("bunny_blender_ao.exr");
  const Image normal = load_image(*test::shared_data("bunny_blender_normal.exr"));
  EXPECT_EQ(normal.width, 1024u);
  EXPECT_EQ(normal.height, 1024u);
  EXPECT_EQ(normal.channels, 3u);
  // Blue, the third, is the largest on average for a tangent-space map.
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < normal.pixels.size(); ++i) {
    sum[i % 3] += static_cast<double>(normal.pixels[i]);
  }
  EXPECT_GT(sum[2], sum[0]);
  EXPECT_GT(sum[2], sum[1]);
  EXPECT_EQ(load_image(*test::shared_data("bunny_blender_ao.exr")).channels, 1u);
}

// ---- files written by libpng itself ----------------------------------------------------------------

void write_png(const fs::path& path, png_uint_32 size, int bits, int colour, int interlace,
               bool transparent, std::vector<std::vector<png_byte>> rows) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, size, size, bits, colour, interlace, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  std::array<png_color, 2> palette = {{{255, 0, 51}, {0, 102, 255}}};
  std::array<png_byte, 2> alpha = {255, 0};
  if (colour == PNG_COLOR_TYPE_PALETTE) {
    png_set_PLTE(png, info, palette.data(), 2);
    if (transparent) png_set_tRNS(png, info, alpha.data(), 2, nullptr);
  }
  std::vector<png_bytep> pointers;
  for (auto& row : rows) pointers.push_back(row.data());
  png_set_rows(png, info, pointers.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

TEST(ImageIo, PalettesBecomeColours) {
  const fs::path path = test::scratch_folder() / "image.png";
  for (const bool transparent : {false, true}) {
    write_png(path, 2, 1, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, transparent,
              {{0x40}, {0x80}});
    const Image image = load_image(path);
    std::vector<float> a = {1.0F, 0.0F, 0.2F};
    std::vector<float> b = {0.0F, 0.4F, 1.0F};
    if (transparent) a.push_back(1.0F), b.push_back(0.0F);
    std::vector<float> expected;
    for (const auto* colour : {&a, &b, &b, &a}) {
      expected.insert(expected.end(), colour->begin(), colour->end());
    }
    EXPECT_EQ(image.channels, transparent ? 4u : 3u);
    EXPECT_EQ(image.pixels, expected);
  }
}

TEST(ImageIo, InterlacedAndFewBitsAreRead) {
  const fs::path path = test::scratch_folder() / "image.png";
  std::vector<std::vector<png_byte>> rows(19, std::vector<png_byte>(19));
  for (std::size_t y = 0; y < 19; ++y) {
    for (std::size_t x = 0; x < 19; ++x) rows[y][x] = static_cast<png_byte>(y * 13 + x);
  }
  write_png(path, 19, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7, false, rows);
  const Image image = load_image(path);
  for (std::size_t y = 0; y < 19; ++y) {
    for (std::size_t x = 0; x < 19; ++x) {
      EXPECT_EQ(image.at(x, y)[0], static_cast<float>(rows[y][x]) / 255.0F);
    }
  }
  write_png(path, 2, 2, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, false, {{0x10}, {0xE0}});
  EXPECT_EQ(load_image(path).pixels,
            (std::vector<float>{0.0F, 85.0F / 255.0F, 1.0F, 170.0F / 255.0F}));
}

// ---- flat images, names -------------------------------------------------------------------------

// The most compressible images are not taken for damaged ones.
TEST(ImageIo, FlatImagesAreStillRead) {
  const fs::path path = test::scratch_folder() / "image";
  for (const float value : {0.0F, 0.5F, 1.0F}) {
    const Image image{1024, 1024, 4, std::vector<float>(std::size_t{1024} * 1024 * 4, value)};
    for (const ImageFormat format : kFormats) {
      save_image(image, path, {.format = format});
      const Image back = load_image(path);
      EXPECT_TRUE(std::all_of(back.pixels.begin(), back.pixels.end(),
                              [&](float v) { return v == stored(format, value); }));
    }
  }
}

TEST(SaveImage, TheNameAndTheFormatAgree) {
  const fs::path folder = test::scratch_folder();
  const Image image{1, 1, 1, {0.5F}};
  const auto save = [&](const char* name, ImageFormat format) {
    SaveImageOptions options;
    options.format = format;
    save_image(image, folder / name, options);
  };
  for (const auto& [name, format] :
       {std::pair("x.png", ImageFormat::exr_half), std::pair("x.PNG", ImageFormat::exr_float),
        std::pair("x.exr", ImageFormat::png8), std::pair("x.Exr", ImageFormat::png16)}) {
    try {
      save(name, format);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
    }
    EXPECT_FALSE(fs::exists(folder / name));
  }
  save("x.png", ImageFormat::png8);
  save("y.exr", ImageFormat::exr_half);
  save("without", ImageFormat::exr_half);
}

}  // namespace
}  // namespace kiln
