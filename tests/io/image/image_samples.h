// Images of noise for tests of their files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>

#include "kiln/image_data.h"
#include "kiln/image_format.h"

namespace kiln::test {

inline Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels,
                   unsigned seed) {
  Image image{width, height, channels, {}};
  image.pixels.resize(std::size_t{width} * height * channels);
  std::mt19937 random(seed);
  for (float& value : image.pixels) value = static_cast<float>(random()) / 4294967296.0F;
  return image;
}

inline constexpr std::array kFormats = {ImageFormat::exr_half, ImageFormat::exr_float,
                                        ImageFormat::png16, ImageFormat::png8};

}  // namespace kiln::test
