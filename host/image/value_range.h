// Bounds of the values in one channel of a picture, over any rectangle.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/image_data.h"
#include "kiln/texture.h"

namespace kiln {

/// One channel of a picture over UVs, with bilinear interpolation and with bounds of its values.
/// Non-finite values count as 0, missing channels as 1.
class BoundedChannel {
 public:
  using Wraps = std::array<TextureWrap, 2>;  ///< Wrap modes along u and v

  BoundedChannel(const Image& image, std::uint32_t channel);

  struct Range {
    float least = 0, most = 0;
  };

  double texels_across() const { return levels_[0].width; }
  double texels_down() const { return levels_[0].height; }
  /// The bilinearly interpolated value at a UV.
  /// \param u, v  must be finite
  double at(double u, double v, const Wraps& wraps = {}) const;
  /// Conservative bounds of at() over a rectangle of UVs.
  Range over(double u0, double v0, double u1, double v1, const Wraps& wraps = {}) const;

 private:
  struct Level {
    std::int64_t width = 0, height = 0;
    std::vector<Range> ranges;  // Range of each block of 2^level x 2^level texels
  };
  std::vector<Level> levels_;
};

}  // namespace kiln
