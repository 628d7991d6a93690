// Computes means of a picture over small areas.
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
  NormalChannels normals = {};  ///< Which channels hold x, y and z in pictures of normals
  /// True if colours are weighted by alpha, if the picture has it, so that transparent texels do
  /// not contribute.
  bool by_alpha = false;
  /// The background texels, which only contribute where no other texel does; null if there are
  /// none.
  const TexelBits* empty = nullptr;
};

/// A picture over UVs with its mip chain. Colours are in linear light; normals are vectors.
/// Thread-safe.
///
/// A linear picture without NaN and infinities is read in place; all others are copied. Each level
/// of the chain is computed when it is first used.
///
/// If texels have weights, these are stored in an additional channel: a texel holds value * weight,
/// and weight. Both are averaged, then the first is divided by the second. The weight is alpha, but
/// at least kMinWeight, and is multiplied by kMinWeight for background texels. So the mean over an
/// area without any opaque texel is the unweighted mean.
class FilteredTexture {
 public:
  using Wraps = std::array<TextureWrap, 2>;  ///< Wrap modes along u and v
  /// Two vectors with components u and v
  using ParallelogramSides = std::array<std::array<double, 2>, 2>;

  /// \throws Error(input) for a picture without pixels, or of normals with fewer than three channels
  FilteredTexture(std::shared_ptr<const Image> image, TextureKind kind,
                  const TextureReading& reading = {});

  /// Upper bound of the memory in addition to the picture's, in bytes: 4/3 of the picture as
  /// floats, or 1/3 if it is read in place; more by one channel if there are weights.
  static std::uint64_t most_bytes(const Image& image, TextureKind kind,
                                  const TextureReading& reading = {}) {
    const std::uint64_t bytes = image.pixels.size() * sizeof(float);
    if (reading.empty != nullptr || reading.by_alpha) {
      return (bytes + bytes / image.channels) / 3 * 4;
    }
    return (kind == TextureKind::linear ? 0 : bytes) + bytes / 3;
  }

  /// Number of channels of mean(): that of the picture, or three for normals stored in two
  /// channels.
  std::uint32_t channels() const { return channels_; }
  /// True if texels have weights, which may differ from 1.
  bool is_weighted() const { return has_weight_channel_; }
  /// Number of non-finite values, which were replaced by 0.
  std::uint64_t replaced_values() const { return replaced_count_; }

  /// The mean over a parallelogram in UV space around (u, v), which must be finite.
  ///
  /// The level is chosen such that the narrow side of the parallelogram is 2 to 4 texels wide. The
  /// parallelogram is divided into parts at most one texel long, and one bilinear sample is taken
  /// in each. So an anisotropic footprint is integrated along its whole length. If it would need
  /// more than kMaxParts parts, a coarser level is used.
  /// \param value  [out] channels() numbers; vectors are not normalized. If texels have weights,
  ///   alpha is the mean weight.
  void mean(double u, double v, const ParallelogramSides& given, float* value,
            const Wraps& wraps = {}) const;

  static constexpr std::uint32_t kMaxParts = 4096;
  static constexpr float kMinWeight = 0x1p-20F;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    const float* pixels = nullptr;
    std::vector<float> memory;  ///< Memory of `pixels`; empty if the picture is read in place
  };

  void convert(const Image& image, TextureKind kind, const TextureReading& reading);
  void downsample(const Level& level, Level& next) const;
  const Level& level(std::size_t number) const;

  std::shared_ptr<const Image> image_;
  std::uint32_t channels_;
  std::uint32_t stored_channels_ = 0;  ///< Number of channels of a stored texel
  bool has_weight_channel_ = false;    ///< True if the last stored channel holds the weight
  std::uint64_t replaced_count_ = 0;
  mutable std::vector<Level> levels_;  ///< All levels; those that are not in use yet have no pixels
  mutable std::atomic<std::size_t> built_levels_{1};
  mutable std::mutex levels_mutex_;
};

}  // namespace kiln
