#include "base/srgb.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "kiln/image.h"

namespace kiln {

double encode_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

namespace {

constexpr std::size_t kTableSteps = 4096;
constexpr std::size_t kGrain = std::size_t{1} << 16;

/// Samples of the sRGB curve at arguments whose fourth roots are evenly spaced. Between the samples the curve is nearly
/// linear.
const std::vector<float>& srgb_curve_samples() {
  static const std::vector<float> values = [] {
    std::vector<float> list(kTableSteps + 2);
    for (std::size_t i = 0; i < list.size(); ++i) {
      const double root = static_cast<double>(i) / kTableSteps;
      list[i] = static_cast<float>(encode_srgb(root * root * root * root));
    }
    return list;
  }();
  return values;
}

float interpolate_curve(const float* values, float linear) {
  if (!(linear > 0)) return 0;
  // The linear segment of the curve; the fourth root is too steep there.
  if (linear <= 0.0031308F) return 12.92F * linear;
  const float place =
      std::sqrt(std::sqrt(std::min(linear, 1.0F))) * static_cast<float>(kTableSteps);
  const auto step = static_cast<std::size_t>(place);
  const float share = place - static_cast<float>(step);
  return std::min(values[step] + (values[step + 1] - values[step]) * share, 1.0F);
}

}  // namespace

double from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

float to_srgb(float linear) { return interpolate_curve(srgb_curve_samples().data(), linear); }

const std::array<float, 256>& linear_values_of_bytes() {
  static const std::array<float, 256> values = [] {
    std::array<float, 256> list{};
    for (std::size_t i = 0; i < list.size(); ++i) {
      list[i] = static_cast<float>(from_srgb(static_cast<double>(i) / 255));
    }
    return list;
  }();
  return values;
}

void to_srgb(Image& image) {
  const float* values = srgb_curve_samples().data();
  const std::size_t channels = image.channels, colors = std::min<std::size_t>(channels, 3);
  if (channels == 0) return;
  parallel_for(image.pixels.size() / channels, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t c = 0; c < colors; ++c) {
        float& value = image.pixels[i * channels + c];
        value = interpolate_curve(values, value);
      }
    }
  });
}

}  // namespace kiln
