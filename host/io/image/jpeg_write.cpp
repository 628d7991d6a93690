// JPEG by libjpeg(-turbo).
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>
// jpeglib.h uses FILE and size_t, which <cstdio> must have declared before.
#include <jpeglib.h>

#include "io/image/picture.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr int kDefaultJpegQuality = 90;

// As in jpeg_read.cpp, objects with destructors live outside of the function that calls setjmp().
struct JpegWriter {
  jpeg_error_mgr errors{};  // Must be the first member, since the struct is found by its address
  jpeg_compress_struct info{};
  std::jmp_buf jump_target{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;

  JpegWriter() = default;
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;
  ~JpegWriter() {
    jpeg_destroy_compress(&info);
    std::free(bytes);
  }
};

[[noreturn]] void stop(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegWriter*>(info->err)->jump_target, 1);
}

void ignore_message(j_common_ptr /*info*/) {}

bool write(JpegWriter& jpeg, const std::uint8_t* rows, std::uint32_t width, std::uint32_t height,
           int channels, int quality, bool subsamples_chroma) {
  if (setjmp(jpeg.jump_target)) return false;
  jpeg_create_compress(&jpeg.info);
  jpeg_mem_dest(&jpeg.info, &jpeg.bytes, &jpeg.size);
  jpeg.info.image_width = width;
  jpeg.info.image_height = height;
  jpeg.info.input_components = channels;
  jpeg.info.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg.info);
  jpeg_set_quality(&jpeg.info, quality, TRUE);
  // This integer method gives the same result on every processor
  jpeg.info.dct_method = JDCT_ISLOW;
  jpeg.info.optimize_coding = TRUE;
  jpeg_simple_progression(&jpeg.info);
  const int chroma_divisor = subsamples_chroma ? 2 : 1;
  jpeg.info.comp_info[0].h_samp_factor = jpeg.info.comp_info[0].v_samp_factor =
      channels == 1 ? 1 : chroma_divisor;
  jpeg_start_compress(&jpeg.info, TRUE);
  while (jpeg.info.next_scanline < height) {
    JSAMPROW row = const_cast<std::uint8_t*>(rows) + std::size_t{jpeg.info.next_scanline} * width *
                                                         static_cast<std::size_t>(channels);
    jpeg_write_scanlines(&jpeg.info, &row, 1);
  }
  jpeg_finish_compress(&jpeg.info);
  return true;
}

}  // namespace

std::vector<std::byte> encode_jpeg(const Image& image, const PictureEncoding& encoding) {
  if (image.channels == 4) {
    throw Error(ErrorCode::usage,
                "JPEG has no alpha, and the image has four channels: choose PNG or WebP.");
  }
  if (image.width > JPEG_MAX_DIMENSION || image.height > JPEG_MAX_DIMENSION) {
    throw Error(ErrorCode::usage, "JPEG holds at most " + std::to_string(JPEG_MAX_DIMENSION) +
                                      " pixels a side, not " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) + ": choose PNG.");
  }
  const std::vector<std::uint8_t> rows = bytes_of(image, encoding.dither, encoding.use);
  const int quality =
      encoding.quality == 0 ? kDefaultJpegQuality : static_cast<int>(encoding.quality);
  // Chroma is only subsampled for colours. In other maps the channels are independent.
  const bool subsamples_chroma = encoding.use == TextureUse::color && quality < kDefaultJpegQuality;
  JpegWriter jpeg;
  jpeg_std_error(&jpeg.errors);
  jpeg.errors.error_exit = stop;
  jpeg.errors.output_message = ignore_message;
  jpeg.info.err = &jpeg.errors;
  if (!write(jpeg, rows.data(), image.width, image.height, image.channels == 1 ? 1 : 3, quality,
             subsamples_chroma)) {
    throw std::bad_alloc();
  }
  const auto* const first = reinterpret_cast<const std::byte*>(jpeg.bytes);
  return {first, first + jpeg.size};
}

}  // namespace kiln
