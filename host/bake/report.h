// What a bake says of itself: seconds, counts, warnings.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>

#include "cl/context.h"
#include "kiln/bake.h"
#include "texel/correspondence.h"

namespace kiln {

/// Most samples of a band of a bake: bounds the device's memory.
constexpr std::uint32_t kBandSamples = 1U << 20;

class Stopwatch {
 public:
  /// Seconds since the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Adds a band's correspondences to the report. Distances are added per block in a fixed order.
/// \param unit  world length of a frame unit
void count_samples(cl::Context& context, const Correspondence& match, double unit,
                   BakeReport& report, double& distance_sum);

/// Warns of texels whose normals point below the surface, where the third component, and its sign with it,
/// is left out: they were pulled up to the horizon.
/// \param image  unit vectors as they are, before encoding; coverage as of Layers
void warn_below_surface(std::string_view map, const Image& image,
                        std::span<const std::uint8_t> coverage, BakeReport& report);

/// Warns where there is nothing to bake to, or much was missed.
void warn_about_misses(BakeReport& report);

}  // namespace kiln
