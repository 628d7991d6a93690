// Shared by the readers of JPEG, WebP, TIFF, TGA, BMP, Radiance HDR, KTX 2 and DDS. Each reader
// exists only in builds with its library (KILN_HAS_...). It returns the pixels as stored: integers
// are scaled to [0, 1]; colour profiles, gamma and EXIF data are ignored.
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

/// Parses a JPEG of 8 bits: grey or RGB, converted from YCbCr if needed. CMYK is refused. EXIF's
/// orientation is ignored, as in Blender and game engines, since UVs refer to the pixels as stored.
/// \throws Error(input); also if data is damaged or truncated, for which libjpeg would produce grey
///   pixels
Image parse_jpeg(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Parses a WebP, lossy or lossless, RGB or RGBA; animations are refused.
/// \throws Error(input)
Image parse_webp(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// How a picture of an asset is encoded.
struct PictureEncoding {
  PictureFormat format = PictureFormat::png;
  std::uint32_t quality = 0;  ///< EncodeMapsOptions::quality
  Dither dither = Dither::off;
  TextureUse use = TextureUse::
      /// Content of the picture. It decides whether chroma may be subsampled, and which channels
      /// Dither::automatic dithers
      values;
  bool smallest = false;  ///< True: PNGs are compressed as small as possible

  bool is_lossy() const {
    return format == PictureFormat::jpeg || (format == PictureFormat::webp && quality != 0);
  }
};

/// Encodes a picture as a file. PNGs are compressed at a high level.
/// \throws Error(usage) for images that the format cannot hold
std::vector<std::byte> encode_picture(const Image& image, const PictureEncoding& encoding);
/// The error (stored_error()) of the file that encode_picture() would write.
StoredError picture_error(const Image& image, const PictureEncoding& encoding,
                          std::span<const std::uint8_t> coverage);

/// Encodes WebP, lossless or lossy, RGB or RGBA. For an image of two channels, the third is 0.
/// \throws Error(usage) for sides over 16383 pixels
std::vector<std::byte> encode_webp(const Image& image, const PictureEncoding& encoding);
/// Encodes progressive JPEG, grey or RGB. For an image of two channels, the third is 0.
/// \throws Error(usage) for four channels, and for sides over 65500 pixels
std::vector<std::byte> encode_jpeg(const Image& image, const PictureEncoding& encoding);
/// Encodes uncompressed TGA of 8 bits: grey, RGB or RGBA. For an image of two channels, the third
/// is 0.
std::vector<std::byte> encode_tga(const Image& image, bool dither);

/// All pixels in 8 bits. For an image of two channels, the third is 0.
std::vector<std::uint8_t> bytes_of(const Image& image, Dither dither, TextureUse use);
/// stored_error() for a format of 8 bits. The arguments must have been checked.
StoredError error_of_stored(const Image& image, const SaveImageOptions& options,
                            std::span<const std::uint8_t> coverage);

/// Parses the first page of a TIFF: grey, palette or RGB, each with alpha or without; unsigned numbers of 1 to 32
/// bits, or floats of 16 to 64; strips or tiles; channels interleaved or in separate planes. The tag Orientation is
/// applied, and premultiplied alpha is divided out.
/// \throws Error(input)
Image parse_tiff(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Metadata of a TIFF of heights, from the tags of GeoTIFF and GDAL.
struct TiffGeography {
  std::optional<double> no_data;    ///< GDAL_NODATA
  std::array<double, 2> spacing{};  ///< Distance between columns and between rows; 0: unknown
  bool is_degrees = false;          ///< True if `spacing` is in degrees
  /// Latitude of the upper border of the first row in degrees; only valid if is_degrees
  double top = 0;
  unsigned length_unit = 0, height_unit = 0;  ///< EPSG codes of the units; 0: unknown
  /// The number in the file that becomes 1 in the image; 1 if values are not scaled
  double largest = 1;
};

/// Parses a TIFF of heights. Floats and signed numbers are unscaled heights, and so are unsigned
/// numbers if the file has tags of GeoTIFF or GDAL. Other unsigned numbers are scaled to [0, 1].
/// \throws Error(input)
Image parse_tiff_heights(const ByteSource& source, const std::string& file,
                         TiffGeography& geography, const ImageLimits& limits = {});

/// Encodes a TIFF: grey or RGB, with alpha or without; deflated in strips of 64 rows, little-endian. Integers are
/// clamped to [0, 1] and rounded to nearest; beyond 4 GiB it is a BigTIFF. \param bits  8 or 16; 32: floats
/// \throws Error(output)
std::vector<std::byte> encode_tiff(const Image& image, int bits);

/// True if the first page of a TIFF holds floats; false if it does not, or cannot be read.
bool tiff_holds_floats(const ByteSource& source);

/// Parses TGA, BMP (8 bits), or Radiance HDR (floats; EXPOSURE is ignored).
/// \param kind  "TGA", "BMP" or "Radiance HDR", for messages
/// \throws Error(input)
Image parse_stb(const ByteSource& source, const std::string& file, const std::string& kind,
                const ImageLimits& limits = {});

/// Parses the first level of a two-dimensional KTX 2 texture: 8 bits, 16 bits or floats per channel, BC1 to BC5 or
/// BC7 (opaque alpha is dropped); uncompressed, or compressed by Zstandard or zlib. Signed numbers become n/2 + 1/2,
/// and premultiplied alpha is divided out. KTXorientation and KTXswizzle are applied.
/// \throws Error(input), also for Basis Universal (ETC1S, UASTC)
Image parse_ktx2(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
/// Parses the first level of a DDS texture, with DXGI formats or older ones.
/// \throws Error(input)
Image parse_dds(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
bool is_ktx2(std::string_view head);
bool is_dds(std::string_view head);
/// Explains why a KTX 2 file's picture cannot be read, from its header; empty if it can be read.
std::string explain_unreadable_ktx2(std::span<const std::byte> bytes);
/// True if a KTX 2 or DDS file stores floats.
bool gpu_texture_holds_floats(const ByteSource& source);
/// True for a KTX 2 or DDS file that stores two channels: in BC5, or as two numbers per texel.
bool gpu_texture_has_two_channels(const ByteSource& source);

/// True if 18 bytes are a plausible TGA header. TGA has no magic number.
bool looks_like_tga(const std::string& head);

/// Makes an image of zeros with the size that a header declares.
/// \param place    place of the header in the file, for messages
/// \param working  bytes that the library needs in addition to the pixels
/// \throws what `fail` throws, if sides or pixels exceed the limits, or if memory is insufficient
Image empty_image(std::uint64_t width, std::uint64_t height, std::uint32_t channels,
                  std::uint64_t working, const std::string& place, const ImageLimits& limits,
                  const FailWith& fail);

/// Converts bytes (0 to 255) to floats in [0, 1].
/// \param to  receives as many floats as there are bytes
void floats_of_bytes(std::span<const std::uint8_t> bytes, float* to);

}  // namespace kiln
