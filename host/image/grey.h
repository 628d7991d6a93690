// Pictures whose colours are numbers.
#pragma once

#include <cmath>
#include <cstddef>

#include "kiln/image.h"

namespace kiln {

/// True if a picture has one number a pixel: one channel, with an alpha or without, or red, green and blue that are alike.
/// \param rounding  difference of two of them that is none, such as that of lossy files; 0: they are equal
inline bool is_grey(const Image& image, float rounding) {
  if (image.channels < 3) return true;
  const auto alike = [&](float a, float b) { return a == b || std::abs(a - b) <= rounding; };
  for (std::size_t i = 0; i + 2 < image.pixels.size(); i += image.channels) {
    const float* const p = &image.pixels[i];
    if (!alike(p[0], p[1]) || !alike(p[0], p[2]) || !alike(p[1], p[2])) return false;
  }
  return true;
}

/// Rounding of JPEG and of block compression.
inline constexpr float kLossyRounding = 1.5F / 255;

}  // namespace kiln
