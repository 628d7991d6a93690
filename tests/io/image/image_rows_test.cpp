// Files that are written row by row hold the bytes of those that are written at once.
#include "io/image/image_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "io/image/stored_error.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  Image image{width, height, channels, {}};
  std::mt19937 random(width * 31 + height * 7 + channels);
  for (std::size_t i = 0; i < std::size_t{width} * height * channels; ++i) {
    // Runs of one value beside noise, and values that are clamped
    image.pixels.push_back(i / 997 % 2 == 0 ? 0.5F
                                            : static_cast<float>(random() % 2001) / 1500 - 0.1F);
  }
  return image;
}

Image rows_of(const Image& image, std::uint32_t first, std::uint32_t count) {
  const std::size_t row = std::size_t{image.width} * image.channels;
  const auto begin = image.pixels.begin() + static_cast<std::ptrdiff_t>(first * row);
  return {image.width, count, image.channels,
          std::vector<float>(begin, begin + static_cast<std::ptrdiff_t>(count * row))};
}

/// Sizes around those at which small pictures are deflated by another library, and around a band's rows.
const std::vector<std::pair<std::uint32_t, std::uint32_t>> kSizes = {
    {1, 1}, {5, 3}, {64, 300}, {700, 513}, {1500, 1025}};

SaveImageOptions options_of(ImageFormat format) {
  SaveImageOptions options{format};
  options.texts = {{"Unit", "world units"}};
  options.origin = {1, 2.5, -3};
  options.dither = format == ImageFormat::png8;
  return options;
}

TEST(ImageRows, AreTheBytesOfTheWholeImage) {
  const fs::path folder = test::scratch_folder();
  for (const ImageFormat format :
       {ImageFormat::png16, ImageFormat::png8, ImageFormat::exr_half, ImageFormat::exr_float}) {
    EXPECT_TRUE(writes_rows(format));
    const std::string extension(extension_of(format));
    for (const auto& [width, height] : kSizes) {
      const Image image = noise(width, height, 1 + height % 4);
      const SaveImageOptions options = options_of(format);
      const fs::path whole = folder / ("whole" + extension),
                     divided = folder / ("rows" + extension);
      save_image(image, whole, options);
      const std::string expected = test::read_file(whole);
      for (const std::uint32_t step : {1U, 7U, 48U, 64U, 1000U, 5000U}) {
        if (step == 1 && height > 600) continue;
        fs::remove(divided);
        const std::unique_ptr<ImageRows> rows =
            save_image_rows({width, height, image.channels}, divided, options);
        for (std::uint32_t y = 0; y < height; y += step) {
          rows->put(rows_of(image, y, std::min(step, height - y)));
        }
        EXPECT_FALSE(fs::exists(divided)) << "not before it is whole";
        rows->commit();
        EXPECT_TRUE(test::read_file(divided) == expected)
            << extension << ' ' << width << " x " << height << " in steps of " << step;
      }
    }
  }
}

/// A band of wide rows has eight of them: files are whole where the last band has one row, or all.
TEST(ImageRows, TheLastRowsComeBack) {
  const fs::path path = test::scratch_folder() / "a.png";
  for (const std::uint32_t height : {1U, 7U, 8U, 9U, 15U, 16U, 17U, 65U}) {
    Image image{16384, height, 1, {}};
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < image.width; ++x)
        image.pixels.push_back(static_cast<float>((31 * y + x / 64) % 257) / 256);
    }
    const std::unique_ptr<ImageRows> rows =
        save_image_rows({image.width, height, 1}, path, {ImageFormat::png16});
    rows->put(image);
    rows->commit();
    const Image back = load_image(path);
    ASSERT_EQ(back.height, height);
    for (std::size_t i = 0; i < image.pixels.size(); i += 61) {
      ASSERT_NEAR(back.pixels[i * back.channels], image.pixels[i], 0.6 / 65535)
          << height << ' ' << i;
    }
  }
}

TEST(ImageRows, AFileWithoutCommitIsAbsent) {
  const fs::path folder = test::scratch_folder();
  const Image image = noise(300, 300, 3);
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::exr_half}) {
    const fs::path path = folder / ("left" + std::string(extension_of(format)));
    {
      const std::unique_ptr<ImageRows> rows = save_image_rows({300, 300, 3}, path, {format});
      rows->put(rows_of(image, 0, 200));
    }
    EXPECT_TRUE(fs::is_empty(folder));
  }
}

TEST(ImageRows, FewerRowsThanTheHeightAreNoFile) {
  const fs::path folder = test::scratch_folder();
  const Image image = noise(30, 30, 3);
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::exr_half}) {
    const fs::path path = folder / ("short" + std::string(extension_of(format)));
    const std::unique_ptr<ImageRows> rows = save_image_rows({30, 31, 3}, path, {format});
    rows->put(image);
    EXPECT_THROW(rows->commit(), Error);
    EXPECT_FALSE(fs::exists(path));
  }
}

TEST(ImageRows, OtherFormatsAndSizesAreRefused) {
  const fs::path folder = test::scratch_folder();
  EXPECT_FALSE(writes_rows(ImageFormat::tga));
  EXPECT_THROW(save_image_rows({3, 3, 3}, folder / "a.tga", {ImageFormat::tga}), Error);
  EXPECT_THROW(save_image_rows({3, 3, 3}, folder / "a.exr", {ImageFormat::png8}), Error);
  EXPECT_THROW(save_image_rows({0, 3, 3}, folder / "a.png", {ImageFormat::png8}), Error);
  EXPECT_THROW(save_image_rows({3, 3, 5}, folder / "a.png", {ImageFormat::png8}), Error);
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST(ImageRows, StoredErrorsDoNotDependOnTheDivision) {
  for (const TextureUse use : {TextureUse::values, TextureUse::normal}) {
    for (const bool dither : {false, true}) {
      const Image image = noise(70, 101, 3);
      SaveImageOptions options{ImageFormat::png8};
      options.use = use;
      options.dither = dither;
      std::vector<std::uint8_t> coverage;
      for (std::size_t i = 0; i < 70 * 101; ++i) coverage.push_back(i % 3 == 0 ? 0 : 1);
      const StoredError whole = stored_error(image, options, coverage);
      EXPECT_GT(whole.mean, 0);
      for (const std::uint32_t step : {1U, 3U, 10U, 64U}) {
        StoredErrorSums sums(101);
        for (std::uint32_t y = 0; y < 101; y += step) {
          const Image rows = rows_of(image, y, std::min(step, 101 - y));
          sums.add(rows, y, options, std::span(coverage).subspan(y * 70, rows.height * 70));
        }
        EXPECT_EQ(sums.error().mean, whole.mean) << step;
        EXPECT_EQ(sums.error().max, whole.max) << step;
      }
    }
  }
}

}  // namespace
}  // namespace kiln
