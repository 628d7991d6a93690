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
  tiff16,  ///< TIFF, 16 bits a channel, as png16; deflated. Where libtiff was built in (picture_formats())
  tiff8,       ///< TIFF, 8 bits a channel
  tiff_float,  ///< TIFF, 32-bit float, as it is
  tga,         ///< TGA, 8 bits: grey, RGB (two channels: 0 as the third) or RGBA, not packed
  webp,  ///< WebP, 8 bits, lossless: RGB or RGBA. Where libwebp was built in; at most 16383 a side
  ktx2,  ///< KTX 2, of the Vulkan format that TextureUse says; Zstandard. Where libzstd was built in
  dds,   ///< DDS with DXGI's formats, as ktx2
};

/// Extension of a format's files, such as ".png". Any thread. \throws Error(usage) for none of them
std::string_view extension_of(ImageFormat format);

/// Meaning of a picture's values: ktx2 and dds name their format by it, and stored_error() compares by it.
///
/// Pictures whose sides are both multiples of 4, as Direct3D and WebGPU want, of one channel become BC4, of two BC5; else R8 and
/// RG8. Three and four are RGBA8, colours sRGB.
enum class TextureUse {
  values,         ///< Numbers
  color,          ///< sRGB-encoded colours, alpha apart
  normal,         ///< Unit vectors as n/2 + 1/2
  tangent_normal  ///< The same with z = sqrt(1 - x^2 - y^2), of which ktx2 and dds hold x and y alone: BC5
};

/// A text in a picture's file, about the picture.
struct ImageText {
  std::string keyword =
      {};  ///< 1 to 79 printable ASCII characters, without a blank at either end; no other's
  std::string text = {};  ///< Printable ASCII
};

/// Settings of save_image().
struct SaveImageOptions {
  ImageFormat format = ImageFormat::exr_half;  ///< The name's extension must agree
  bool dither = false;                  ///< png8, tga and webp: ordered dither instead of rounding.
  TextureUse use = TextureUse::values;  ///< ktx2 and dds: what format they have
  int threads = 0;                      ///< For compression; 0 takes all cores.
  /// Origin of places in the image (BakedMap::origin), written down: as the attribute `origin`
  /// (v3d) in an EXR, as the text `Origin` in a PNG. 0: nothing is written.
  std::array<double, 3> origin{};
  /// Written down as text (tEXt) in a PNG, as attributes (string) in an EXR.
  std::vector<ImageText> texts = {};
};

/// Reads a picture, chosen by content (TGA, which has no magic number, by its name as well): PNG and EXR (R, G, B, A
/// or Y; half, float or unsigned int), and, where their libraries were built in (picture_formats()), JPEG, WebP, TIFF
/// (the first page), Radiance HDR, BMP and TGA. Whole numbers become [0, 1] by division. Colour profiles, gamma and
/// EXIF's orientation are left alone; TIFF's Orientation is followed.
/// \throws Error(input) that names the file, where it is missing, damaged, cut short, CMYK or of another kind. A
///         damaged file does not make it take memory that the file could not fill.
/// Thread safety of all functions here: may be called from several threads. They read their arguments during
/// the call, keep nothing, and call nothing back.
Image load_image(const std::filesystem::path& path);

/// Writes an image. The file appears whole or not at all, also when the disk is full or the process
/// is killed. The same image gives the same bytes, on any number of threads.
///
/// PNG: clamped to [0, 1] (NaN becomes 0), rounded to nearest, no gamma or colour profile. So k/255
/// and k/65535 are kept exactly. EXR: as it is; half rounds to nearest even.
/// \throws Error(output) for the disk, Error(usage) for an impossible size, and texts that are none.
void save_image(const Image& image, const std::filesystem::path& path,
                const SaveImageOptions& options = {});

/// The bytes of the file that save_image() would write: the caller's own. \throws as save_image(), but for the disk
std::vector<std::byte> encode(const Image& image, const SaveImageOptions& options = {});

/// Reads an image from memory: the bytes of a whole file, not kept. \param name  for messages, and TGA's extension
/// \throws as load_image(path)
Image load_image(std::span<const std::byte> bytes, std::string_view name = "image");

/// The kinds of pictures that this build reads, such as "PNG".
std::vector<std::string> picture_formats();

/// True if a picture's colours are linear light, as those of OpenEXR, Radiance HDR and a TIFF of floats are: others
/// are sRGB by custom. False for what is no picture. \throws Error(input) where it cannot be opened
bool holds_linear_light(const std::filesystem::path& path);

/// Writes an image and its mip-maps as one file: KTX 2, DDS, or OpenEXR of tiles (256 x 256, MIPMAP_LEVELS, sides
/// rounded down). Renderers read it level by level; readers that know no mip-maps find the image.
/// Otherwise like save_image.
/// \param mips  levels 1 and on, down to 1 x 1 (BakedMap::mips); none for an image of 1 x 1
/// \throws Error(usage) for a format that holds one image (save levels as files); for levels
///         of other sizes; Error(output)
void save_mipmapped(const Image& image, const std::vector<Image>& mips,
                    const std::filesystem::path& path, const SaveImageOptions& options = {});

/// Error of stored values against those of the image: steps of 1/255, of a texel's worst channel; of normals
/// degrees.
struct StoredError {
  double mean = 0;  ///< Over the texels that count
  double max = 0;   ///< The greatest
};

/// Error of what save_image() stores in 8 bits or blocks (png8, tiff8, tga, webp, ktx2, dds) against the image. Values
/// outside of [0, 1], which are clamped, count as they are; those that are not finite as 255 or 180.
/// \param coverage  BakeResult::coverage: baked texels count; empty: all do
/// \returns zeros for other formats
/// \throws Error(usage) as save_image(); for a coverage of another size
StoredError stored_error(const Image& image, const SaveImageOptions& options,
                         std::span<const std::uint8_t> coverage = {});

/// From linear light to sRGB (IEC 61966-2-1): in place, of the first three channels, clamped to [0, 1].
void to_srgb(Image& image);

/// Difference of two images over the texels that count.
struct ImageDifference {
  std::uint64_t compared = 0;     ///< Texels compared
  double mean_angle_degrees = 0;  ///< Between decoded normals; 3 or more channels only
  double p95_angle_degrees = 0;   ///< 95% of the texels are not above
  double p99_angle_degrees = 0;   ///< 99% of the texels are not above
  double max_angle_degrees = 0;   ///< The greatest
  double mean_error = 0;          ///< Mean absolute channel difference, [0, 1] scale
  double max_error = 0;           ///< The greatest channel difference, [0, 1] scale
  std::uint32_t worst_x = 0;      ///< Column of max_angle (or max_error)
  std::uint32_t worst_y = 0;      ///< Its row
};

/// Compares two images as normal maps (n/2 + 1/2 in the first three channels) and by channel.
///
/// The angle is atan2(|a x b|, a . b) of the decoded vectors, in double precision. Where both
/// vectors are zero (shorter than 0.01) it is 0 degrees, where one is, 180. A value that is not
/// finite in one image only, or differently so, counts as 1 and 180 degrees. Percentiles are exact,
/// by nearest rank: the smallest angle that at least 95% (99%) of the texels do not exceed. The
/// result does not depend on the number of threads. Takes 8 bytes of memory a texel.
/// \param mask  optional: texels whose first channel is 0 there are left out
/// \throws Error(input) where sizes or numbers of channels differ, or pixels are missing.
ImageDifference compare_images(const Image& a, const Image& b, const Image* mask = nullptr);

/// The same texel by texel, one channel: the angle in degrees, or the largest channel difference; -1 where
/// the mask leaves texels out.
/// \param by_channel  channel differences; always of images with fewer than 3 channels
/// \throws as compare_images
Image image_differences(const Image& a, const Image& b, const Image* mask = nullptr,
                        bool by_channel = false);

/// Layout of a pixel in memory: channels in this order, numbers in the machine's byte order.
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

/// Settings of convert(): alpha, and channels that an image lacks.
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

/// One of several images in a file.
struct ImageLayer {
  std::string name = {};         ///< 1 to 128 bytes, no dot or 0; its channels are NAME.R and so on
  const Image* image = nullptr;  ///< The caller's; must stay until the file is written
  std::array<double, 3> origin{};     ///< As SaveImageOptions::origin: the attribute NAME.origin
  std::vector<ImageText> texts = {};  ///< As SaveImageOptions::texts: attributes NAME.KEYWORD
};

/// Writes several images of one size as one OpenEXR file: channels NAME.R, NAME.G, NAME.B and NAME.A, NAME.R and
/// NAME.G, or NAME.Y. Otherwise like save_image, threads and lifetimes included.
/// \throws Error(usage) for no layer, layers of different sizes, names that are none or come twice,
///         and PNG formats; Error(output)
void save_layers(std::span<const ImageLayer> layers, const std::filesystem::path& path,
                 const SaveImageOptions& options = {});

}  // namespace kiln
