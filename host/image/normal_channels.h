// Which channels of a picture of normals are x, y and z.
#pragma once

#include <array>
#include <cstdint>

#include "kiln/image.h"
#include "kiln/texture.h"

namespace kiln {

struct NormalChannels {
  bool rebuilt = false;   ///< z = sqrt(1 - x^2 - y^2) instead of blue
  bool in_alpha = false;  ///< x is in alpha (DXT5nm)
  bool down = false;      ///< Green is -y
  bool doubtful =
      false;  ///< The picture looks as if z were elsewhere than the format that was given says

  /// By the picture, as NormalTextureFormat says. A picture of any number of channels.
  static NormalChannels of(const Image& image, NormalTextureFormat format);

  /// \throws Error(input) where the picture has too few channels
  void check(const Image& image) const;

  /// \param texel  the picture's numbers as [-1, 1]; out: x, y, z
  void apply(std::array<float, 4>& texel) const;
};

/// True if a picture has one channel, or several that say the same: heights, and no normals. x and y in two channels, and
/// in green and alpha, are no heights.
bool holds_heights(const Image& image, NormalTextureFormat format);

/// Evidence of the direction of a normal map's green: whether its slopes are those of a surface.
///
/// Normals of a height field h have the slopes p = dh/du = -x/z, q = dh/dv = -y/z, and dp/dv = dq/du. With y turned
/// over dp/dv = -dq/du. So of the sums of (dp/dv - dq/du)^2 and (dp/dv + dq/du)^2 the one is 0, but for rounding, seams
/// and what is no height field, and the other is 4 (dp/dv)^2.
struct GreenEvidence {
  double up = 0, down = 0;  ///< Mean squares that are left if green points up, and down

  static GreenEvidence of(const Image& image, const NormalChannels& channels);
  bool speaks_for_down() const;
};

}  // namespace kiln
