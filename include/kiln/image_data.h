/// \file
/// Images in memory. image.h reads, writes, converts and compares them. This header is separate, so
/// that code which only holds images is not recompiled when formats or functions change.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A float image, rows from the top (row 0 is at v = 1), channels interleaved.
struct Image {
  std::uint32_t width = 0;         ///< Texels
  std::uint32_t height = 0;        ///< Texels
  std::uint32_t channels = 0;      ///< 1 to 4
  std::vector<float> pixels = {};  ///< width * height * channels

  /// The channels of a texel; column x and row y must be inside.
  float* at(std::size_t x, std::size_t y) { return &pixels[(y * width + x) * channels]; }
  /// The channels of a texel; column x and row y must be inside.
  const float* at(std::size_t x, std::size_t y) const {
    return &pixels[(y * width + x) * channels];
  }
};

/// Quantisation error of stored values against the image: of each texel's worst channel in steps of 1/255;
/// for normals in degrees.
struct StoredError {
  double mean = 0;  ///< Mean error over the counted texels
  double max = 0;   ///< Maximum error over the counted texels
};

}  // namespace kiln
