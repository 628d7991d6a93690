// Detects grey pictures.
#pragma once

#include <cmath>
#include <cstddef>

#include "kiln/image_data.h"

namespace kiln {

/// True if a picture is grey: it has one channel, with or without alpha, or its red, green and blue
/// are equal.
/// \param rounding  maximum difference between the three channels, to allow for lossy files; 0:
///   they must be exactly equal
inline bool is_grey(const Image& image, float rounding) {
  if (image.channels < 3) return true;
  const auto is_close = [&](float a, float b) { return a == b || std::abs(a - b) <= rounding; };
  for (std::size_t i = 0; i + 2 < image.pixels.size(); i += image.channels) {
    const float* const p = &image.pixels[i];
    if (!is_close(p[0], p[1]) || !is_close(p[0], p[2]) || !is_close(p[1], p[2])) return false;
  }
  return true;
}

/// Rounding error of JPEG and of block compression, for is_grey().
inline constexpr float kLossyRounding = 1.5F / 255;

}  // namespace kiln
