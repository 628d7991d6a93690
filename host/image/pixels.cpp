#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "base/parallel.h"
#include "kiln/image.h"
#include "kiln/map.h"

namespace kiln {
namespace {

[[noreturn]] void fail(const std::string& message, const char* id) {
  throw Error(ErrorCode::usage, message, id);
}

std::size_t checked_row_bytes(const Image& image, PixelFormat format, std::size_t bytes,
                              const ConvertOptions& options) {
  if (format < PixelFormat::rgba8 || format > PixelFormat::rgba32_float) {
    fail("format is not a PixelFormat: use one of its enumerators.", "pixel-format");
  }
  const std::size_t texels = std::size_t{image.width} * image.height;
  if (texels == 0 || image.channels < 1 || image.channels > 4 ||
      image.pixels.size() != texels * image.channels) {
    fail("An image of " + std::to_string(image.width) + " x " + std::to_string(image.height) +
             " with " + std::to_string(image.channels) + " channels cannot have " +
             std::to_string(image.pixels.size()) + " values.",
         "image-size");
  }
  if (!options.coverage.empty() && options.coverage.size() != texels) {
    fail("The coverage has " + std::to_string(options.coverage.size()) +
             " texels, but the image has " + std::to_string(texels) + ".",
         "pixel-size");
  }
  const std::size_t row = image.width * pixel_bytes(format);
  const std::size_t row_bytes = options.row_bytes != 0 ? options.row_bytes : row;
  const std::size_t needed = row_bytes * (image.height - std::size_t{1}) + row;
  if (row_bytes < row || bytes < needed) {
    fail("The row pitch is " + std::to_string(row_bytes) + " bytes and the buffer has " +
             std::to_string(bytes) + " bytes: at least " + std::to_string(row) + " and " +
             std::to_string(needed) + " are needed.",
         "pixel-size");
  }
  return row_bytes;
}

using Rgba = std::array<float, 4>;

Rgba rgba_of(const Image& image, std::size_t texel, const ConvertOptions& options) {
  const float* from = &image.pixels[texel * image.channels];
  Rgba rgba{from[0], from[0], from[0], 1};
  if (image.channels >= 2) rgba = {from[0], from[1], 0, 1};
  if (image.channels >= 3) rgba[2] = from[2];
  if (image.channels == 4) rgba[3] = from[3];
  if (!options.coverage.empty()) {
    rgba[3] = options.coverage[texel] == static_cast<std::uint8_t>(TexelState::baked) ? 1.0F : 0.0F;
  }
  return rgba;
}

/// Rounds a value in [0, 1] to an integer sample of a PNG.
double to_integer_sample(float value, double most) {
  const double unit = value >= 0 ? std::min(1.0, double{value}) : 0.0;  // NaN becomes 0
  return std::nearbyint(unit * most);
}

/// Converts a number to IEEE 754 binary16: rounds to nearest, ties to even; numbers too large for
/// it become infinite.
std::uint16_t half_of(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = bits >> 16 & 0x8000U;
  const std::uint32_t size = bits & 0x7FFFFFFFU;
  std::uint32_t half = 0;
  if (size > 0x7F800000U) {
    half = 0x7E00U;  // NaN remains NaN
  } else if (size >= 0x477FF000U) {
    half = 0x7C00U;  // 65520 and above round to infinity
  } else if (size >= 0x38800000U) {
    // Normal numbers: the exponent's bias decreases by 112, and the mantissa loses 13 bits.
    half = (size - 0x38000000U + 0xFFFU + (size >> 13 & 1U)) >> 13;
  } else {
    // Subnormal numbers of binary16, below 2^-14, are multiples of 2^-24. Adding 0.5 rounds to such
    // a multiple, since it is the last bit of single precision there.
    const float shifted = std::bit_cast<float>(size) + 0.5F;
    half = std::bit_cast<std::uint32_t>(shifted) - std::bit_cast<std::uint32_t>(0.5F);
  }
  return static_cast<std::uint16_t>(sign | half);
}

void store(const Rgba& rgba, PixelFormat format, std::byte* to) {
  switch (format) {
    case PixelFormat::rgba8:
    case PixelFormat::bgra8: {
      std::array<std::uint8_t, 4> out{};
      for (std::size_t c = 0; c < 4; ++c)
        out[c] = static_cast<std::uint8_t>(to_integer_sample(rgba[c], 255));
      if (format == PixelFormat::bgra8) std::swap(out[0], out[2]);
      std::memcpy(to, out.data(), sizeof out);
      return;
    }
    case PixelFormat::rgba16:
    case PixelFormat::rgba16_float: {
      std::array<std::uint16_t, 4> out{};
      for (std::size_t c = 0; c < 4; ++c) {
        out[c] = format == PixelFormat::rgba16
                     ? static_cast<std::uint16_t>(to_integer_sample(rgba[c], 65535))
                     : half_of(rgba[c]);
      }
      std::memcpy(to, out.data(), sizeof out);
      return;
    }
    case PixelFormat::rgba32_float:
      std::memcpy(to, rgba.data(), sizeof rgba);
      return;
  }
}

}  // namespace

std::string_view extension_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::exr_half:
    case ImageFormat::exr_float:
      return ".exr";
    case ImageFormat::png16:
    case ImageFormat::png8:
      return ".png";
    case ImageFormat::tiff16:
    case ImageFormat::tiff8:
    case ImageFormat::tiff_float:
      return ".tif";
    case ImageFormat::tga:
      return ".tga";
    case ImageFormat::webp:
      return ".webp";
    case ImageFormat::ktx2:
      return ".ktx2";
    case ImageFormat::dds:
      return ".dds";
  }
  fail("SaveImageOptions::format is none of ImageFormat.", "option-enum");
}

void convert(const Image& image, PixelFormat format, std::span<std::byte> pixels,
             const ConvertOptions& options) {
  const std::size_t row_bytes = checked_row_bytes(image, format, pixels.size(), options);
  const std::size_t size = pixel_bytes(format);
  parallel_for(image.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const std::size_t row = options.bottom_up ? image.height - 1 - y : y;
      std::byte* to = pixels.data() + row * row_bytes;
      for (std::size_t x = 0; x < image.width; ++x, to += size) {
        store(rgba_of(image, y * image.width + x, options), format, to);
      }
    }
  });
}

}  // namespace kiln
