// Bakes values that the caller gives for each vertex: averages them over the samples of each texel.
#include "kiln/attribute.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "base/parallel.h"
#include "image/gutter.h"
#include "kiln/validate.h"
#include "match/match_array.h"
#include "shared/match.h"
#include "source/high_poly.h"

namespace kiln {
namespace {

using ChannelValues = std::array<double, 4>;

static_assert(static_cast<int>(TexelState::empty) == kCoverageEmpty &&
              static_cast<int>(TexelState::baked) == kCoverageBaked &&
              static_cast<int>(TexelState::missed) == kCoverageMissed &&
              static_cast<int>(TexelState::padding) == kCoverageGutter);

void check_input(const Source::Impl& high, const Match& match, std::size_t values,
                 std::uint32_t channels) {
  if (channels < 1 || channels > 4) {
    throw Error(ErrorCode::usage,
                "channels is " + std::to_string(channels) + ": it must be 1 to 4.",
                "attribute-channels");
  }
  const std::size_t expected_count = high.positions.size() * channels;
  if (values != expected_count) {
    throw Error(ErrorCode::usage,
                std::to_string(values) + " values were given, but " +
                    std::to_string(expected_count) + " are needed: " + std::to_string(channels) +
                    " for each of the high poly's " + std::to_string(high.positions.size()) +
                    " vertices.",
                "attribute-size");
  }
  validate(match);
  check_source(match, high.triangles.size());
  if (match.source_hash != 0) {
    check_meshes(match, hash_source(high.positions, high.triangles), match.low_hash);
  }
}

/// Averages a texel's samples.
class TexelAverager {
 public:
  TexelAverager(const Source::Impl& high, const Match& match, std::span<const float> values,
                std::uint32_t channels, bool unit_vectors)
      : high_(high),
        match_(match),
        values_(values),
        channels_(channels),
        is_unit_vector_(unit_vectors && channels == 3) {}

  /// Averages the samples of one texel. \param to  receives the mean; left as it is if no sample found a point
  TexelState texel(std::size_t x, std::size_t y, float* to) const {
    ChannelValues sum{};
    std::uint32_t found_count = 0;
    bool is_covered = false;
    const std::size_t n = match_.samples;
    for (std::size_t s = 0; s < n * n; ++s) {
      const std::size_t i = (y * n + s / n) * match_.width + x * n + s % n;
      const SampleStatus status = match_.status_of(i);
      if (status == SampleStatus::empty) continue;
      is_covered = true;
      if (status == SampleStatus::missed) continue;
      add(i, sum);
      ++found_count;
    }
    if (found_count == 0) return is_covered ? TexelState::missed : TexelState::empty;
    store_mean(sum, found_count, to);
    return TexelState::baked;
  }

 private:
  void add(std::size_t i, ChannelValues& sum) const {
    const double u = match_.u[i], v = match_.v[i];
    const std::array<double, 3> weights = {1 - u - v, u, v};
    const Triangle& corners = high_.triangles[match_.triangle[i]];
    for (std::size_t k = 0; k < 3; ++k) {
      const float* corner_values = &values_[std::size_t{corners[k]} * channels_];
      for (std::uint32_t c = 0; c < channels_; ++c) sum[c] += weights[k] * double{corner_values[c]};
    }
  }

  void store_mean(const ChannelValues& sum, std::uint32_t found_count, float* to) const {
    double divisor = found_count;
    if (is_unit_vector_) {
      const double size = std::hypot(sum[0], sum[1], sum[2]);
      if (size > 0) divisor = size;
    }
    for (std::uint32_t c = 0; c < channels_; ++c) to[c] = static_cast<float>(sum[c] / divisor);
  }

  const Source::Impl& high_;
  const Match& match_;
  std::span<const float> values_;
  std::uint32_t channels_;
  bool is_unit_vector_;
};

}  // namespace

BakedAttribute bake_attribute(const Match& match, const Source& source,
                              std::span<const float> values, std::uint32_t channels,
                              const AttributeOptions& options) {
  const Source::Impl& high = impl_of(source);
  check_input(high, match, values.size(), channels);
  BakedAttribute result;
  result.image.width = match.width / match.samples;
  result.image.height = match.height / match.samples;
  result.image.channels = channels;
  const std::size_t width = result.image.width;
  result.coverage.resize(width * result.image.height);
  result.image.pixels.resize(result.coverage.size() * channels);
  const TexelAverager texel_averager(high, match, values, channels, options.unit_vectors);
  parallel_for(result.coverage.size(), 1 << 13, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      result.coverage[t] = static_cast<std::uint8_t>(
          texel_averager.texel(t % width, t / width, &result.image.pixels[t * channels]));
    }
  });
  fill_padding(
      high.device, result.image, result.coverage,
      {.texels = options.padding, .fill_missed = false, .unit_vectors = options.unit_vectors});
  return result;
}

std::uint64_t fill_padding(const Device& device, Image& image, std::span<std::uint8_t> coverage,
                           const PaddingOptions& options) {
  const std::size_t texels = std::size_t{image.width} * image.height;
  if (texels == 0 || image.channels < 1 || image.channels > 4 || coverage.size() != texels ||
      image.pixels.size() != texels * image.channels) {
    throw Error(ErrorCode::usage,
                "An image of " + std::to_string(image.width) + " x " +
                    std::to_string(image.height) + " with " + std::to_string(image.channels) +
                    " channels, " + std::to_string(image.pixels.size()) + " values and " +
                    std::to_string(coverage.size()) +
                    " texels of coverage was given: it needs 1 to 4 channels, width x height x "
                    "channels values and width x height texels of coverage.",
                "padding-size");
  }
  if (options.texels < -1 || options.texels > 16384) {
    throw Error(ErrorCode::usage,
                "PaddingOptions::texels is " + std::to_string(options.texels) +
                    ": it must be 0 to 16384, or -1 for everywhere.",
                "padding-range");
  }
  std::vector<std::uint8_t> texel_states(coverage.begin(), coverage.end());
  const std::uint64_t filled_texels =
      fill_gutter(context_of(device), image, texel_states,
                  {options.texels, options.fill_missed, options.unit_vectors});
  std::copy(texel_states.begin(), texel_states.end(), coverage.begin());
  return filled_texels;
}

}  // namespace kiln
