// Shared by the readers of JPEG, WebP, TIFF, TGA, BMP, Radiance HDR, KTX 2 and DDS. Each is there where its library was built
// in (KILN_HAS_...), and reads pixels as they are stored: numbers are divided to [0, 1], colour profiles, gamma and
// EXIF data are left alone.
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

/// Grey (YCbCr is converted) or RGB, 8 bits; CMYK is refused. EXIF's orientation is left alone, as Blender and the
/// engines leave it: UVs are made for the pixels as they are stored.
/// \throws Error(input), also for what libjpeg would fill with grey: data that are damaged or cut short
Image parse_jpeg(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Lossy or lossless, RGB or RGBA; no animations. \throws Error(input)
Image parse_webp(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// How a picture of an asset is stored.
struct PictureEncoding {
  PictureFormat format = PictureFormat::png;
  std::uint32_t quality = 0;  ///< EncodeMapsOptions::quality
  Dither dither = Dither::off;
  TextureUse use = TextureUse::
      values;  ///< Colours may have half the resolution; z of normals is not dithered as needed
  bool smallest = false;  ///< Of PNGs

  bool is_lossy() const {
    return format == PictureFormat::jpeg || (format == PictureFormat::webp && quality != 0);
  }
};

/// A picture's file, PNGs packed for bytes. \throws Error(usage) for what the format cannot hold
std::vector<std::byte> encode_picture(const Image& image, const PictureEncoding& encoding);
/// stored_error() of it.
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

/// All rows in 8 bits; two channels become three, the last one 0.
std::vector<std::uint8_t> bytes_of(const Image& image, Dither dither, TextureUse use);
/// stored_error() of a format of 8 bits, its arguments checked.
StoredError error_of_stored(const Image& image, const SaveImageOptions& options,
                            std::span<const std::uint8_t> coverage);

/// The first page: grey, palette, RGB, each with alpha or without, of 1 to 32 bits (unsigned) or floats of 16 to 64;
/// strips or tiles, channels together or apart. The tag Orientation is followed, alpha that is multiplied into the
/// colours is divided out. \throws Error(input)
Image parse_tiff(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// What a TIFF of heights says of them, by the tags of GeoTIFF and GDAL.
struct TiffGeography {
  std::optional<double> no_data;    ///< GDAL_NODATA
  std::array<double, 2> spacing{};  ///< From column to column and from row to row; 0: not said
  bool is_degrees = false;          ///< True if `spacing` is
  double top = 0;                   ///< Latitude of the first row's border, where it is
  unsigned length_unit = 0, height_unit = 0;  ///< Codes of EPSG; 0: not said
  double largest = 1;  ///< What a value of 1 stands for in the file; 1: numbers are as they stand
};

/// The same of heights, whose numbers stay as they are: floats, signed numbers, and unsigned ones where tags of GeoTIFF
/// or GDAL say that they are of the ground. Other unsigned ones are in [0, 1]. \throws Error(input)
Image parse_tiff_heights(const ByteSource& source, const std::string& file,
                         TiffGeography& geography, const ImageLimits& limits = {});

/// A TIFF in memory: grey or RGB, with alpha or without; deflated in strips of 64 rows, little-endian. Whole numbers
/// are clamped to [0, 1] and rounded to nearest; beyond 4 GiB it is a BigTIFF. \param bits  8 or 16; 32: floats
/// \throws Error(output)
std::vector<std::byte> encode_tiff(const Image& image, int bits);

/// True if the first page holds floats. False if it cannot be read.
bool tiff_holds_floats(const ByteSource& source);

/// TGA, BMP (8 bits) or Radiance HDR (floats, as its exponents say; its EXPOSURE is left alone).
/// \param kind  "TGA", "BMP" or "Radiance HDR", for messages  \throws Error(input)
Image parse_stb(const ByteSource& source, const std::string& file, const std::string& kind,
                const ImageLimits& limits = {});

/// The first level of one picture of two dimensions: 8 or 16 bits or floats a channel, BC1 to BC5 or BC7 (without alpha
/// where all of it is opaque); as it is, or packed by Zstandard or zlib. Signed numbers are read as n/2 + 1/2, alpha that
/// is multiplied into the colours is divided out. KTXorientation and KTXswizzle are followed.
/// \throws Error(input), also for Basis Universal (ETC1S, UASTC)
Image parse_ktx2(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
/// The same of DDS, with DXGI's formats or those of before. \throws Error(input)
Image parse_dds(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});
bool is_ktx2(std::string_view head);
bool is_dds(std::string_view head);
/// Why a KTX 2 file's picture cannot be read, by its header; empty: it can.
std::string why_not_ktx2(std::span<const std::byte> bytes);
/// True if a KTX 2 or DDS file says that it holds floats.
bool gpu_texture_holds_floats(const ByteSource& source);

/// True if the first 18 bytes are those of a TGA, which has no magic number.
bool looks_like_tga(const std::string& head);

/// Zeros, as large as a header says.
/// \param place    of the header, for messages
/// \param working  bytes that the library takes beside the pixels
/// \throws what `fail` throws: sides or pixels beyond the limits, memory short
Image empty_image(std::uint64_t width, std::uint64_t height, std::uint32_t channels,
                  std::uint64_t working, const std::string& place, const ImageLimits& limits,
                  const FailWith& fail);

/// From 0 to 255 to [0, 1]. \param to  as many
void floats_of_bytes(std::span<const std::uint8_t> bytes, float* to);

}  // namespace kiln
