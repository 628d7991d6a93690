#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "base/lower_case.h"
#include "base/option.h"
#include "io/file/atomic_file.h"
#include "io/image/exr.h"
#include "io/image/gpu_texture.h"
#include "io/image/image_reader.h"
#include "io/image/image_rows.h"
#include "io/image/picture.h"
#include "io/image/png.h"
#include "kiln/files.h"
#include "kiln/image.h"

namespace kiln {
namespace {

void check_shape(const ImageShape& shape) {
  if (shape.width == 0 || shape.height == 0 || shape.width > kLargestImageSide ||
      shape.height > kLargestImageSide) {
    throw Error(ErrorCode::usage, "An image of " + std::to_string(shape.width) + " x " +
                                      std::to_string(shape.height) +
                                      " pixels cannot be saved; each side must be 1 to " +
                                      std::to_string(kLargestImageSide) + ".");
  }
  if (shape.channels < 1 || shape.channels > 4) {
    throw Error(ErrorCode::usage, "An image of " + std::to_string(shape.channels) +
                                      " channels cannot be saved; use 1 to 4.");
  }
}

void check_image(const Image& image) {
  check_shape({image.width, image.height, image.channels});
  if (image.pixels.size() != std::size_t{image.width} * image.height * image.channels) {
    throw Error(ErrorCode::usage,
                "An image's pixels hold " + std::to_string(image.pixels.size()) +
                    " values, not width x height x channels = " +
                    std::to_string(std::size_t{image.width} * image.height * image.channels) + ".");
  }
}

void check_options(const SaveImageOptions& options) {
  if (options.threads < 0) {
    throw Error(ErrorCode::usage, "SaveImageOptions::threads is " +
                                      std::to_string(options.threads) +
                                      "; use 0 for all cores, or their number.");
  }
  check_texts(options.texts);
}

/// The given texts, and one with the origin of positions as three numbers.
std::vector<ImageText> png_texts(const SaveImageOptions& options) {
  std::vector<ImageText> texts = options.texts;
  const std::array<double, 3>& origin = options.origin;
  if (origin == std::array<double, 3>{}) return texts;
  std::string text;
  for (const double value : origin) {
    char digits[32];  // snprintf() would write a decimal comma in some locales
    char* const end =
        std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, 17).ptr;
    text += (text.empty() ? "" : " ") + std::string(digits, end);
  }
  texts.insert(texts.begin(), {"Origin", text});
  return texts;
}

void check_mips(const Image& image, const std::vector<Image>& mips) {
  const Image* finer_level = &image;
  const auto is_last = [&] { return finer_level->width == 1 && finer_level->height == 1; };
  for (const Image& level : mips) {
    check_image(level);
    const std::uint32_t width = std::max(1U, finer_level->width / 2);
    const std::uint32_t height = std::max(1U, finer_level->height / 2);
    if (is_last() || level.width != width || level.height != height ||
        level.channels != image.channels) {
      throw Error(ErrorCode::usage,
                  "Mip level " + std::to_string(&level - mips.data() + 1) + " is " +
                      std::to_string(level.width) + " x " + std::to_string(level.height) +
                      " with " + std::to_string(level.channels) +
                      " channels; each level must have the image's channels and half the sides of "
                      "the last, rounded down, until 1 x 1.");
    }
    finer_level = &level;
  }
  if (!is_last()) {
    throw Error(ErrorCode::usage, "The last of " + std::to_string(mips.size()) + " mip levels is " +
                                      std::to_string(finer_level->width) + " x " +
                                      std::to_string(finer_level->height) +
                                      "; give all levels down to 1 x 1.");
  }
}

}  // namespace

FailWith image_failure(std::string file, std::string kind) {
  return [file = std::move(file), kind = std::move(kind)](
             const std::string& place, const std::string& problem, const Message& remedy) {
    throw Error(ErrorCode::input,
                "Could not read '" + file + "'" + (kind.empty() ? "" : " as " + kind) + ": " +
                    (place.empty() ? "" : place + ": ") + problem + ". " + remedy);
  };
}

namespace {

/// A picture format that can be read. `parse` is null if this build lacks the library for it.
struct ReadableFormat {
  std::string name;
  const char* library;
  const char* option;  ///< CMake option that enables the library
  Image (*parse)(const ByteSource& source, const std::string& file, const ImageLimits& limits);
};

enum PictureKind { kPng, kExr, kJpeg, kWebp, kTiff, kHdr, kBmp, kTga, kKtx2, kDds };

#ifdef KILN_HAS_STB
Image parse_hdr(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  return parse_stb(source, file, "Radiance HDR", limits);
}
Image parse_bmp(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  return parse_stb(source, file, "BMP", limits);
}
Image parse_tga(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  return parse_stb(source, file, "TGA", limits);
}
#endif

/// All picture formats, in the order of PictureKind.
const ReadableFormat kPictures[] = {
    {"PNG", "", "", parse_png},          {"OpenEXR", "", "", parse_exr},
#ifdef KILN_HAS_JPEG
    {"JPEG", "", "", parse_jpeg},
#else
    {"JPEG", "libjpeg", "KILN_JPEG", nullptr},
#endif
#ifdef KILN_HAS_WEBP
    {"WebP", "", "", parse_webp},
#else
    {"WebP", "libwebp", "KILN_WEBP", nullptr},
#endif
#ifdef KILN_HAS_TIFF
    {"TIFF", "", "", parse_tiff},
#else
    {"TIFF", "libtiff 4.5", "KILN_TIFF", nullptr},
#endif
#ifdef KILN_HAS_STB
    {"Radiance HDR", "", "", parse_hdr}, {"BMP", "", "", parse_bmp},     {"TGA", "", "", parse_tga},
#else
    {"Radiance HDR", "stb_image", "KILN_STB", nullptr},
    {"BMP", "stb_image", "KILN_STB", nullptr},
    {"TGA", "stb_image", "KILN_STB", nullptr},
#endif
    {"KTX 2", "", "", parse_ktx2},       {"DDS", "", "", parse_dds},
};

/// Detects the format by the first bytes. For TGA, which has no magic number, the extension must be
/// that of TGA, too.
std::optional<PictureKind> picture_kind(const std::string& head, const std::string& file) {
  using namespace std::string_literals;
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return kPng;
  if (head.starts_with("\x76\x2f\x31\x01")) return kExr;
  if (head.starts_with("\xff\xd8\xff")) return kJpeg;
  if (head.starts_with("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return kWebp;
  for (const std::string& magic : {"II*\0"s, "MM\0*"s, "II+\0"s, "MM\0+"s}) {
    if (head.starts_with(magic)) return kTiff;
  }
  if (is_ktx2(head)) return kKtx2;
  if (is_dds(head)) return kDds;
  if (head.starts_with("#?RADIANCE\n") || head.starts_with("#?RGBE\n")) return kHdr;
  if (lower_extension(file) == ".tga" && looks_like_tga(head)) return kTga;
  if (head.starts_with("BM") && head.size() >= 18) return kBmp;
  return std::nullopt;
}

constexpr std::size_t kHeadBytes = 18;

}  // namespace

bool looks_like_tga(const std::string& head) {
  if (head.size() < 18) return false;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  const unsigned palette = byte(1), kind = byte(2) & 7U, bits = byte(16);
  const bool known =
      palette <= 1 && byte(2) <= 11 && kind >= 1 && kind <= 3 && (palette == 1 || kind != 1);
  const bool sized = byte(12) + byte(13) != 0 && byte(14) + byte(15) != 0;
  return known && sized && (bits == 8 || bits == 15 || bits == 16 || bits == 24 || bits == 32);
}

std::vector<std::string> picture_formats() {
  std::vector<std::string> names;
  for (const ReadableFormat& format : kPictures) {
    if (format.parse != nullptr) names.push_back(format.name);
  }
  return names;
}

bool holds_linear_light(const ByteSource& source, const std::string& file) {
  switch (picture_kind(source.head(kHeadBytes), file).value_or(kPng)) {
    case kExr:
    case kHdr:
      return true;
#ifdef KILN_HAS_TIFF
    case kTiff:
      return tiff_holds_floats(source);
#endif
    case kKtx2:
    case kDds:
      return gpu_texture_holds_floats(source);
    default:
      return false;
  }
}

bool is_two_channel_texture(const ByteSource& source, const std::string& file) {
  const std::optional<PictureKind> kind = picture_kind(source.head(kHeadBytes), file);
  return (kind == kKtx2 || kind == kDds) && gpu_texture_has_two_channels(source);
}

bool holds_linear_light(const std::filesystem::path& path) {
  const FailWith fail = image_failure(path.string(), "an image");
  return holds_linear_light(*open_file(path, fail), path.string());
}

Image parse_image(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const std::string head = source.head(kHeadBytes);
  const auto kind = picture_kind(head, file);
  if (kind && kPictures[*kind].parse != nullptr) {
    return kPictures[*kind].parse(source, file, limits);
  }
  const FailWith fail = image_failure(file, "an image");
  if (head.empty()) fail("", "it is empty", "Export it again.");
  if (kind) {
    const ReadableFormat& format = kPictures[*kind];
    fail("", "it is " + format.name + ", and this build of Kiln was made without " + format.library,
         std::string("Convert it to PNG, or build Kiln with ") + format.option + "=ON where " +
             format.library + " is installed.");
  }
  std::string list;
  for (const std::string& name : picture_formats()) list += (list.empty() ? "" : ", ") + name;
  fail("", "it is none of the kinds that Kiln reads (" + list + ")", "Convert it to PNG.");
  return {};
}

Image load_image(const std::filesystem::path& path) {
  const std::string file = path.string();
  const FailWith fail = image_failure(file, "an image");
  const std::unique_ptr<ByteSource> source = open_file(path, fail);
  try {
    return parse_image(*source, file);
  } catch (const std::bad_alloc&) {
    fail("pixels", "memory ran out",
         "Free some memory, raise the " + option("memory_limit") + ", or scale the image down.");
    throw;
  }
}

namespace {

bool is_exr(ImageFormat format) {
  return format == ImageFormat::exr_half || format == ImageFormat::exr_float;
}

/// Refuses names whose extension belongs to another format, which would mislead other programs.
void check_extension(const std::filesystem::path& path, ImageFormat format) {
  const std::string extension = lower_extension(path);
  const std::string_view own = extension_of(format);
  if (extension == own || (extension == ".tiff" && own == ".tif")) return;
  for (const std::string_view other :
       {".png", ".exr", ".tif", ".tiff", ".tga", ".webp", ".ktx2", ".dds"}) {
    if (extension != other) continue;
    throw Error(ErrorCode::usage, "The extension of '" + path.string() +
                                      "' belongs to another format than that of the file (" +
                                      std::string(own) +
                                      "): set SaveImageOptions::format, or rename the file.");
  }
}

[[noreturn, maybe_unused]] void fail_for_missing_library(const char* format, const char* library,
                                                         const char* option) {
  throw Error(ErrorCode::usage, std::string(format) +
                                    " cannot be written: this build of Kiln was made without " +
                                    library + ". Choose PNG or OpenEXR, or build with " + option +
                                    "=ON where " + library + " is installed.");
}

std::vector<std::byte> tiff_of(const Image& image, int bits) {
#ifdef KILN_HAS_TIFF
  return encode_tiff(image, bits);
#else
  static_cast<void>(image);
  static_cast<void>(bits);
  fail_for_missing_library("TIFF", "libtiff", "KILN_TIFF");
#endif
}

std::vector<std::byte> webp_of(const Image& image, bool dither) {
#ifdef KILN_HAS_WEBP
  return encode_webp(image,
                     {.format = PictureFormat::webp, .dither = dither ? Dither::on : Dither::off});
#else
  static_cast<void>(image);
  static_cast<void>(dither);
  fail_for_missing_library("WebP", "libwebp", "KILN_WEBP");
#endif
}

PngOptions png_options(int bits, const SaveImageOptions& options) {
  const bool dithers = bits == 8 && options.dither;
  return {bits, dithers ? Dither::on : Dither::off, options.threads, png_texts(options)};
}

std::vector<std::byte> png_of(const Image& image, int bits, const SaveImageOptions& options) {
  std::vector<std::byte> bytes;
  write_png(image, png_options(bits, options), "memory", [&](std::string_view piece) {
    const auto* const data = reinterpret_cast<const std::byte*>(piece.data());
    bytes.insert(bytes.end(), data, data + piece.size());
  });
  return bytes;
}

void save_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& path) {
  save_text(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void save_image(const Image& image, const std::filesystem::path& path,
                const SaveImageOptions& options) {
  check_image(image);
  check_options(options);
  check_extension(path, options.format);
  if (is_exr(options.format)) return save_exr(image, path, options);
  if (options.format == ImageFormat::png16 || options.format == ImageFormat::png8) {
    return save_png(image, path,
                    png_options(options.format == ImageFormat::png8 ? 8 : 16, options));
  }
  save_bytes(encode(image, options), path);
}

namespace {

class PngFileRows : public ImageRows {
 public:
  PngFileRows(const ImageShape& shape, const std::filesystem::path& path, const PngOptions& options)
      : file_(path),
        rows_(shape, options, DitherBlocks(Image(), options.dither), path.string(),
              [this](std::string_view bytes) { file_.write(bytes); }) {}

  void put(const Image& rows) override { rows_.put(rows); }
  void commit() override {
    rows_.finish();
    file_.commit();
  }

 private:
  AtomicFile file_;
  PngRows rows_;
};

}  // namespace

bool writes_rows(ImageFormat format) {
  return is_exr(format) || format == ImageFormat::png16 || format == ImageFormat::png8;
}

std::unique_ptr<ImageRows> save_image_rows(const ImageShape& shape,
                                           const std::filesystem::path& path,
                                           const SaveImageOptions& options) {
  check_shape(shape);
  check_options(options);
  check_extension(path, options.format);
  if (is_exr(options.format)) return save_exr_rows(shape, path, options);
  if (!writes_rows(options.format)) {
    throw Error(ErrorCode::usage, "Only PNG and OpenEXR files are written row by row.");
  }
  return std::make_unique<PngFileRows>(
      shape, path, png_options(options.format == ImageFormat::png8 ? 8 : 16, options));
}

std::vector<std::byte> encode(const Image& image, const SaveImageOptions& options) {
  check_image(image);
  check_options(options);
  const std::array<const Image*, 1> level = {&image};
  switch (options.format) {
    case ImageFormat::exr_half:
    case ImageFormat::exr_float:
      return encode_exr(image, options);
    case ImageFormat::png16:
      return png_of(image, 16, options);
    case ImageFormat::png8:
      return png_of(image, 8, options);
    case ImageFormat::tiff16:
      return tiff_of(image, 16);
    case ImageFormat::tiff8:
      return tiff_of(image, 8);
    case ImageFormat::tiff_float:
      return tiff_of(image, 32);
    case ImageFormat::tga:
      return encode_tga(image, options.dither);
    case ImageFormat::webp:
      return webp_of(image, options.dither);
    case ImageFormat::ktx2:
      return encode_ktx2(level, options.use);
    case ImageFormat::dds:
      return encode_dds(level, options.use);
  }
  throw Error(ErrorCode::usage, "SaveImageOptions::format is none of ImageFormat.", "option-enum");
}

std::vector<std::byte> encode_picture(const Image& image, const PictureEncoding& encoding) {
  check_image(image);
  PictureEncoding rounded_encoding = encoding;
  if (encoding.is_lossy()) rounded_encoding.dither = Dither::off;
  switch (encoding.format) {
    case PictureFormat::webp:
#ifdef KILN_HAS_WEBP
      return encode_webp(image, rounded_encoding);
#else
      fail_for_missing_library("WebP", "libwebp", "KILN_WEBP");
#endif
    case PictureFormat::jpeg:
#ifdef KILN_HAS_JPEG
      return encode_jpeg(image, rounded_encoding);
#else
      fail_for_missing_library("JPEG", "libjpeg", "KILN_JPEG");
#endif
    case PictureFormat::png:
      break;
  }
  PngOptions options{.bits = 8, .dither = rounded_encoding.dither, .use = rounded_encoding.use};
  options.deflate = rounded_encoding.smallest ? Deflate::smallest : Deflate::small;
  std::vector<std::byte> bytes;
  write_png(image, options, "memory", [&](std::string_view piece) {
    const auto* const data = reinterpret_cast<const std::byte*>(piece.data());
    bytes.insert(bytes.end(), data, data + piece.size());
  });
  return bytes;
}

StoredError stored_error(const Image& image, const SaveImageOptions& options,
                         std::span<const std::uint8_t> coverage) {
  check_image(image);
  if (!coverage.empty() && coverage.size() != std::size_t{image.width} * image.height) {
    throw Error(ErrorCode::usage,
                "stored_error(): the coverage and the image have different sizes.");
  }
  const ImageFormat format = options.format;
  const bool is_8_bit = format == ImageFormat::png8 || format == ImageFormat::tiff8 ||
                        format == ImageFormat::tga || format == ImageFormat::webp ||
                        is_texture(format);
  return is_8_bit ? error_of_stored(image, options, coverage) : StoredError();
}

Image load_image(std::span<const std::byte> bytes, std::string_view name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return parse_image(*bytes_in_memory(text), std::string(name));
}

void save_mipmapped(const Image& image, const std::vector<Image>& mips,
                    const std::filesystem::path& path, const SaveImageOptions& options) {
  check_image(image);
  check_options(options);
  check_mips(image, mips);
  std::vector<const Image*> levels = {&image};
  for (const Image& level : mips) levels.push_back(&level);
  if (is_texture(options.format)) {
    check_extension(path, options.format);
    return save_bytes(options.format == ImageFormat::dds ? encode_dds(levels, options.use)
                                                         : encode_ktx2(levels, options.use),
                      path);
  }
  if (!is_exr(options.format)) {
    throw Error(
        ErrorCode::usage,
        "PNG, TIFF, TGA and WebP hold one image, not mip-maps: save each level as a file of "
        "its own, or use OpenEXR, KTX 2 or DDS.");
  }
  save_exr_mips(levels, path, options);
}

}  // namespace kiln
