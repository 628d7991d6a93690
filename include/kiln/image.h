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
#include "kiln/image_data.h"
#include "kiln/image_format.h"

namespace KILN_PUBLIC kiln {

struct BakedMap;

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

/// Writes a map with its mip-maps as `kiln bake` does: values of to_stored(), with origin, ranges and unit as texts.
/// Mip-maps go into the same file with EXR, KTX 2 and DDS, else into NAME.mip01.png and so on beside it.
/// \param options  `origin` is replaced by the map's, and texts are added to `texts`. If `use` is `values`, `color` is
///                 used for colours and `normal` for unit vectors; give `tangent_normal` for normals in tangent space
/// \returns the files
/// \throws as save_image() and save_mipmapped(); Error(usage) in builds without file formats
/// Thread safety: may be called from several threads.
std::vector<std::filesystem::path> save_image(const BakedMap& map,
                                              const std::filesystem::path& path,
                                              const SaveImageOptions& options = {});

/// Encodes the file that save_image() would write, in memory. \throws as save_image(), without errors of the disk
std::vector<std::byte> encode(const Image& image, const SaveImageOptions& options = {});

/// Reads an image from the bytes of a whole file, which are not kept. \param name  for messages; its extension
/// identifies TGA
/// \throws as load_image(path)
Image load_image(std::span<const std::byte> bytes, std::string_view name = "image");

/// Writes an image and its mip-maps as one file: KTX 2, DDS, or tiled OpenEXR (256 x 256, MIPMAP_LEVELS, sides
/// rounded down). Renderers read single levels; readers without support for mip-maps read the image. Otherwise
/// like save_image.
/// \param mips  levels 1 and on, down to 1 x 1 (BakedMap::mips); empty for an image of 1 x 1
/// \throws Error(usage) for a format that holds one image (save levels as separate files); for levels of wrong
///         sizes; Error(output)
void save_mipmapped(const Image& image, const std::vector<Image>& mips,
                    const std::filesystem::path& path, const SaveImageOptions& options = {});

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
  std::uint64_t compared_texels = 0;  ///< Number of compared texels
  double mean_angle_degrees = 0;  ///< Mean angle between decoded normals; 3 or more channels only
  double p95_angle_degrees = 0;   ///< Angle that 95% of the texels do not exceed
  double p99_angle_degrees = 0;   ///< Angle that 99% of the texels do not exceed
  double max_angle_degrees = 0;   ///< Largest angle
  double mean_error = 0;          ///< Mean absolute channel difference, [0, 1] scale
  double max_error = 0;           ///< Largest channel difference, [0, 1] scale
  std::uint32_t worst_x = 0;      ///< Column of the texel with max_angle_degrees (or max_error)
  std::uint32_t worst_y = 0;      ///< Row of the texel at `worst_x`, from the top
};

/// Compares two images as normal maps (n/2 + 1/2 in the first three channels) and by channel.
///
/// The angle is atan2(|a x b|, a . b) of the decoded vectors, in double precision. If both vectors are zero (shorter
/// than 0.01) it is 0 degrees; if one is, 180. A value that is finite in only one of the images, or a different one of
/// NaN, infinity and -infinity in each, counts as a difference of 1 and of 180 degrees. Percentiles are exact, by
/// nearest rank: the smallest angle that at least 95% (99%) of the texels do not exceed. The result does not depend on
/// the number of threads. Memory: 8 bytes per texel.
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
  const Image* image = nullptr;  ///< Not copied: must stay valid until the file is written
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
