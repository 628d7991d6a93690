// What a bake says of itself: seconds, counts, warnings.
#pragma once

#include <chrono>
#include <cstdint>

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

/// Warns where there is nothing to bake to, or much was missed.
void warn_about_misses(BakeReport& report);

}  // namespace kiln
