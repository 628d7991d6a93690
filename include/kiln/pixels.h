#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "kiln/export.h"
#include "kiln/image.h"

namespace KILN_PUBLIC kiln {

/// How a pixel lies in memory: channels in this order, numbers in the machine's byte order.
enum class PixelFormat {
  rgba8,         ///< 4 bytes, [0, 1] to 0 to 255: VK_FORMAT_R8G8B8A8_UNORM, GL_RGBA8
  bgra8,         ///< 4 bytes, blue first: VK_FORMAT_B8G8R8A8_UNORM
  rgba16,        ///< 8 bytes, [0, 1] to 0 to 65535: VK_FORMAT_R16G16B16A16_UNORM, GL_RGBA16
  rgba16_float,  ///< 8 bytes, as they are, to nearest even: VK_FORMAT_R16G16B16A16_SFLOAT, GL_RGBA16F
  rgba32_float,  ///< 16 bytes, as they are: VK_FORMAT_R32G32B32A32_SFLOAT, GL_RGBA32F
};

/// Bytes of a pixel.
constexpr std::size_t pixel_bytes(PixelFormat format) {
  return format == PixelFormat::rgba32_float                                    ? 16
         : format == PixelFormat::rgba16 || format == PixelFormat::rgba16_float ? 8
                                                                                : 4;
}

/// How convert() fills what an image does not say.
struct ConvertOptions {
  /// BakeResult::coverage, or empty. Alpha is then 1 where a texel is baked, else 0: padding, missed and
  /// empty texels. Without it alpha is the image's fourth channel, or 1.
  std::span<const std::uint8_t> coverage = {};
  /// Bytes from one row to the next; 0: rows lie side by side.
  std::size_t row_bytes = 0;
  bool bottom_up = false;  ///< The first row is the lowest (OpenGL); default the uppermost
};

/// Writes an image into the caller's memory, a texture's staging buffer say. Integers: clamped to [0, 1] (NaN
/// becomes 0), rounded to nearest, ties to even: the numbers that save_image() writes as PNG. One channel
/// becomes grey; of two, blue is 0. Nothing is kept. Thread safety: may be called from several threads, for
/// memory that does not overlap.
/// \param pixels  at least height rows of row_bytes, the last one without what follows its pixels
/// \throws Error(usage): `pixel-size` for too little memory, rows that are too short or a coverage
///         of another size; `pixel-format`; `image-size` for an image that does not hold together
void convert(const Image& image, PixelFormat format, std::span<std::byte> pixels,
             const ConvertOptions& options = {});

}  // namespace kiln
