// sRGB and linear light (IEC 61966-2-1).
#pragma once

#include <array>

namespace kiln {

/// \param value  0 to 1; beyond, the curve goes on
double from_srgb(double value);

/// Clamped to [0, 1]; NaN is 0. Within 2e-7 of the formula.
float to_srgb(float linear);

/// Linear values of the 256 values of a byte.
const std::array<float, 256>& linear_of_bytes();

}  // namespace kiln
