// Conversions between sRGB and linear light (IEC 61966-2-1).
#pragma once

#include <array>

namespace kiln {

/// \param value  0 to 1; the curve is extrapolated beyond
double from_srgb(double value);

/// Inverse of from_srgb(), also for values outside of [0, 1].
double encode_srgb(double linear);

/// The result is clamped to [0, 1]; NaN becomes 0. The error is at most 2e-7.
float to_srgb(float linear);

/// Linear values of the 256 sRGB bytes.
const std::array<float, 256>& linear_values_of_bytes();

}  // namespace kiln
