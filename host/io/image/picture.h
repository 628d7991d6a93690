// Shared by the readers of JPEG, WebP, TIFF, TGA, BMP, Radiance HDR, KTX 2 and DDS. Each exists in builds with its
// library (KILN_HAS_...), and returns pixels as stored: numbers are divided to [0, 1], colour profiles, gamma and EXIF
// data are ignored.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/image/image_reader.h"
#include "kiln/asset.h"

namespace kiln {

/// Grey (YCbCr is converted) or RGB, 8 bits; CMYK is refused. EXIF's orientation is ignored, as in Blender and
/// game engines, since UVs refer to the pixels as stored.
/// \throws Error(input), also for damaged or truncated data, which libjpeg would fill with grey
Image parse_jpeg(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Lossy or lossless, RGB or RGBA; no animations. \throws Error(input)
Image parse_webp(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Encoding of a picture of an asset.
struct PictureEncoding {
  PictureFormat format = PictureFormat::png;
  std::uint32_t quality = 0;  ///< EncodeMapsOptions::quality
  Dither dither = Dither::off;
  TextureUse use = TextureUse::
      values;  ///< Colours may be subsampled; z of normals is not dithered by Dither::automatic
  bool smallest = false;  ///< Compress PNGs as small as possible

  bool is_lossy() const {
    return format == PictureFormat::jpeg || (format == PictureFormat::webp && quality != 0);
  }
};

/// Encodes a picture's file, PNGs for few bytes. \throws Error(usage) for images that the format
/// cannot hold
std::vector<std::byte> encode_picture(const Image& image, const PictureEncoding& encoding);
/// stored_error() of such a file.
StoredError picture_error(const Image& image, const PictureEncoding& encoding,
                          std::span<const std::uint8_t> coverage);

/// RGB or RGBA, lossless, or lossy; two channels get 0 as the third.
/// \throws Error(usage) beyond 16383 pixels a side
std::vector<std::byte> encode_webp(const Image& image, const PictureEncoding& encoding);
/// Grey or RGB, progressive; two channels get 0 as the third.
/// \throws Error(usage) for four channels, and beyond 65500 pixels a side
std::vector<std::byte> encode_jpeg(const Image& image, const PictureEncoding& encoding);
/// 8 bits, not packed: grey, RGB or RGBA; two channels get 0 as the third.
std::vector<std::byte> encode_tga(const Image& image, bool dither);

/// All pixels in 8 bits; two channels become three, the last one 0.
std::vector<std::uint8_t> bytes_of(const Image& image, Dither dither, TextureUse use);
/// stored_error() of an 8-bit format, with checked arguments.
StoredError error_of_stored(const Image& image, const SaveImageOptions& options,
                            std::span<const std::uint8_t> coverage);

/// The first page: grey, palette, RGB, each with alpha or without, of 1 to 32 bits (unsigned) or floats of 16 to 64;
/// strips or tiles, channels together or apart. The tag Orientation is applied, and premultiplied alpha is divided
/// out. \throws Error(input)
Image parse_tiff(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Metadata of a TIFF of heights, from the tags of GeoTIFF and GDAL.
struct TiffGeography {
  std::optional<double> no_data;    ///< GDAL_NODATA
  std::array<double, 2> spacing{};  ///< Distance between columns and between rows; 0: unknown
  bool is_degrees = false;          ///< True if `spacing` is in degrees
  double top = 0;                   ///< Latitude of the first row's border if is_degrees
  unsigned length_unit = 0, height_unit = 0;  ///< Codes of EPSG; 0: unknown
  double largest = 1;  ///< File value that a value of 1 stands for; 1: unscaled
};

/// Parses a TIFF of heights. Floats, signed numbers, and unsigned ones with tags of GeoTIFF or GDAL are unscaled
/// heights. Other unsigned numbers become [0, 1]. \throws Error(input)
Image parse_tiff_heights(const ByteSource& source, const std::string& file,
                         TiffGeography& geography, const ImageLimits& limits = {});

/// Encodes a TIFF: grey or RGB, with alpha or without; deflated in strips of 64 rows, little-endian. Integers are
/// clamped to [0, 1] and rounded to nearest; beyond 4 GiB it is a BigTIFF. \param bits  8 or 16; 32: floats
/// \throws Error(output)
std::vector<std::byte> encode_tiff(const Image& image, int bits);

/// True if the first page holds floats. False if it cannot be read.
bool tiff_holds_floats(const ByteSource& source);

/// TGA, BMP (8 bits) or Radiance HDR (floats; EXPOSURE is ignored).
/// \param kind  "TGA", "BMP" or "Radiance HDR", for messages  \throws Error(input)
Image parse_stb(const ByteSource& source, const std::string& file, const std::string& kind,
                const ImageLimits& limits = {});

/// The first level of one picture of two dimensions: 8 or 16 bits or floats a channel, BC1 to BC5 or BC7 (opaque alpha
/// is dropped); uncompressed, or compressed by Zstandard or zlib. Signed numbers become n/2 + 1/2, and premultiplied
/// alpha is divided out. KTXorientation and KTXswizzle are applied.
/// \throws Error(input), also for Basis Universal (ETC1S, UASTC)
Image parse_ktx2(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
/// The same for DDS, with formats of DXGI or older ones. \throws Error(input)
Image parse_dds(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
bool is_ktx2(std::string_view head);
bool is_dds(std::string_view head);
/// Why a KTX 2 file's picture cannot be read, by its header; empty if it can.
std::string why_not_ktx2(std::span<const std::byte> bytes);
/// True if a KTX 2 or DDS file stores floats.
bool gpu_texture_holds_floats(const ByteSource& source);

/// True if the first 18 bytes are a plausible TGA header, since TGA has no magic number.
bool looks_like_tga(const std::string& head);

/// A zero image of a header's size.
/// \param place    of the header, for messages
/// \param working  bytes that the library needs besides the pixels
/// \throws what `fail` throws: sides or pixels above the limits, or insufficient memory
Image empty_image(std::uint64_t width, std::uint64_t height, std::uint32_t channels,
                  std::uint64_t working, const std::string& place, const ImageLimits& limits,
                  const FailWith& fail);

/// Converts 0 to 255 to [0, 1]. \param to  as many floats
void floats_of_bytes(std::span<const std::uint8_t> bytes, float* to);

}  // namespace kiln
