// Filters pictures over small areas.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "image/normal_channels.h"
#include "image/texel_bits.h"
#include "kiln/image_data.h"
#include "kiln/texture.h"

namespace kiln {

/// How a picture's values are interpreted.
struct TextureReading {
  NormalChannels normals = {};  ///< Channels of x, y and z in pictures of normals
  /// Colours are weighted by alpha, if present, so that transparent texels do not contribute.
  bool by_alpha = false;
  /// Background texels, which contribute only where no other texel does; null if there are none.
  const TexelBits* empty = nullptr;
};

/// A picture over UVs with its mip chain: in linear light, or as vectors. Thread-safe.
///
/// A linear picture without NaN and infinities is read in place; all others are copied. Each level of the chain is
/// computed at its first use.
///
/// Weights are stored in an additional channel: texels hold value * weight, and weight; both are averaged, then
/// divided. The weight is alpha, times kMinWeight for background texels, and at least kMinWeight, so that the mean
/// over texels without weight is the unweighted one.
class FilteredTexture {
 public:
  using Wraps = std::array<TextureWrap, 2>;                         ///< Wrap modes along u and v
  using ParallelogramSides = std::array<std::array<double, 2>, 2>;  ///< Two vectors, each u and v

  /// \throws Error(input) for a picture without pixels, or of normals with fewer than three channels
  FilteredTexture(std::shared_ptr<const Image> image, TextureKind kind,
                  const TextureReading& reading = {});

  /// Largest memory in addition to the picture's: 4/3 of the picture's floats, or 1/3 if it is read in place; with
  /// one more channel if there are weights.
  static std::uint64_t most_bytes(const Image& image, TextureKind kind,
                                  const TextureReading& reading = {}) {
    const std::uint64_t bytes = image.pixels.size() * sizeof(float);
    if (reading.empty != nullptr || reading.by_alpha) {
      return (bytes + bytes / image.channels) / 3 * 4;
    }
    return (kind == TextureKind::linear ? 0 : bytes) + bytes / 3;
  }

  /// Number of channels of mean(): the picture's, but three for normals stored in two channels.
  std::uint32_t channels() const { return channels_; }
  /// True if weights may differ from 1.
  bool is_weighted() const { return has_weight_channel_; }
  /// Number of values that are not finite and were replaced by 0.
  std::uint64_t replaced() const { return replaced_count_; }

  /// The mean over a parallelogram of UV around (u, v), which must be finite.
  ///
  /// The level is chosen such that the parallelogram's narrow side is 2 to 4 texels wide. It is divided into parts of
  /// at most a texel's length, each sampled bilinearly. So anisotropic footprints are integrated along their whole
  /// length, up to kMaxParts parts; longer ones use coarser levels.
  /// \param value  channels() numbers; vectors are not normalized. With weights, alpha is their mean.
  void mean(double u, double v, const ParallelogramSides& given, float* value,
            const Wraps& wraps = {}) const;

  static constexpr std::uint32_t kMaxParts = 4096;
  static constexpr float kMinWeight = 0x1p-20F;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    const float* pixels = nullptr;
    std::vector<float> own;  ///< Memory of `pixels`; empty if the picture is read in place
  };

  void convert(const Image& image, TextureKind kind, const TextureReading& reading);
  void fill_half(const Level& level, Level& next) const;
  const Level& level(std::size_t number) const;

  std::shared_ptr<const Image> image_;
  std::uint32_t channels_;
  std::uint32_t stored_channels_ = 0;  ///< Channels of a stored texel
  bool has_weight_channel_ = false;    ///< True if the last stored channel is a weight
  std::uint64_t replaced_count_ = 0;
  mutable std::vector<Level> levels_;  ///< Sizes of all levels; pixels of those in use
  mutable std::atomic<std::size_t> built_levels_{1};
  mutable std::mutex levels_mutex_;
};

}  // namespace kiln
