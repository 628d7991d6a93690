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

#ifdef KILN_HAS_TIFF
#include <tiffio.h>
#endif

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

/// What cannot be an image is refused with its numbers, and leaves no file.
TEST(SaveImage, RefusesShapesThatAreNone) {
  const fs::path path = test::scratch_folder() / "bad.png";
  const auto refusal = [&](const Image& image) -> std::string {
    try {
      save_image(image, path, {.format = ImageFormat::png8});
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  const auto image = [](std::uint32_t width, std::uint32_t height, std::uint32_t channels,
                        std::size_t values) {
    return Image{width, height, channels, std::vector<float>(values)};
  };
  const std::string sides = " pixels cannot be saved; each side must be 1 to ";
  EXPECT_NE(refusal(image(0, 3, 1, 0)).find("An image of 0 x 3" + sides), std::string::npos);
  EXPECT_NE(refusal(image(3, 0, 1, 0)).find("An image of 3 x 0" + sides), std::string::npos);
  EXPECT_NE(refusal(image(1U << 30U, 1, 1, 0)).find("An image of 1073741824 x 1" + sides),
            std::string::npos);
  EXPECT_NE(refusal(image(1, 1U << 30U, 1, 0)).find("An image of 1 x 1073741824" + sides),
            std::string::npos);
  EXPECT_NE(refusal(image(2, 3, 0, 0)).find("An image of 0 channels cannot be saved; use 1 to 4."),
            std::string::npos);
  EXPECT_NE(refusal(image(2, 3, 5, 30)).find("An image of 5 channels cannot be saved; use 1 to 4."),
            std::string::npos);
  for (const std::size_t values : {23U, 25U}) {
    EXPECT_NE(refusal(image(2, 3, 4, values))
                  .find("An image's pixels hold " + std::to_string(values) +
                        " values, not width x height x channels = 24."),
              std::string::npos);
  }
  EXPECT_FALSE(fs::exists(path));
}

/// Mip levels halve both sides to 1 x 1 and keep the channels: the wrong one is named.
TEST(SaveImage, RefusesLevelsThatDoNotHalve) {
  const fs::path path = test::scratch_folder() / "mips.exr";
  const auto level = [](std::uint32_t width, std::uint32_t height, std::uint32_t channels = 3) {
    return Image{width, height, channels,
                 std::vector<float>(std::size_t{width} * height * channels, 0.5F)};
  };
  const auto refusal = [&](const std::vector<Image>& mips) -> std::string {
    try {
      save_mipmapped(level(9, 5), mips, path, {.format = ImageFormat::exr_half});
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({level(4, 2), level(2, 1), level(1, 1)}), "");
  fs::remove(path);
  const std::string halves =
      " channels; each level must have the image's channels and half the sides of the last, "
      "rounded down, until 1 x 1.";
  EXPECT_NE(refusal({level(4, 2), level(1, 1)}).find("Mip level 2 is 1 x 1 with 3" + halves),
            std::string::npos);
  EXPECT_NE(
      refusal({level(4, 3), level(2, 1), level(1, 1)}).find("Mip level 1 is 4 x 3 with 3" + halves),
      std::string::npos);
  EXPECT_NE(refusal({level(4, 2), level(2, 1, 4), level(1, 1)})
                .find("Mip level 2 is 2 x 1 with 4" + halves),
            std::string::npos);
  EXPECT_NE(refusal({level(4, 2), level(2, 1), level(1, 1), level(1, 1)})
                .find("Mip level 4 is 1 x 1 with 3" + halves),
            std::string::npos);
  EXPECT_NE(refusal({level(4, 2), level(2, 1)})
                .find("The last of 2 mip levels is 2 x 1; give all levels down to 1 x 1."),
            std::string::npos);
  EXPECT_FALSE(fs::exists(path));
}

#ifdef KILN_HAS_TIFF
/// Alpha is marked as such, and not as multiplied into the colours, in TIFFs of grey as of colours; other TIFFs have no
/// extra sample.
TEST(SaveImage, TiffsSayWhatTheirExtraSampleIs) {
  const fs::path path = test::scratch_folder() / "alpha.tif";
  for (const ImageFormat format :
       {ImageFormat::tiff8, ImageFormat::tiff16, ImageFormat::tiff_float}) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
      Image image{3, 2, channels, {}};
      for (std::uint32_t i = 0; i < 6 * channels; ++i)
        image.pixels.push_back(static_cast<float>(i * 10) / 255);
      save_image(image, path, {.format = format});
      TIFF* const file = TIFFOpen(path.c_str(), "r");
      ASSERT_NE(file, nullptr);
      std::uint16_t samples = 0, count = 0, photometric = 0;
      std::uint16_t* kinds = nullptr;
      TIFFGetField(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
      TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &photometric);
      const bool has_extra = TIFFGetField(file, TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1;
      EXPECT_EQ(samples, channels);
      EXPECT_EQ(photometric, channels < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
      const bool has_alpha = channels == 2 || channels == 4;
      EXPECT_EQ(has_extra && count > 0, has_alpha) << channels;
      if (has_alpha && count > 0) {
        EXPECT_EQ(count, 1U);
        EXPECT_EQ(kinds[0], EXTRASAMPLE_UNASSALPHA) << channels;
      }
      TIFFClose(file);
      const Image back = load_image(path);
      ASSERT_EQ(back.channels, channels);
      for (std::size_t i = 0; i < image.pixels.size(); ++i)
        EXPECT_NEAR(back.pixels[i], image.pixels[i], 1.0 / 65535) << i;
    }
  }
}
#endif

/// Errors of what a file stores: those of the channel that is off most, over the texels that count; of heights that no
/// block of rows divides.
TEST(StoredError, CountsCoveredTexelsAlone) {
  Image image{5, 19, 2, std::vector<float>(5 * 19 * 2, 0.0F)};
  std::vector<std::uint8_t> coverage(5 * 19, 1);
  // Half a step and a quarter of a step off, the larger one in the second channel.
  image.at(3, 18)[0] = 10.25F / 255;
  image.at(3, 18)[1] = 20.4F / 255;
  image.at(1, 7)[0] = 30.3F / 255;
  SaveImageOptions options;
  options.format = ImageFormat::png8;
  options.dither = false;
  const StoredError all = stored_error(image, options, {});
  EXPECT_NEAR(all.max, 0.4, 1e-4);
  EXPECT_NEAR(all.mean, (0.4 + 0.3) / 95, 1e-6);
  coverage[18 * 5 + 3] = 2;
  const StoredError covered = stored_error(image, options, coverage);
  EXPECT_NEAR(covered.max, 0.3, 1e-4);
  EXPECT_NEAR(covered.mean, 0.3 / 94, 1e-6);
  std::fill(coverage.begin(), coverage.end(), std::uint8_t{0});
  EXPECT_EQ(stored_error(image, options, coverage).max, 0);
  EXPECT_EQ(stored_error(image, options, coverage).mean, 0);
}

}  // namespace
}  // namespace kiln
