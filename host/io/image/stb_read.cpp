// TGA, BMP and Radiance HDR by stb_image.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>

#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS 65536
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include "io/image/picture.h"

namespace kiln {
namespace {

/// The bytes of a file, for stb_image's callbacks. stb_image silently reads zeros past the end, so
/// this struct records whether it did.
struct StbBytes {
  const ByteSource& source;
  std::uint64_t at = 0;
  /// stb_image's buffer. stb_image fills it ahead of use, so it is no error if fewer bytes are left
  const char* buffer = nullptr;
  bool is_cut_short = false;
  std::exception_ptr error = nullptr;
};

// Exceptions must not pass through stb_image.
int on_read(void* user, char* to, int count) {
  auto& bytes = *static_cast<StbBytes*>(user);
  if (bytes.buffer == nullptr) bytes.buffer = to;
  const auto wanted_bytes = static_cast<std::size_t>(count);
  std::size_t got = 0;
  try {
    got = bytes.source.read_at(bytes.at, to, wanted_bytes);
  } catch (...) {
    bytes.error = std::current_exception();
  }
  bytes.at += got;
  if (got != 0 && (to == bytes.buffer || got == wanted_bytes)) return static_cast<int>(got);
  bytes.is_cut_short = true;
  // After the end of the file, stb_image gets line ends. With any other bytes it would never finish
  // a Radiance HDR: zeros are runs of length 0, and all other bytes continue a line of the header.
  std::fill(to + got, to + wanted_bytes, '\n');
  return count;
}

void on_skip(void* user, int count) {
  auto& bytes = *static_cast<StbBytes*>(user);
  if (count < 0) {
    bytes.at -= std::min(bytes.at, static_cast<std::uint64_t>(-std::int64_t{count}));
  } else {
    bytes.at = std::min(bytes.at + static_cast<std::uint64_t>(count), bytes.source.size());
  }
}

int on_end(void* user) {
  const auto& bytes = *static_cast<StbBytes*>(user);
  return bytes.at >= bytes.source.size() ? 1 : 0;
}

constexpr stbi_io_callbacks kCallbacks = {on_read, on_skip, on_end};

struct Free {
  void operator()(void* memory) const { stbi_image_free(memory); }
};

/// stb_image reverses rows that are stored bottom-up, but not columns that are stored from right to
/// left.
void mirror_columns(Image& image) {
  for (std::size_t y = 0; y < image.height; ++y) {
    for (std::size_t x = 0; x < image.width / 2; ++x) {
      std::swap_ranges(image.at(x, y), image.at(x, y) + image.channels,
                       image.at(image.width - 1 - x, y));
    }
  }
}

}  // namespace

Image parse_stb(const ByteSource& source, const std::string& file, const std::string& kind,
                const ImageLimits& limits) {
  const FailWith fail = image_failure(file, kind);
  const std::string export_again = "Export or copy the file again.";
  const auto reason = [] {
    const char* const text = stbi_failure_reason();
    return std::string(text == nullptr ? "damaged" : text);
  };
  const bool holds_floats = kind == "Radiance HDR";
  int width = 0, height = 0, channels = 0;
  StbBytes header{.source = source};
  if (stbi_info_from_callbacks(&kCallbacks, &header, &width, &height, &channels) == 0) {
    if (header.error) std::rethrow_exception(header.error);
    fail("header", header.is_cut_short ? "the file is cut short (truncated)" : reason(),
         "Export it again, or convert it to PNG or OpenEXR.");
  }
  // BMP: a negative height means rows from the top.
  const std::uint64_t absolute_width = static_cast<std::uint64_t>(std::abs(std::int64_t{width})),
                      absolute_height = static_cast<std::uint64_t>(std::abs(std::int64_t{height}));
  // Two bytes encode a run of at most 128 pixels.
  if (absolute_width * absolute_height / 128 > source.size()) {
    fail("header",
         "it says " + std::to_string(absolute_width) + " x " + std::to_string(absolute_height) +
             " pixels, but its " + std::to_string(source.size()) + " bytes cannot hold them",
         export_again);
  }
  StbBytes bytes{.source = source};
  std::unique_ptr<void, Free> pixels;
  // empty_image() checks the size, before stb_image allocates pixels of that size.
  Image image =
      empty_image(absolute_width, absolute_height, static_cast<std::uint32_t>(channels),
                  absolute_width * absolute_height * 4 * (holds_floats ? sizeof(float) : 1),
                  "header", limits, fail);
  if (holds_floats) {
    pixels.reset(stbi_loadf_from_callbacks(&kCallbacks, &bytes, &width, &height, &channels, 0));
  } else {
    pixels.reset(stbi_load_from_callbacks(&kCallbacks, &bytes, &width, &height, &channels, 0));
  }
  if (bytes.error) std::rethrow_exception(bytes.error);
  if (bytes.is_cut_short) fail("pixels", "the file is cut short (truncated)", export_again);
  if (pixels == nullptr) fail("pixels", reason(), export_again);
  if (static_cast<std::uint32_t>(width) != image.width ||
      static_cast<std::uint32_t>(height) != image.height) {
    fail("header", "damaged", export_again);
  }
  image.channels = static_cast<std::uint32_t>(channels);
  image.pixels.resize(std::size_t{image.width} * image.height * image.channels);
  if (holds_floats) {
    std::copy_n(static_cast<const float*>(pixels.get()), image.pixels.size(), image.pixels.data());
  } else {
    floats_of_bytes({static_cast<const std::uint8_t*>(pixels.get()), image.pixels.size()},
                    image.pixels.data());
  }
  const std::string head = source.head(18);
  if (kind == "TGA" && (static_cast<unsigned char>(head[17]) & 0x10U) != 0) mirror_columns(image);
  return image;
}

}  // namespace kiln
