/// \file
/// File formats of images, and the settings of files. image.h reads and writes them. Functions here: any thread.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// File formats of images.
enum class ImageFormat {
  exr_half,   ///< OpenEXR, 16-bit float, PIZ (lossless)
  exr_float,  ///< OpenEXR, 32-bit float, PIZ (lossless)
  png16,      ///< PNG, 16 bits a channel, [0, 1] rounded to nearest
  png8,       ///< PNG, 8 bits a channel
  /// TIFF, 16 bits a channel, values as png16, compressed by Deflate. In builds with libtiff
  /// (picture_formats())
  tiff16,
  tiff8,       ///< TIFF, 8 bits a channel
  tiff_float,  ///< TIFF, 32-bit float, unchanged values
  /// TGA, 8 bits, uncompressed: grey, RGB or RGBA; two channels become RGB with 0 as the third
  tga,
  /// WebP, 8 bits, lossless: RGB or RGBA. In builds with libwebp; at most 16383 texels a side
  webp,
  /// KTX 2 in the Vulkan format that TextureUse selects, compressed by Zstandard. In builds with
  /// libzstd
  ktx2,
  dds,  ///< DDS in the DXGI format that TextureUse selects
};

/// Extension of a format's files, such as ".png". Any thread. \throws Error(usage) for an invalid
/// value
std::string_view extension_of(ImageFormat format);

/// Meaning of a picture's values: it selects the format of ktx2 and dds, and the error measure of stored_error().
///
/// One channel becomes BC4 and two become BC5 if both sides are multiples of 4, as Direct3D and WebGPU require; else R8
/// and RG8. Three and four channels become RGBA8, sRGB for colours.
enum class TextureUse {
  values,  ///< Plain numbers, not sRGB-encoded
  color,   ///< sRGB-encoded colours; alpha is linear
  normal,  ///< Unit vectors as n/2 + 1/2
  /// Unit vectors with z = sqrt(1 - x^2 - y^2); ktx2 and dds store only x and y, as BC5
  tangent_normal
};

/// A text entry in an image file.
struct ImageText {
  /// Keyword: 1 to 79 printable ASCII characters without leading or trailing blanks; unique in the file
  std::string keyword = {};
  std::string text = {};  ///< Text, printable ASCII
};

/// Settings of save_image().
struct SaveImageOptions {
  /// File format; must agree with the extension of the file's name
  ImageFormat format = ImageFormat::exr_half;
  bool dither = false;  ///< png8, tga and webp: ordered dither instead of rounding.
  /// Meaning of the values, which selects the format of ktx2 and dds
  TextureUse use = TextureUse::values;
  int threads = 0;  ///< Number of threads for compression; 0: one per core.
  /// Origin of positions in the image (BakedMap::origin), stored as the attribute `origin` (v3d) in
  /// an EXR, as the text `Origin` in a PNG. 0: not stored.
  std::array<double, 3> origin{};
  /// Stored as text chunks (tEXt) in a PNG, as string attributes in an EXR.
  std::vector<ImageText> texts = {};
};

/// Picture formats that this build reads, such as "PNG".
std::vector<std::string> picture_formats();

/// True if a picture file holds linear light: OpenEXR, Radiance HDR and floating-point TIFF. Other formats are sRGB
/// by convention. False for files that are not pictures. \throws Error(input) if it cannot be opened
bool holds_linear_light(const std::filesystem::path& path);

}  // namespace kiln
