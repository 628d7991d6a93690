// Large PNGs, whose pixels kiln deflates itself: libpng reads back what was written.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWidth = 2048,
                        kHeight = 1025;  // above the size that zlib takes, a row more

/// An image whose rows differ by `step` from those above, as the file's filter has it.
Image image_of(const std::function<std::uint8_t(std::size_t)>& step) {
  Image image{kWidth, kHeight, 1, {}};
  image.pixels.resize(std::size_t{kWidth} * kHeight);
  std::vector<std::uint8_t> above(kWidth);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    above[i % kWidth] = static_cast<std::uint8_t>(above[i % kWidth] + step(i));
    image.pixels[i] = static_cast<float>(above[i % kWidth]) / 255.0F;
  }
  return image;
}

void expect_kept(const Image& image, const char* what) {
  const fs::path path = test::scratch_folder() / "large.png";
  save_image(image, path, {.format = ImageFormat::png8});
  const Image back = load_image(path);
  ASSERT_EQ(back.pixels.size(), image.pixels.size()) << what;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < back.pixels.size(); ++i) wrong += back.pixels[i] != image.pixels[i];
  EXPECT_EQ(wrong, 0U) << what;
}

std::uint32_t hashed(std::size_t i) {
  return static_cast<std::uint32_t>((i * 0x9E3779B97F4A7C15U) >> 40);
}

TEST(RunDeflate, RunsAndNoiseComeBack) {
  expect_kept(image_of([](std::size_t) { return 0; }), "empty");
  expect_kept(image_of([](std::size_t i) { return hashed(i); }), "noise");
  // Runs of all lengths from 1 to 700: below, at and beyond the longest.
  expect_kept(
      image_of([](std::size_t i) { return i % 351 < (i / 700) % 351 ? 7 : hashed(i) & 3U; }),
      "runs");
}

// Counts like Fibonacci's numbers make codes of more than 15 bits, which deflate has not.
TEST(RunDeflate, RareBytesGetCodesOfFifteenBitsAtMost) {
  expect_kept(image_of([](std::size_t i) -> std::uint8_t {
                std::size_t place = i % 65000 / 2, size = 1, before = 1;
                for (std::uint8_t value = 0;; ++value) {
                  if (place < size) return static_cast<std::uint8_t>(value + (i % 2) * 100);
                  place -= size;
                  const std::size_t next = size + before;
                  before = size;
                  size = next;
                }
              }),
              "Fibonacci");
}

}  // namespace
}  // namespace kiln
