#include "base/normal_angle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace kiln {
namespace {

constexpr double kDegreesPerRadian = 57.295779513082320876798154814105;

using Vector = std::array<double, 3>;

Vector decode(const float* texel) {
  Vector n{};
  for (std::size_t i = 0; i < 3; ++i) n[i] = 2.0 * static_cast<double>(texel[i]) - 1.0;
  return n;
}

// True for a zero vector or its rounding error: with 8 bits, 0 is stored as 128/255, which decodes to 0.0039 per
// channel.
bool is_zero(const Vector& n) { return n[0] * n[0] + n[1] * n[1] + n[2] * n[2] < 1e-4; }
bool is_finite(const Vector& n) {
  return std::isfinite(n[0]) && std::isfinite(n[1]) && std::isfinite(n[2]);
}

}  // namespace

double normal_angle_degrees(const float* texel_a, const float* texel_b) {
  const Vector a = decode(texel_a);
  const Vector b = decode(texel_b);
  if (a == b) return 0.0;
  if (!is_finite(a) || !is_finite(b)) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (a[i] != b[i] && !(std::isnan(a[i]) && std::isnan(b[i]))) return 180.0;
    }
    return 0.0;
  }
  if (is_zero(a) && is_zero(b)) return 0.0;
  if (is_zero(a) || is_zero(b)) return 180.0;
  const double x = a[1] * b[2] - a[2] * b[1];
  const double y = a[2] * b[0] - a[0] * b[2];
  const double z = a[0] * b[1] - a[1] * b[0];
  const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return std::atan2(std::sqrt(x * x + y * y + z * z), dot) * kDegreesPerRadian;
}

double percentile(std::vector<double>& values, std::uint64_t hundredths) {
  const std::uint64_t rank = (values.size() * hundredths + 99) / 100;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace kiln
