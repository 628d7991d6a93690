// JPEG by libjpeg(-turbo).
#include <csetjmp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>
// jpeglib.h uses FILE and size_t, which <cstdio> must have declared before.
#include <jerror.h>
#include <jpeglib.h>

#include "io/image/picture.h"

namespace kiln {
namespace {

/// Maximum number of scans of a progressive file. A scan may have only a few bytes, but takes a
/// pass over the whole image.
constexpr int kMaxScans = 500;

// libjpeg reports errors through a function that must not return, so it calls longjmp(). That must
// not skip destructors, so all objects with destructors are members of this struct, which lives
// outside of the functions that call setjmp().
struct Jpeg {
  jpeg_error_mgr errors{};  // Must be the first member, since the struct is found by its address
  jpeg_decompress_struct info{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump_target{};
  char message[JMSG_LENGTH_MAX] = "damaged";

  Jpeg() = default;
  Jpeg(const Jpeg&) = delete;
  Jpeg& operator=(const Jpeg&) = delete;
  ~Jpeg() { jpeg_destroy_decompress(&info); }
};

Jpeg& jpeg_of(j_common_ptr info) { return *reinterpret_cast<Jpeg*>(info->err); }

[[noreturn]] void stop(j_common_ptr info) {
  Jpeg& jpeg = jpeg_of(info);
  info->err->format_message(info, jpeg.message);
  std::longjmp(jpeg.jump_target, 1);
}

// Treats warnings as errors. Most of them say that libjpeg invented pixels, and a map that is
// partly grey would seem to be valid.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;  // Trace messages are ignored
  const int code = info->err->msg_code;
  if (code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR) return;
  stop(info);
}

void ignore_message(j_common_ptr /*info*/) {}

void on_progress(j_common_ptr info) {
  const auto* const decompress = reinterpret_cast<j_decompress_ptr>(info);
  Jpeg& jpeg = jpeg_of(info);
  if (decompress->input_scan_number <= kMaxScans) return;
  std::snprintf(jpeg.message, sizeof jpeg.message, "it has more than %d scans", kMaxScans);
  std::longjmp(jpeg.jump_target, 1);
}

bool read_header(Jpeg& jpeg, const std::string& bytes) {
  if (setjmp(jpeg.jump_target)) return false;
  jpeg_create_decompress(&jpeg.info);
  jpeg.progress.progress_monitor = on_progress;
  jpeg.info.progress = &jpeg.progress;
  jpeg_mem_src(&jpeg.info, reinterpret_cast<const unsigned char*>(bytes.data()),
               static_cast<unsigned long>(bytes.size()));
  jpeg_read_header(&jpeg.info, TRUE);
  return true;
}

bool read_pixels(Jpeg& jpeg, std::uint8_t* rows, std::size_t row_bytes) {
  if (setjmp(jpeg.jump_target)) return false;
  jpeg_start_decompress(&jpeg.info);
  while (jpeg.info.output_scanline < jpeg.info.output_height) {
    JSAMPROW row = rows + jpeg.info.output_scanline * row_bytes;
    jpeg_read_scanlines(&jpeg.info, &row, 1);
  }
  jpeg_finish_decompress(&jpeg.info);
  return true;
}

}  // namespace

Image parse_jpeg(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const FailWith fail = image_failure(file, "JPEG");
  const std::string bytes = read_whole(source, fail);
  Jpeg jpeg;
  jpeg_std_error(&jpeg.errors);
  jpeg.errors.error_exit = stop;
  jpeg.errors.emit_message = on_message;
  jpeg.errors.output_message = ignore_message;
  jpeg.info.err = &jpeg.errors;
  const auto check = [&](bool good) {
    if (good) return;
    fail("", jpeg.message, "Export or copy the file again, or convert it to PNG.");
  };
  check(read_header(jpeg, bytes));

  if (jpeg.info.jpeg_color_space == JCS_CMYK || jpeg.info.jpeg_color_space == JCS_YCCK) {
    fail("header", "its colours are CMYK, for printing", "Convert it to RGB.");
  }
  if (jpeg.info.arith_code != FALSE) {
    fail("header", "its coding is arithmetic", "Save it again as a usual JPEG, or as PNG.");
  }
  const std::uint32_t channels = jpeg.info.num_components == 1 ? 1 : 3;
  jpeg.info.out_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  const std::uint64_t pixels = std::uint64_t{jpeg.info.image_width} * jpeg.info.image_height;
  // A block of 8 x 8 values of a component takes at least one bit, and a component may have as few
  // as 1/16 of the pixels' values.
  if (pixels / (std::uint64_t{64} * 16 * 8) > bytes.size()) {
    fail("header",
         "it says " + std::to_string(jpeg.info.image_width) + " x " +
             std::to_string(jpeg.info.image_height) + " pixels, but its " +
             std::to_string(bytes.size()) + " bytes cannot hold them",
         "Export or copy the file again.");
  }
  // libjpeg's working memory: rows as bytes, and for a progressive file the coefficients.
  const std::uint64_t working =
      pixels * channels +
      (jpeg_has_multiple_scans(&jpeg.info) != FALSE ? pixels * channels * sizeof(JCOEF) : 0);
  Image image = empty_image(jpeg.info.image_width, jpeg.info.image_height, channels, working,
                            "header", limits, fail);
  const std::size_t row_bytes = std::size_t{image.width} * channels;
  std::vector<std::uint8_t> rows(row_bytes * image.height);
  check(read_pixels(jpeg, rows.data(), row_bytes));
  floats_of_bytes(rows, image.pixels.data());
  return image;
}

}  // namespace kiln
