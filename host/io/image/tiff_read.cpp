// TIFF by libtiff.
#include <ImathConfig.h>
#include <half.h>
#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/memory.h"
#include "io/file/text_scanner.h"
#include "io/image/picture.h"

namespace kiln {
namespace {

/// The file's bytes for libtiff's callbacks, and the messages of libtiff.
struct Tiff {
  const ByteSource& source;
  std::uint64_t at = 0;
  std::exception_ptr error;  // Exception that the source has thrown
  std::string message, warning;
  TIFF* file = nullptr;

  explicit Tiff(const ByteSource& bytes) : source(bytes) {}
  Tiff(const Tiff&) = delete;
  Tiff& operator=(const Tiff&) = delete;
  ~Tiff() {
    if (file != nullptr) TIFFClose(file);
  }
};

[[gnu::format(printf, 1, 0)]] std::string formatted(const char* format, va_list arguments) {
  char text[256] = "";
  std::vsnprintf(text, sizeof text, format, arguments);
  std::string words = text;
  while (!words.empty() && (words.back() == '.' || words.back() == '\n')) words.pop_back();
  return words;
}

// Stores a message. Returns 1, so that libtiff's own handlers, which print, are not called. Only
// the first message is kept, since it is the most specific.
[[gnu::format(printf, 4, 0)]] int on_error(TIFF* /*file*/, void* user, const char* /*module*/,
                                           const char* format, va_list arguments) {
  auto& tiff = *static_cast<Tiff*>(user);
  if (tiff.message.empty()) tiff.message = formatted(format, arguments);
  return 1;
}
[[gnu::format(printf, 4, 0)]] int on_warning(TIFF* /*file*/, void* user, const char* /*module*/,
                                             const char* format, va_list arguments) {
  auto& tiff = *static_cast<Tiff*>(user);
  if (tiff.warning.empty()) tiff.warning = formatted(format, arguments);
  return 1;
}

// Exceptions must not pass through libtiff.
tmsize_t on_read(thandle_t user, void* to, tmsize_t count) {
  auto& tiff = *static_cast<Tiff*>(user);
  try {
    const std::size_t read_bytes =
        tiff.source.read_at(tiff.at, to, static_cast<std::size_t>(count));
    tiff.at += read_bytes;
    return static_cast<tmsize_t>(read_bytes);
  } catch (...) {
    tiff.error = std::current_exception();
    return -1;
  }
}
tmsize_t on_write(thandle_t /*user*/, void* /*from*/, tmsize_t /*count*/) { return -1; }
toff_t on_seek(thandle_t user, toff_t offset, int from) {
  auto& tiff = *static_cast<Tiff*>(user);
  if (from == SEEK_CUR) offset += tiff.at;
  if (from == SEEK_END) offset += tiff.source.size();
  return tiff.at = offset;
}
int on_close(thandle_t /*user*/) { return 0; }
toff_t on_size(thandle_t user) { return static_cast<Tiff*>(user)->source.size(); }

void open(Tiff& tiff) {
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  if (options == nullptr) throw std::bad_alloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &tiff);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, &tiff);
  // "m" in the mode turns off memory mapping.
  tiff.file = TIFFClientOpenExt("", "rm", &tiff, on_read, on_write, on_seek, on_close, on_size,
                                nullptr, nullptr, options.get());
}

template <typename T>
T tag_value(TIFF* file, std::uint32_t tag) {
  T value{};
  TIFFGetFieldDefaulted(file, tag, &value);
  return value;
}

/// The tags of a TIFF that describe its pixels.
struct PixelLayout {
  std::uint32_t width = 0, height = 0;
  std::uint16_t samples = 0, bits = 0, format = 0, colours = 0, planes = 0, packing = 0,
                orientation = 0;
  bool has_alpha = false, premultiplied = false;
  std::uint32_t block_width = 0, block_height = 0;  ///< Size of a strip or a tile
  bool tiled = false;

  std::uint32_t colour_channels() const {
    return colours == PHOTOMETRIC_RGB || colours == PHOTOMETRIC_PALETTE ||
                   colours == PHOTOMETRIC_YCBCR
               ? 3
               : 1;
  }
  std::uint32_t channels() const { return colour_channels() + (has_alpha ? 1 : 0); }
};

PixelLayout read_layout(TIFF* file) {
  PixelLayout pixel_layout;
  pixel_layout.width = tag_value<std::uint32_t>(file, TIFFTAG_IMAGEWIDTH);
  pixel_layout.height = tag_value<std::uint32_t>(file, TIFFTAG_IMAGELENGTH);
  pixel_layout.samples = tag_value<std::uint16_t>(file, TIFFTAG_SAMPLESPERPIXEL);
  pixel_layout.bits = tag_value<std::uint16_t>(file, TIFFTAG_BITSPERSAMPLE);
  pixel_layout.format = tag_value<std::uint16_t>(file, TIFFTAG_SAMPLEFORMAT);
  pixel_layout.colours = tag_value<std::uint16_t>(file, TIFFTAG_PHOTOMETRIC);
  pixel_layout.planes = tag_value<std::uint16_t>(file, TIFFTAG_PLANARCONFIG);
  pixel_layout.packing = tag_value<std::uint16_t>(file, TIFFTAG_COMPRESSION);
  pixel_layout.orientation = tag_value<std::uint16_t>(file, TIFFTAG_ORIENTATION);
  if (pixel_layout.format == SAMPLEFORMAT_VOID) pixel_layout.format = SAMPLEFORMAT_UINT;
  std::uint16_t count = 0;
  std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(file, TIFFTAG_EXTRASAMPLES, &count, &kinds);
  const std::uint32_t stored =
      pixel_layout.colours == PHOTOMETRIC_PALETTE ? 1 : pixel_layout.colour_channels();
  pixel_layout.has_alpha = pixel_layout.samples == stored + 1;
  pixel_layout.premultiplied =
      pixel_layout.has_alpha && count == 1 && kinds[0] == EXTRASAMPLE_ASSOCALPHA;
  pixel_layout.tiled = TIFFIsTiled(file) != 0;
  if (pixel_layout.tiled) {
    pixel_layout.block_width = tag_value<std::uint32_t>(file, TIFFTAG_TILEWIDTH);
    pixel_layout.block_height = tag_value<std::uint32_t>(file, TIFFTAG_TILELENGTH);
  } else {
    pixel_layout.block_width = pixel_layout.width;
    pixel_layout.block_height =
        std::min(tag_value<std::uint32_t>(file, TIFFTAG_ROWSPERSTRIP), pixel_layout.height);
  }
  return pixel_layout;
}

/// Refuses pixel formats that would be read wrongly.
/// \param heights  true: signed numbers are accepted
void check_kind(const PixelLayout& pixel_layout, bool heights, const FailWith& fail) {
  const std::string conversion_remedy = "Save it as RGB or grey, or convert it to PNG or OpenEXR.";
  const std::uint16_t colours = pixel_layout.colours;
  if (colours == PHOTOMETRIC_SEPARATED) {
    fail("PhotometricInterpretation", "its colours are CMYK, for printing", "Convert it to RGB.");
  }
  const bool grey = colours == PHOTOMETRIC_MINISBLACK || colours == PHOTOMETRIC_MINISWHITE;
  const bool from_jpeg = colours == PHOTOMETRIC_YCBCR && pixel_layout.packing == COMPRESSION_JPEG;
  if (!grey && !from_jpeg && colours != PHOTOMETRIC_RGB && colours != PHOTOMETRIC_PALETTE) {
    fail("PhotometricInterpretation",
         "its colours are of kind " + std::to_string(colours) + ", which Kiln does not read",
         conversion_remedy);
  }
  const std::uint32_t stored = colours == PHOTOMETRIC_PALETTE ? 1 : pixel_layout.colour_channels();
  if (pixel_layout.samples != stored && !pixel_layout.has_alpha) {
    fail("SamplesPerPixel",
         "it has " + std::to_string(pixel_layout.samples) +
             " samples per pixel, and its colour space " + std::to_string(stored) +
             ": only one more, for alpha, is supported",
         conversion_remedy);
  }
  const std::uint16_t bits = pixel_layout.bits;
  const bool numbers =
      pixel_layout.format == SAMPLEFORMAT_UINT &&
      (bits == 1 || bits == 2 || bits == 4 || bits == 8 || bits == 16 || bits == 32);
  const bool floats =
      pixel_layout.format == SAMPLEFORMAT_IEEEFP && (bits == 16 || bits == 32 || bits == 64);
  const bool is_signed = heights && pixel_layout.format == SAMPLEFORMAT_INT &&
                         (bits == 8 || bits == 16 || bits == 32) && colours != PHOTOMETRIC_PALETTE;
  if ((!numbers && !floats && !is_signed) ||
      (colours == PHOTOMETRIC_PALETTE && (floats || bits > 16))) {
    fail("BitsPerSample",
         "its values are " +
             std::string(pixel_layout.format == SAMPLEFORMAT_IEEEFP ? "floats"
                         : pixel_layout.format == SAMPLEFORMAT_UINT ? "unsigned numbers"
                         : pixel_layout.format == SAMPLEFORMAT_INT  ? "signed numbers"
                                                                   : "numbers of an unknown kind") +
             " of " + std::to_string(bits) + " bits, which Kiln does not read",
         "Save it with unsigned numbers of 8 or 16 bits, or floats of 32.");
  }
  if (pixel_layout.planes != PLANARCONFIG_CONTIG && pixel_layout.planes != PLANARCONFIG_SEPARATE) {
    fail("PlanarConfiguration", "damaged", "Export or copy the file again.");
  }
  if (pixel_layout.block_width == 0 || pixel_layout.block_height == 0) {
    fail("header", "its strips or tiles are empty", "Export or copy the file again.");
  }
}

/// Largest number of unpacked bytes per packed byte; 0 if no useful bound exists.
std::uint64_t max_unpack_ratio(std::uint16_t packing) {
  switch (packing) {
    case COMPRESSION_NONE:
      return 1;
    case COMPRESSION_PACKBITS:
      return 64;  // 2 bytes encode a run of at most 128 bytes
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
      return max_unpacked_bytes(Packing::deflate, 1);
    case COMPRESSION_LZW:
      // LZW: at best, a code of 12 bits encodes a string of as many bytes as its table has entries
      return 4096;
    default:
      return 0;
  }
}

/// A value of a row that libtiff has already converted to the machine's byte order.
double value_at(const std::uint8_t* row, std::size_t i, const PixelLayout& pixel_layout) {
  const auto as = [&]<typename T>(T value) {
    std::memcpy(&value, row + i * sizeof(T), sizeof(T));
    return value;
  };
  if (pixel_layout.format == SAMPLEFORMAT_IEEEFP) {
    if (pixel_layout.bits == 64) return as(double{});
    if (pixel_layout.bits == 32) return double{as(float{})};
    half value;
    value.setBits(as(std::uint16_t{}));
    return double{static_cast<float>(value)};
  }
  if (pixel_layout.format == SAMPLEFORMAT_INT) {
    if (pixel_layout.bits == 32) return as(std::int32_t{});
    if (pixel_layout.bits == 16) return as(std::int16_t{});
    return as(std::int8_t{});
  }
  switch (pixel_layout.bits) {
    case 32:
      return as(std::uint32_t{});
    case 16:
      return as(std::uint16_t{});
    case 8:
      return row[i];
    default: {  // Several values per byte, the first in the highest bits
      const std::size_t bit = i * pixel_layout.bits;
      return (row[bit / 8] >> (8U - pixel_layout.bits - bit % 8)) &
             ((1U << pixel_layout.bits) - 1U);
    }
  }
}

/// Converts the numbers in a file to the values of an image.
class ValueReader {
 public:
  /// \param unscaled  true: integers are not scaled to [0, 1]
  ValueReader(TIFF* file, const PixelLayout& pixel_layout, bool unscaled)
      : layout_(pixel_layout), unscaled_(unscaled) {
    max_value_ = pixel_layout.format == SAMPLEFORMAT_IEEEFP || unscaled
                     ? 1
                     : static_cast<double>((std::uint64_t{1} << pixel_layout.bits) - 1);
    if (pixel_layout.colours == PHOTOMETRIC_PALETTE) {
      has_palette_ =
          TIFFGetField(file, TIFFTAG_COLORMAP, &palette_[0], &palette_[1], &palette_[2]) != 0;
    }
  }
  double largest() const { return max_value_; }
  bool palette_is_missing() const {
    return layout_.colours == PHOTOMETRIC_PALETTE && !has_palette_;
  }

  /// Stores a sample of the file in a pixel.
  void put(double value, std::uint32_t sample, float* pixel) const {
    if (layout_.colours == PHOTOMETRIC_PALETTE && sample == 0) {
      const auto entry = static_cast<std::size_t>(value);
      for (std::size_t k = 0; k < 3; ++k) {
        pixel[k] = static_cast<float>(palette_[k][entry] / 65535.0);
      }
      return;
    }
    const std::uint32_t channel = layout_.colours == PHOTOMETRIC_PALETTE ? 3 : sample;
    if (layout_.colours == PHOTOMETRIC_MINISWHITE && sample == 0 && !unscaled_) {
      value = max_value_ - value;
    }
    pixel[channel] = static_cast<float>(value / max_value_);
  }

 private:
  const PixelLayout& layout_;
  bool unscaled_;
  double max_value_ = 1;
  std::uint16_t* palette_[3] =
      {};  // Palettes of red, green and blue, with 2^bits entries each; libtiff owns them
  bool has_palette_ = false;
};

/// Reads all strips or tiles into the image. Returns false if libtiff failed.
bool read_blocks(Tiff& tiff, const PixelLayout& pixel_layout, const ValueReader& values,
                 Image& image) {
  const bool has_separate_planes = pixel_layout.planes == PLANARCONFIG_SEPARATE;
  const std::uint32_t samples_per_block = has_separate_planes ? 1 : pixel_layout.samples;
  const tmsize_t max_block_bytes =
      pixel_layout.tiled ? TIFFTileSize(tiff.file) : TIFFStripSize(tiff.file);
  const tmsize_t row_bytes = pixel_layout.tiled    ? TIFFTileRowSize(tiff.file)
                             : has_separate_planes ? TIFFScanlineSize(tiff.file)
                                                   : TIFFScanlineSize(tiff.file);
  if (max_block_bytes <= 0 || row_bytes <= 0) return false;
  std::vector<std::uint8_t> block(static_cast<std::size_t>(max_block_bytes));
  for (std::uint32_t plane = 0; plane < (has_separate_planes ? pixel_layout.samples : 1U);
       ++plane) {
    for (std::uint32_t y = 0; y < image.height; y += pixel_layout.block_height) {
      const std::uint32_t rows = std::min(pixel_layout.block_height, image.height - y);
      for (std::uint32_t x = 0; x < image.width; x += pixel_layout.block_width) {
        const auto sample = static_cast<std::uint16_t>(plane);
        const tmsize_t wanted_bytes =
            pixel_layout.tiled ? max_block_bytes : static_cast<tmsize_t>(rows) * row_bytes;
        const tmsize_t read_bytes =
            pixel_layout.tiled
                ? TIFFReadEncodedTile(tiff.file, TIFFComputeTile(tiff.file, x, y, 0, sample),
                                      block.data(), wanted_bytes)
                : TIFFReadEncodedStrip(tiff.file, TIFFComputeStrip(tiff.file, y, sample),
                                       block.data(), wanted_bytes);
        // With some compression methods, libtiff invents missing data and only warns.
        if (read_bytes != wanted_bytes || !tiff.warning.empty()) return false;
        const std::uint32_t columns = std::min(pixel_layout.block_width, image.width - x);
        for (std::uint32_t r = 0; r < rows; ++r) {
          const std::uint8_t* const row = block.data() + static_cast<std::size_t>(row_bytes) * r;
          for (std::uint32_t c = 0; c < columns; ++c) {
            float* const pixel = image.at(x + c, y + r);
            for (std::uint32_t s = 0; s < samples_per_block; ++s) {
              values.put(value_at(row, std::size_t{c} * samples_per_block + s, pixel_layout),
                         plane + s, pixel);
            }
          }
        }
      }
    }
  }
  return true;
}

void divide_by_alpha(Image& image) {
  const std::size_t colours = image.channels - 1;
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
    const float alpha = image.pixels[i + colours];
    if (!(alpha > 0)) continue;
    for (std::size_t k = 0; k < colours; ++k) image.pixels[i + k] /= alpha;
  }
}

/// Applies the tag Orientation, so that row 0 is the top row and column 0 the left one.
Image apply_orientation(Image image, std::uint16_t orientation) {
  const bool transposed = orientation >= ORIENTATION_LEFTTOP;
  const bool is_right_to_left =
      orientation == ORIENTATION_TOPRIGHT || orientation == ORIENTATION_BOTRIGHT ||
      orientation == ORIENTATION_RIGHTTOP || orientation == ORIENTATION_RIGHTBOT;
  const bool is_bottom_up =
      orientation == ORIENTATION_BOTLEFT || orientation == ORIENTATION_BOTRIGHT ||
      orientation == ORIENTATION_LEFTBOT || orientation == ORIENTATION_RIGHTBOT;
  if (!transposed && !is_right_to_left && !is_bottom_up) return image;
  Image oriented_image = image;
  if (transposed) std::swap(oriented_image.width, oriented_image.height);
  for (std::size_t y = 0; y < oriented_image.height; ++y) {
    for (std::size_t x = 0; x < oriented_image.width; ++x) {
      const std::size_t u = is_right_to_left ? oriented_image.width - 1 - x : x;
      const std::size_t v = is_bottom_up ? oriented_image.height - 1 - y : y;
      std::copy_n(transposed ? image.at(v, u) : image.at(u, v), image.channels,
                  oriented_image.at(x, y));
    }
  }
  return oriented_image;
}

}  // namespace

bool tiff_holds_floats(const ByteSource& source) {
  Tiff tiff(source);
  open(tiff);
  return tiff.file != nullptr &&
         tag_value<std::uint16_t>(tiff.file, TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_IEEEFP;
}

namespace {

// Tags of GeoTIFF 1.1 and of GDAL, and keys of GeoTIFF.
constexpr std::uint32_t kPixelScale = 33550, kTiePoint = 33922, kTransformation = 34264,
                        kGeoKeys = 34735, kGdalNoData = 42113;
constexpr unsigned kModelType = 1024, kLengthUnit = 3076, kHeightUnit = 4099;
constexpr unsigned kGeographic = 2;

/// The values of a tag that libtiff does not know; empty if it is missing or has another type.
template <typename T>
std::span<const T> values_of(TIFF* file, std::uint32_t tag, TIFFDataType type) {
  const TIFFField* const field = TIFFFindField(file, tag, TIFF_ANY);
  if (field == nullptr || TIFFFieldDataType(field) != type || TIFFFieldPassCount(field) == 0) {
    return {};
  }
  const void* data = nullptr;
  if (TIFFFieldReadCount(field) == TIFF_VARIABLE2) {
    std::uint32_t count = 0;
    if (TIFFGetField(file, tag, &count, &data) == 0) return {};
    return {static_cast<const T*>(data), count};
  }
  std::uint16_t count = 0;
  if (TIFFGetField(file, tag, &count, &data) == 0) return {};
  return {static_cast<const T*>(data), count};
}

/// \returns true if any geographic tag exists
bool read_geography(TIFF* file, TiffGeography& geography) {
  bool any = false;
  if (const auto scale = values_of<double>(file, kPixelScale, TIFF_DOUBLE); scale.size() >= 2) {
    any = true;
    geography.spacing = {std::abs(scale[0]), std::abs(scale[1])};
  }
  if (const auto tie_point = values_of<double>(file, kTiePoint, TIFF_DOUBLE);
      tie_point.size() >= 6) {
    any = true;
    geography.top = tie_point[4] + tie_point[1] * geography.spacing[1];
  }
  const auto map = values_of<double>(file, kTransformation, TIFF_DOUBLE);
  if (map.size() >= 16) {  // In a rotated grid, the matrix gives the directions of rows and columns
    any = true;
    geography.spacing = {std::hypot(map[0], map[4]), std::hypot(map[1], map[5])};
    geography.top = map[7];
  }
  for (double& side : geography.spacing) {
    if (!std::isfinite(side)) side = 0;
  }
  if (geography.spacing[0] == 0 || geography.spacing[1] == 0) geography.spacing = {};
  const auto keys = values_of<std::uint16_t>(file, kGeoKeys, TIFF_SHORT);
  for (std::size_t k = 4; k + 4 <= keys.size(); k += 4) {
    any = true;
    // The values of other keys are stored in other tags, whose numbers are not 0
    if (keys[k + 1] != 0) continue;
    if (keys[k] == kModelType) geography.is_degrees = keys[k + 3] == kGeographic;
    if (keys[k] == kLengthUnit) geography.length_unit = keys[k + 3];
    if (keys[k] == kHeightUnit) geography.height_unit = keys[k + 3];
  }
  if (const auto text = values_of<char>(file, kGdalNoData, TIFF_ASCII); !text.empty()) {
    any = true;
    std::string_view word(text.data(), text.size());
    word = word.substr(0, word.find('\0'));
    TextScanner scan(word);
    geography.no_data = to_double(scan.token_in_line());
  }
  return any;
}

/// \param geography  [out] metadata of a height field; null for other pictures
Image parse(const ByteSource& source, const std::string& file, const ImageLimits& limits,
            TiffGeography* geography) {
  const FailWith fail = image_failure(file, "TIFF");
  const std::string export_again =
      "Export or copy the file again, or convert it to PNG or OpenEXR.";
  Tiff tiff(source);
  const auto fail_by_libtiff = [&](const std::string& place) {
    if (tiff.error) std::rethrow_exception(tiff.error);
    const std::string& library_message = tiff.message.empty() ? tiff.warning : tiff.message;
    fail(place, library_message.empty() ? "damaged or cut short" : library_message, export_again);
  };
  open(tiff);
  if (tiff.file == nullptr) fail_by_libtiff("header");
  const PixelLayout pixel_layout = read_layout(tiff.file);
  check_kind(pixel_layout, geography != nullptr, fail);
  const bool has_geography = geography != nullptr && read_geography(tiff.file, *geography);
  const ValueReader values(
      tiff.file, pixel_layout,
      has_geography || (geography != nullptr && pixel_layout.format == SAMPLEFORMAT_INT));
  if (geography != nullptr) geography->largest = values.largest();
  if (values.palette_is_missing()) fail("ColorMap", "it is missing", export_again);
  if (pixel_layout.packing == COMPRESSION_JPEG) {
    TIFFSetField(tiff.file, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  }
  if (TIFFIsCODECConfigured(pixel_layout.packing) == 0) {
    fail("Compression", "libtiff does not read kind " + std::to_string(pixel_layout.packing),
         export_again);
  }
  const std::uint64_t pixels = std::uint64_t{pixel_layout.width} * pixel_layout.height;
  const std::uint64_t ratio = max_unpack_ratio(pixel_layout.packing);
  if (ratio != 0 && saturated_product(pixels, pixel_layout.samples) / 8 * pixel_layout.bits >
                        saturated_product(source.size(), ratio)) {
    fail("header",
         "it says " + std::to_string(pixel_layout.width) + " x " +
             std::to_string(pixel_layout.height) + " pixels, but its " +
             std::to_string(source.size()) + " bytes cannot hold them",
         "Export or copy the file again.");
  }
  // Working memory: a strip or tile, packed and unpacked, and a second image if the orientation
  // must be changed.
  const auto block = static_cast<std::uint64_t>(std::max<tmsize_t>(
      0, pixel_layout.tiled ? TIFFTileSize(tiff.file) : TIFFStripSize(tiff.file)));
  const bool changes_orientation = pixel_layout.orientation > ORIENTATION_TOPLEFT;
  const std::uint64_t working =
      2 * block + (changes_orientation
                       ? saturated_product(pixels, pixel_layout.channels() * sizeof(float))
                       : 0);
  Image image = empty_image(pixel_layout.width, pixel_layout.height, pixel_layout.channels(),
                            working, "header", limits, fail);
  tiff.warning.clear();  // Discards warnings about unknown tags
  if (!read_blocks(tiff, pixel_layout, values, image)) fail_by_libtiff("pixels");
  if (pixel_layout.premultiplied) divide_by_alpha(image);
  return apply_orientation(std::move(image), pixel_layout.orientation);
}

}  // namespace

Image parse_tiff(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  return parse(source, file, limits, nullptr);
}

Image parse_tiff_heights(const ByteSource& source, const std::string& file,
                         TiffGeography& geography, const ImageLimits& limits) {
  return parse(source, file, limits, &geography);
}

}  // namespace kiln
