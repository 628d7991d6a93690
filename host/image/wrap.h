// Places beyond a picture's border, as TextureWrap has them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kiln/texture.h"

namespace kiln {

/// The texel of a row of `size` that a place on the row without end shows.
inline std::int64_t wrapped_texel(std::int64_t place, std::int64_t size, TextureWrap wrap) {
  if (place >= 0 && place < size)
    return place;  // nearly always, and a division takes as long as all else
  if (wrap == TextureWrap::clamp) return place < 0 ? 0 : size - 1;
  const std::int64_t period = wrap == TextureWrap::mirror ? 2 * size : size;
  std::int64_t rest = place % period;
  if (rest < 0) rest += period;
  return rest < size ? rest : period - 1 - rest;
}

/// A coordinate that shows the same and is small enough to be one of texels.
/// \param fraction  the fraction of a number
template <typename Fraction>
double wrapped_coordinate(double value, TextureWrap wrap, const Fraction& fraction) {
  constexpr double kFar = 1e7;  // no footprint is as wide
  switch (wrap) {
    case TextureWrap::repeat:
      break;
    case TextureWrap::clamp:
      return std::clamp(value, -kFar, kFar);
    case TextureWrap::mirror:
      return 2 * fraction(value / 2);
  }
  return fraction(value);
}

}  // namespace kiln
