// Writing of TIFF, by libtiff.
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/image/picture.h"
#include "kiln/error.h"

namespace kiln {
namespace {

/// A file in memory for libtiff's callbacks.
struct MemoryFile {
  std::vector<std::byte> bytes;
  std::size_t at = 0;
};

MemoryFile& memory_file_of(thandle_t user) { return *static_cast<MemoryFile*>(user); }

tmsize_t on_read(thandle_t user, void* to, tmsize_t count) {
  MemoryFile& memory_file = memory_file_of(user);
  const std::size_t there =
      memory_file.bytes.size() - std::min(memory_file.at, memory_file.bytes.size());
  const std::size_t size = std::min(static_cast<std::size_t>(count), there);
  if (size > 0) std::memcpy(to, memory_file.bytes.data() + memory_file.at, size);
  memory_file.at += size;
  return static_cast<tmsize_t>(size);
}
// Exceptions must not pass through libtiff.
tmsize_t on_write(thandle_t user, void* from, tmsize_t count) try {
  MemoryFile& memory_file = memory_file_of(user);
  const std::size_t end = memory_file.at + static_cast<std::size_t>(count);
  if (memory_file.bytes.size() < end) memory_file.bytes.resize(end);
  std::memcpy(memory_file.bytes.data() + memory_file.at, from, static_cast<std::size_t>(count));
  memory_file.at = end;
  return count;
} catch (const std::bad_alloc&) {
  return -1;
}
toff_t on_seek(thandle_t user, toff_t offset, int from) {
  MemoryFile& memory_file = memory_file_of(user);
  if (from == SEEK_CUR) offset += memory_file.at;
  if (from == SEEK_END) offset += memory_file.bytes.size();
  return memory_file.at = offset;
}
int on_close(thandle_t /*user*/) { return 0; }
toff_t on_size(thandle_t user) { return memory_file_of(user).bytes.size(); }

template <typename T>
void write_rows(TIFF* file, const Image& image, bool& has_succeeded) {
  const std::size_t row = std::size_t{image.width} * image.channels;
  std::vector<T> values(row);
  for (std::uint32_t y = 0; y < image.height && has_succeeded; ++y) {
    for (std::size_t i = 0; i < row; ++i) {
      const float value = image.pixels[y * row + i];
      if constexpr (std::is_same_v<T, float>) {
        values[i] = value;
      } else {
        constexpr float kMaxStored = std::numeric_limits<T>::max();
        const float inside = value >= 0 ? std::min(value, 1.0F) : 0;  // NaN becomes 0
        values[i] = static_cast<T>(std::lround(inside * kMaxStored));
      }
    }
    has_succeeded = TIFFWriteScanline(file, values.data(), y, 0) == 1;
  }
}

}  // namespace

std::vector<std::byte> encode_tiff(const Image& image, int bits) {
  // Slightly less than 4 GiB, since the tags need space, too
  constexpr std::uint64_t kMaxClassicTiffBytes = 0xF0000000U;
  MemoryFile memory_file;
  bool has_succeeded = false;
  {
    const std::uint64_t size = image.pixels.size() * (static_cast<unsigned>(bits) / 8);
    const std::unique_ptr<TIFF, void (*)(TIFF*)> file(
        TIFFClientOpen("", size < kMaxClassicTiffBytes ? "wl" : "wl8", &memory_file, on_read,
                       on_write, on_seek, on_close, on_size, nullptr, nullptr),
        TIFFClose);
    if (file == nullptr) throw std::bad_alloc();
    const auto set = [&](std::uint32_t tag, auto value) { TIFFSetField(file.get(), tag, value); };
    const bool writes_floats = bits == 32, rgb = image.channels >= 3;
    set(TIFFTAG_IMAGEWIDTH, image.width);
    set(TIFFTAG_IMAGELENGTH, image.height);
    set(TIFFTAG_BITSPERSAMPLE, bits);
    set(TIFFTAG_SAMPLESPERPIXEL, image.channels);
    set(TIFFTAG_SAMPLEFORMAT, writes_floats ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    set(TIFFTAG_PHOTOMETRIC, rgb ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    set(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    set(TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    set(TIFFTAG_PREDICTOR, writes_floats ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    set(TIFFTAG_ROWSPERSTRIP, std::min(64U, image.height));
    if (image.channels % 2 == 0) {
      const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
      TIFFSetField(file.get(), TIFFTAG_EXTRASAMPLES, 1, &alpha);
    }
    has_succeeded = true;
    if (bits == 8) write_rows<std::uint8_t>(file.get(), image, has_succeeded);
    if (bits == 16) write_rows<std::uint16_t>(file.get(), image, has_succeeded);
    if (bits == 32) write_rows<float>(file.get(), image, has_succeeded);
    has_succeeded = has_succeeded && TIFFFlush(file.get()) == 1;
  }
  if (!has_succeeded) throw Error(ErrorCode::output, "libtiff failed to encode an image.");
  return std::move(memory_file.bytes);
}

}  // namespace kiln
