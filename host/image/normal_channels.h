// Detects the channels of x, y and z in a picture of normals.
#pragma once

#include <array>
#include <cstdint>

#include "kiln/image_data.h"
#include "kiln/texture.h"

namespace kiln {

struct NormalChannels {
  bool rebuilt = false;   ///< z is sqrt(1 - x^2 - y^2) instead of blue
  bool in_alpha = false;  ///< x is in alpha (DXT5nm)
  bool down = false;      ///< Green is -y
  bool doubtful = false;  ///< The picture contradicts the given format's channel for z

  /// Detects the channels, as NormalTextureFormat describes. The picture may have any number of channels.
  static NormalChannels of(const Image& image, NormalTextureFormat format);

  /// \throws Error(input) if the picture has too few channels
  void check(const Image& image) const;

  /// \param texel  [in, out] the picture's values in [-1, 1] on entry; x, y, z on return
  void apply(std::array<float, 4>& texel) const;
};

/// True if a picture has one channel or several equal ones: heights instead of normals. Two-channel normals, also in
/// green and alpha, are not heights.
bool holds_heights(const Image& image, NormalTextureFormat format);

/// Evidence of the direction of a normal map's green channel, from integrability of its slopes.
///
/// Normals of a height field h have the slopes p = dh/du = -x/z and q = dh/dv = -y/z, with dp/dv = dq/du. If y is
/// flipped, dp/dv = -dq/du. So one of the sums of (dp/dv - dq/du)^2 and (dp/dv + dq/du)^2 is 0, except for rounding,
/// seams and surfaces that are not height fields; the other sum is 4 (dp/dv)^2.
struct GreenEvidence {
  double up = 0, down = 0;  ///< Mean squared residuals if green points up, and if it points down

  static GreenEvidence of(const Image& image, const NormalChannels& channels);
  bool suggests_down() const;
};

}  // namespace kiln
