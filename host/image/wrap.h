// Texture coordinates beyond a picture's border, by TextureWrap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kiln/texture.h"

namespace kiln {

/// The texel in [0, size) that is shown at a position on the row, which continues infinitely by the
/// wrap mode.
inline std::int64_t wrapped_texel(std::int64_t place, std::int64_t size, TextureWrap wrap) {
  if (place >= 0 && place < size) return place;  // The common case needs no division
  if (wrap == TextureWrap::clamp) return place < 0 ? 0 : size - 1;
  const std::int64_t period = wrap == TextureWrap::mirror ? 2 * size : size;
  std::int64_t rest = place % period;
  if (rest < 0) rest += period;
  return rest < size ? rest : period - 1 - rest;
}

/// A coordinate that shows the same texel, but is small enough for texel indices.
/// \param fraction  function that returns the fractional part of a number
template <typename Fraction>
double wrapped_coordinate(double value, TextureWrap wrap, const Fraction& fraction) {
  constexpr double kMaxCoordinate = 1e7;  // Greater than the size of any footprint
  switch (wrap) {
    case TextureWrap::repeat:
      break;
    case TextureWrap::clamp:
      return std::clamp(value, -kMaxCoordinate, kMaxCoordinate);
    case TextureWrap::mirror:
      return 2 * fraction(value / 2);
  }
  return fraction(value);
}

}  // namespace kiln
