// The steps of a bake around the match, which a session takes again and again.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

#include "cl/context.h"
#include "image/mips.h"
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

/// From a unit vector to what files hold. \param coverage  of the texel
void encode_texel(const BakeOptions& options, std::uint8_t coverage, float* pixel);

/// 1 where a texel was baked.
Image mask_image(const BakeOptions& options, const std::vector<std::uint8_t>& coverage);

/// Background, gutter and encoding. \returns how many texels became gutter
std::uint64_t finish_image(cl::Context& context, const BakeOptions& options, std::int32_t gutter,
                           Image& image, std::vector<std::uint8_t>& coverage);

/// The levels below a map of unit vectors that has neither gutter nor encoding yet.
std::vector<Image> finished_mips(cl::Context& context, const BakeOptions& options,
                                 const Image& image, const std::vector<std::uint8_t>& coverage,
                                 const ChartMap& charts);

}  // namespace kiln
