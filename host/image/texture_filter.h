// Means of a picture over small areas.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "image/normal_channels.h"
#include "image/texel_bits.h"
#include "kiln/image.h"
#include "kiln/texture.h"

namespace kiln {

/// How a picture's numbers are read.
struct TextureReading {
  NormalChannels normals = {};  ///< Of a picture of normals
  /// Colours are weighted by alpha, where there is one: those of transparent texels do not show.
  bool by_alpha = false;
  /// Texels that hold nothing, as TexelBits; null: none. They show where nothing else does.
  const TexelBits* empty = nullptr;
};

/// A picture over UVs, with its mip chain: in linear light, or as vectors. For several threads at once.
///
/// A linear picture without NaN and infinities is read where it is; any other is copied. A level of the chain
/// is made when it is first read.
///
/// Weights are a channel more: texels hold value * weight and weight, both are averaged, and one is divided by the other.
/// The weight is alpha, times kLeastWeight for texels that hold nothing, and kLeastWeight at least, so that a mean over
/// texels without weight is the plain one.
class FilteredTexture {
 public:
  using Wraps = std::array<TextureWrap, 2>;            ///< Along u and v
  using Sides = std::array<std::array<double, 2>, 2>;  ///< Two vectors, each u and v

  /// \throws Error(input) for a picture without pixels, or of normals with fewer than three channels
  FilteredTexture(std::shared_ptr<const Image> image, TextureKind kind,
                  const TextureReading& reading = {});

  /// Memory that one takes beside its picture, at most: 4/3 of the picture's floats, 1/3 where that is read in place; and a
  /// channel more where it has weights.
  static std::uint64_t most_bytes(const Image& image, TextureKind kind,
                                  const TextureReading& reading = {}) {
    const std::uint64_t bytes = image.pixels.size() * sizeof(float);
    if (reading.empty != nullptr || reading.by_alpha) {
      return (bytes + bytes / image.channels) / 3 * 4;
    }
    return (kind == TextureKind::linear ? 0 : bytes) + bytes / 3;
  }

  /// Channels of mean(): the picture's, but three of normals in two channels.
  std::uint32_t channels() const { return channels_; }
  /// True if texels have weights that are not all 1.
  bool is_weighted() const { return weighted_; }
  /// Numbers of the picture that are not finite, and count as 0.
  std::uint64_t replaced() const { return replaced_; }

  /// The mean over a parallelogram of UV around (u, v), which must be finite.
  ///
  /// The level is one on which the parallelogram is 2 to 4 texels across where it is narrowest; on it, it
  /// is cut into parts of a texel's length at most, each read bilinearly. So along its length it is
  /// integrated however long it is, up to kMostParts parts; longer ones take coarser levels.
  /// \param value  channels() numbers; vectors are not made unit. Where there are weights, alpha is their mean.
  void mean(double u, double v, const Sides& given, float* value, const Wraps& wraps = {}) const;

  static constexpr std::uint32_t kMostParts = 4096;
  static constexpr float kLeastWeight = 0x1p-20F;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    const float* pixels = nullptr;
    std::vector<float> own;  ///< Storage behind `pixels`; empty for a picture that is read in place
  };

  void convert(const Image& image, TextureKind kind, const TextureReading& reading);
  void fill_half(const Level& level, Level& next) const;
  const Level& level(std::size_t number) const;

  std::shared_ptr<const Image> image_;
  std::uint32_t channels_;
  std::uint32_t stored_ = 0;  ///< Numbers of a texel
  bool weighted_ = false;     ///< The last of them is a weight
  std::uint64_t replaced_ = 0;
  mutable std::vector<Level> levels_;  ///< Sizes of all; pixels of those that were read
  mutable std::atomic<std::size_t> made_{1};
  mutable std::mutex making_;
};

}  // namespace kiln
