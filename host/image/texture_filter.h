// Means of a picture over small areas.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "kiln/image.h"
#include "kiln/texture.h"

namespace kiln {

/// A picture over UVs, with its mip chain: in linear light, or as vectors. For several threads at once.
///
/// A linear picture without NaN and infinities is read where it is; any other is copied. A level of the chain
/// is made when it is first read.
class FilteredTexture {
 public:
  using Wraps = std::array<TextureWrap, 2>;            ///< Along u and v
  using Sides = std::array<std::array<double, 2>, 2>;  ///< Two vectors, each u and v

  /// \throws Error(input) for a picture without pixels, or of normals with fewer than three channels
  FilteredTexture(std::shared_ptr<const Image> image, TextureKind kind);

  /// Memory that one takes beside its picture: 4/3 of the picture's floats, 1/3 where that is read in place.
  static std::uint64_t most_bytes(const Image& image, TextureKind kind) {
    const std::uint64_t bytes = image.pixels.size() * sizeof(float);
    return (kind == TextureKind::linear ? 0 : bytes) + bytes / 3;
  }

  std::uint32_t channels() const { return channels_; }
  /// Numbers of the picture that are not finite, and count as 0.
  std::uint64_t replaced() const { return replaced_; }

  /// The mean over a parallelogram of UV around (u, v), which must be finite.
  ///
  /// The level is one on which the parallelogram is 2 to 4 texels across where it is narrowest; on it, it
  /// is cut into parts of a texel's length at most, each read bilinearly. So along its length it is
  /// integrated however long it is, up to kMostParts parts; longer ones take coarser levels.
  /// \param value  channels() numbers; vectors are not made unit
  void mean(double u, double v, const Sides& given, float* value, const Wraps& wraps = {}) const;

  static constexpr std::uint32_t kMostParts = 4096;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    const float* pixels = nullptr;
    std::vector<float> own;  ///< Storage behind `pixels`; empty for a picture that is read in place
  };

  void convert(const Image& image, TextureKind kind);
  void fill_half(const Level& level, Level& next) const;
  const Level& level(std::size_t number) const;

  std::shared_ptr<const Image> image_;
  std::uint32_t channels_;
  std::uint64_t replaced_ = 0;
  mutable std::vector<Level> levels_;  ///< Sizes of all; pixels of those that were read
  mutable std::atomic<std::size_t> made_{1};
  mutable std::mutex making_;
};

}  // namespace kiln
