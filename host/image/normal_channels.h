// Detects which channels of a picture of normals hold x, y and z.
#pragma once

#include <array>
#include <cstdint>

#include "kiln/image_data.h"
#include "kiln/texture.h"

namespace kiln {

struct NormalChannels {
  bool computes_z =
      false;              ///< z is computed as sqrt(1 - x^2 - y^2) instead of being read from blue
  bool in_alpha = false;  ///< True if alpha holds x (DXT5nm)
  bool down = false;      ///< Green is -y
  bool contradicts_format = false;  ///< The picture contradicts the format that the caller gave

  /// Detects the channels, as described at NormalTextureFormat. The picture may have any number of
  /// channels.
  static NormalChannels of(const Image& image, NormalTextureFormat format);

  /// \throws Error(input) if the picture has too few channels
  void check(const Image& image) const;

  /// \param texel  [in, out] the picture's values in [-1, 1] on entry; x, y, z on return
  void apply(std::array<float, 4>& texel) const;
};

/// True if a picture holds heights instead of normals: it has one channel, or several equal ones.
/// Two-channel normals do not count as heights, even if they are stored in green and alpha.
bool holds_heights(const Image& image, NormalTextureFormat format);

/// Evidence whether green points up or down in a normal map: the slopes of a height field are
/// integrable.
///
/// The normals of a height field h have the slopes p = dh/du = -x/z and q = dh/dv = -y/z, so dp/dv
/// = dq/du. If y is flipped, dp/dv = -dq/du. So either the sum of (dp/dv - dq/du)^2 or that of
/// (dp/dv + dq/du)^2 is 0, except for rounding, seams and surfaces that are not height fields; the
/// other sum is that of 4 (dp/dv)^2.
struct GreenEvidence {
  /// Mean squared residuals, first if green points up, second if it points down
  double up = 0, down = 0;

  static GreenEvidence of(const Image& image, const NormalChannels& channels);
  bool suggests_down() const;
};

}  // namespace kiln
