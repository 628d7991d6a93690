#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
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
  /// 1 to 79 printable ASCII characters without leading or trailing blanks; unique in the file
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
  /// Texts to store in the file: as text chunks (tEXt) in a PNG, as string attributes in an EXR.
  std::vector<ImageText> texts = {};
};

/// Reads a picture, chosen by content (TGA, which has no magic number, by its name as well): PNG and EXR (R, G, B, A
/// or Y; half, float or unsigned int), and, in builds with their libraries (picture_formats()), JPEG, WebP, TIFF (the
/// first page), Radiance HDR, BMP and TGA. Integers are divided into [0, 1]. Colour profiles, gamma and EXIF's
/// orientation are ignored; TIFF's Orientation is applied.
/// \throws Error(input) that names the file, if it is missing, damaged, truncated, CMYK or of an unknown format. A
///         damaged file cannot cause allocations beyond what its size could fill.
/// Thread safety of all functions here: may be called from several threads. They read their arguments during the
/// call, keep none, and call no callback.
Image load_image(const std::filesystem::path& path);

/// Writes an image. The file appears whole or not at all, also when the disk is full or the process
/// is killed. The same image gives the same bytes, on any number of threads.
///
/// PNG: clamped to [0, 1] (NaN becomes 0), rounded to nearest, no gamma or colour profile. So
/// values of k/255 and k/65535 are stored exactly. EXR: unchanged values; half rounds to nearest
/// even.
/// \throws Error(output) for the disk, Error(usage) for an impossible size, and invalid texts.
void save_image(const Image& image, const std::filesystem::path& path,
                const SaveImageOptions& options = {});

/// Encodes the file that save_image() would write, in memory. \throws as save_image(), without errors of the disk
std::vector<std::byte> encode(const Image& image, const SaveImageOptions& options = {});

/// Reads an image from the bytes of a whole file, which are not kept. \param name  for messages; its extension
/// identifies TGA
/// \throws as load_image(path)
Image load_image(std::span<const std::byte> bytes, std::string_view name = "image");

/// Picture formats that this build reads, such as "PNG".
std::vector<std::string> picture_formats();

/// True if a picture file holds linear light: OpenEXR, Radiance HDR and floating-point TIFF. Other formats are sRGB
/// by convention. False for files that are not pictures. \throws Error(input) if it cannot be opened
bool holds_linear_light(const std::filesystem::path& path);

/// Writes an image and its mip-maps as one file: KTX 2, DDS, or tiled OpenEXR (256 x 256, MIPMAP_LEVELS, sides
/// rounded down). Renderers read single levels; readers without support for mip-maps read the image. Otherwise
/// like save_image.
/// \param mips  levels 1 and on, down to 1 x 1 (BakedMap::mips); empty for an image of 1 x 1
/// \throws Error(usage) for a format that holds one image (save levels as separate files); for levels of wrong
///         sizes; Error(output)
void save_mipmapped(const Image& image, const std::vector<Image>& mips,
                    const std::filesystem::path& path, const SaveImageOptions& options = {});

/// Quantisation error of stored values against the image: of each texel's worst channel in steps of 1/255;
/// for normals in degrees.
struct StoredError {
  double mean = 0;  ///< Mean over the counted texels
  double max = 0;   ///< Maximum over the counted texels
};

/// Error of an image as save_image() stores it in 8 bits or blocks (png8, tiff8, tga, webp, ktx2, dds). Values outside
/// of [0, 1] are clamped, which counts as error; non-finite values count as 255 or 180.
/// \param coverage  BakeResult::coverage: only baked texels count; empty: all do
/// \returns zeros for other formats
/// \throws Error(usage) as save_image(); for a coverage of another size
StoredError stored_error(const Image& image, const SaveImageOptions& options,
                         std::span<const std::uint8_t> coverage = {});

/// Converts the first three channels of an image in place from linear light to sRGB (IEC 61966-2-1),
/// clamped to [0, 1].
void to_srgb(Image& image);

/// Difference of two images over the compared texels.
struct ImageDifference {
  std::uint64_t compared = 0;     ///< Number of compared texels
  double mean_angle_degrees = 0;  ///< Mean angle between decoded normals; 3 or more channels only
  double p95_angle_degrees = 0;   ///< Angle that 95% of the texels do not exceed
  double p99_angle_degrees = 0;   ///< Angle that 99% of the texels do not exceed
  double max_angle_degrees = 0;   ///< Largest angle
  double mean_error = 0;          ///< Mean absolute channel difference, [0, 1] scale
  double max_error = 0;           ///< Largest channel difference, [0, 1] scale
  std::uint32_t worst_x = 0;      ///< Column of the texel with max_angle_degrees (or max_error)
  std::uint32_t worst_y = 0;      ///< Row of that texel, from the top
};

/// Compares two images as normal maps (n/2 + 1/2 in the first three channels) and by channel.
///
/// The angle is atan2(|a x b|, a . b) of the decoded vectors, in double precision. If both vectors
/// are zero (shorter than 0.01) it is 0 degrees; if one is, 180. If a value is not finite in only
/// one image, or is another kind of non-finite value in each (NaN, infinity), it counts as a
/// difference of 1 and of 180 degrees. Percentiles are exact, by nearest rank: the smallest angle
/// that at least 95% (99%) of the texels do not exceed. The result does not depend on the number of
/// threads. Memory: 8 bytes per texel.
/// \param mask  optional: texels whose first channel is 0 there are left out
/// \throws Error(input) if sizes or numbers of channels differ, or pixels are missing.
ImageDifference compare_images(const Image& a, const Image& b, const Image* mask = nullptr);

/// The differences per texel, one channel: the angle in degrees, or the largest channel difference; -1
/// where the mask excludes texels.
/// \param by_channel  compare channels; always done for images with fewer than 3 channels
/// \throws as compare_images
Image image_differences(const Image& a, const Image& b, const Image* mask = nullptr,
                        bool by_channel = false);

/// Layout of a pixel in memory: channels in this order, numbers in the machine's byte order.
enum class PixelFormat {
  rgba8,         ///< 4 bytes, [0, 1] as 0 to 255: VK_FORMAT_R8G8B8A8_UNORM, GL_RGBA8
  bgra8,         ///< 4 bytes, blue first: VK_FORMAT_B8G8R8A8_UNORM
  rgba16,        ///< 8 bytes, [0, 1] as 0 to 65535: VK_FORMAT_R16G16B16A16_UNORM, GL_RGBA16
  rgba16_float,  ///< 8 bytes, rounded to nearest even: VK_FORMAT_R16G16B16A16_SFLOAT, GL_RGBA16F
  rgba32_float,  ///< 16 bytes, unchanged: VK_FORMAT_R32G32B32A32_SFLOAT, GL_RGBA32F
};

/// Bytes of a pixel.
constexpr std::size_t pixel_bytes(PixelFormat format) {
  return format == PixelFormat::rgba32_float                                    ? 16
         : format == PixelFormat::rgba16 || format == PixelFormat::rgba16_float ? 8
                                                                                : 4;
}

/// Settings of convert().
struct ConvertOptions {
  /// BakeResult::coverage, or empty. If given, alpha is 1 for baked texels and 0 for padding, missed and
  /// empty ones. Else alpha is the image's fourth channel, or 1.
  std::span<const std::uint8_t> coverage = {};
  /// Bytes from one row to the next; 0: rows are contiguous.
  std::size_t row_bytes = 0;
  bool bottom_up = false;  ///< The first row is the lowest (OpenGL); default the uppermost
};

/// Writes an image into the caller's memory, for example a texture's staging buffer. Integers: clamped to [0,
/// 1] (NaN becomes 0), rounded to nearest, ties to even: the numbers that save_image() writes as PNG. One
/// channel becomes grey; with two channels, blue is 0. No argument is kept. Thread safety: may be called from
/// several threads, for memory that does not overlap.
/// \param pixels  at least height rows of row_bytes; the last row needs no bytes after its pixels
/// \throws Error(usage): `pixel-size` for too little memory, too short rows or a coverage of another size;
///         `pixel-format`; `image-size` for an inconsistent image
void convert(const Image& image, PixelFormat format, std::span<std::byte> pixels,
             const ConvertOptions& options = {});

/// One of several images in a file.
struct ImageLayer {
  /// Name of the layer, 1 to 128 bytes, without dots and zero bytes; its channels are named NAME.R
  /// and so on
  std::string name = {};
  const Image* image = nullptr;  ///< The caller's; must stay valid until the file is written
  /// Origin like SaveImageOptions::origin, stored as the attribute NAME.origin
  std::array<double, 3> origin{};
  /// Texts like SaveImageOptions::texts, stored as attributes NAME.KEYWORD
  std::vector<ImageText> texts = {};
};

/// Writes several images of one size as one OpenEXR file: channels NAME.R, NAME.G, NAME.B and NAME.A, NAME.R and
/// NAME.G, or NAME.Y. Otherwise like save_image, threads and lifetimes included.
/// \throws Error(usage) for no layer, layers of different sizes, invalid or repeated names, and PNG formats;
///         Error(output)
void save_layers(std::span<const ImageLayer> layers, const std::filesystem::path& path,
                 const SaveImageOptions& options = {});

}  // namespace kiln
