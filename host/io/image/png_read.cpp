#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "io/image/image_reader.h"

namespace kiln {
namespace {

// libpng reports errors by longjmp(), which must not skip destructors. So all objects with
// destructors are members of this struct, which lives outside of the functions that call setjmp().
struct PngReader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  const ByteSource* source = nullptr;
  std::uint64_t at = 0;
  std::exception_ptr error;  // Exception that the source has thrown
  char message[256] = "damaged";
  png_uint_32 width = 0, height = 0;
  int channels = 0, bits = 0, passes = 0;
  std::size_t row_bytes = 0;

  PngReader() = default;
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

[[noreturn]] void on_error(png_structp png, png_const_charp text) {
  auto* reader = static_cast<PngReader*>(png_get_error_ptr(png));
  std::snprintf(reader->message, sizeof(reader->message), "%s", text);
  png_longjmp(png, 1);
}

// Warnings concern colour profiles and comments, which are not used.
void on_warning(png_structp, png_const_charp) {}

// Exceptions must not pass through libpng.
void on_read(png_structp png, png_bytep to, std::size_t count) {
  auto* reader = static_cast<PngReader*>(png_get_io_ptr(png));
  std::size_t got = 0;
  try {
    got = reader->source->read_at(reader->at, to, count);
  } catch (...) {
    reader->error = std::current_exception();
  }
  reader->at += got;
  if (got != count) png_error(png, "the file is cut short");
}

bool read_header(PngReader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, on_read);
  png_set_user_limits(reader.png, kLargestImageSide, kLargestImageSide);
  png_set_chunk_malloc_max(reader.png, 8000000);
  // Text, profiles and other ancillary chunks are skipped: libpng would keep up to a thousand
  // texts, each unpacked to 8 MB.
  png_set_keep_unknown_chunks(reader.png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(reader.png, reader.info);
  // Converts palettes to RGB, fewer than 8 bits to 8, and transparency to an alpha channel
  png_set_expand(reader.png);
  if (std::endian::native == std::endian::little) png_set_swap(reader.png);
  reader.passes = png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  reader.width = png_get_image_width(reader.png, reader.info);
  reader.height = png_get_image_height(reader.png, reader.info);
  reader.channels = png_get_channels(reader.png, reader.info);
  reader.bits = png_get_bit_depth(reader.png, reader.info);
  reader.row_bytes = png_get_rowbytes(reader.png, reader.info);
  return true;
}

// Reads the next `count` rows into `rows`.
bool read_rows(PngReader& reader, std::uint8_t* rows, std::size_t count) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  for (std::size_t y = 0; y < count; ++y) {
    png_read_row(reader.png, rows + y * reader.row_bytes, nullptr);
  }
  return true;
}

bool read_end(PngReader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_end(reader.png, nullptr);
  return true;
}

void to_floats(const PngReader& reader, const std::uint8_t* row, float* to) {
  const std::size_t count = std::size_t{reader.width} * static_cast<std::size_t>(reader.channels);
  if (reader.bits == 16) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint16_t value = 0;
      std::memcpy(&value, row + 2 * i, sizeof(value));
      to[i] = static_cast<float>(value) / 65535.0F;
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<float>(row[i]) / 255.0F;
  }
}

// Bytes of memory for the pixels, and for rows before they are converted to floats.
std::uint64_t memory_for(const PngReader& reader, std::size_t band) {
  return std::uint64_t{reader.width} * reader.height * static_cast<unsigned>(reader.channels) *
             sizeof(float) +
         std::uint64_t{band} * reader.row_bytes;
}

}  // namespace

Image parse_png(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const FailWith fail = image_failure(file, "PNG");
  check_png(source, fail, limits);
  PngReader reader;
  reader.source = &source;
  const auto check = [&](bool good) {
    if (good) return;
    if (reader.error) std::rethrow_exception(reader.error);
    fail("", reader.message, "Export or copy the file again.");
  };
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_error, on_warning);
  if (reader.png != nullptr) reader.info = png_create_info_struct(reader.png);
  if (reader.info == nullptr) throw std::bad_alloc();
  check(read_header(reader));

  // An interlaced image needs all rows in memory and several passes. Other images are read in bands
  // of rows.
  const std::size_t band = reader.passes > 1 ? reader.height : std::min(reader.height, 256U);
  require_memory(
      "its " + std::to_string(reader.width) + " x " + std::to_string(reader.height) + " pixels",
      memory_for(reader, band), memory_failure(fail, "IHDR"));
  Image image;
  image.width = reader.width;
  image.height = reader.height;
  image.channels = static_cast<std::uint32_t>(reader.channels);
  image.pixels.resize(std::size_t{image.width} * image.height * image.channels);

  std::vector<std::uint8_t> rows(band * reader.row_bytes);
  for (std::size_t first = 0; first < image.height; first += band) {
    const std::size_t count = std::min<std::size_t>(band, image.height - first);
    for (int pass = 0; pass < reader.passes; ++pass) {
      check(read_rows(reader, rows.data(), count));
    }
    parallel_for(count, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        to_floats(reader, rows.data() + y * reader.row_bytes, image.at(0, first + y));
      }
    });
  }
  check(read_end(reader));
  return image;
}

}  // namespace kiln
