// Means of a picture over small areas.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/image.h"
#include "kiln/texture.h"

namespace kiln {

/// A picture over UVs, with its mip chain: in linear light, or as vectors. Immutable: for several threads at
/// once. 4/3 of the picture's floats of memory.
class FilteredTexture {
 public:
  using Sides = std::array<std::array<double, 2>, 2>;  ///< Two vectors, each u and v

  /// \throws Error(input) for a picture without pixels, or of normals with fewer than three channels
  FilteredTexture(const Image& image, TextureKind kind);

  std::uint32_t channels() const { return channels_; }
  /// Numbers of the picture that are not finite, and count as 0.
  std::uint64_t replaced() const { return replaced_; }

  /// The mean over a parallelogram of UV around (u, v), which must be finite. The picture repeats.
  ///
  /// The level is one on which the parallelogram is 2 to 4 texels across where it is narrowest; on it, it
  /// is cut into parts of a texel's length at most, each read bilinearly. So along its length it is
  /// integrated however long it is, up to kMostParts parts; longer ones take coarser levels.
  /// \param value  channels() numbers; vectors are not made unit
  void mean(double u, double v, const Sides& given, float* value) const;

  static constexpr std::uint32_t kMostParts = 4096;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    std::vector<float> pixels;
  };

  Level half(const Level& level) const;
  void add(const Level& level, double x, double y, double* sum) const;

  std::uint32_t channels_;
  std::uint64_t replaced_ = 0;
  std::vector<Level> levels_;
};

}  // namespace kiln
