#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "io/image/image_reader.h"

// libpng allocates memory for as many pixels as the header declares. Therefore the length of the
// IDAT chunks, which contain the pixels, is checked first; other chunks do not count. "Portable
// Network Graphics, Third Edition", https://www.w3.org/TR/png-3/.
namespace kiln {
namespace {

const std::string kExportAgain = "Export or copy the file again.";

/// A small buffer for reading in order, since a file may have millions of empty chunks.
class FileWindow {
 public:
  explicit FileWindow(const ByteSource& source) : source_(source) {}
  /// Pointer to `count` bytes at `offset`; null if the file ends before them.
  const unsigned char* at(std::uint64_t offset, std::size_t count) {
    if (offset < window_begin_ || offset + count > window_begin_ + size_) {
      window_begin_ = offset;
      size_ = source_.read_at(offset, bytes_.data(), bytes_.size());
    }
    return offset + count <= window_begin_ + size_ ? bytes_.data() + (offset - window_begin_)
                                                   : nullptr;
  }

 private:
  const ByteSource& source_;
  std::array<unsigned char, 4096> bytes_{};
  std::uint64_t window_begin_ = 0;
  std::size_t size_ = 0;
};

std::uint32_t big_endian(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
         std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
}

struct Header {
  std::uint64_t width = 0, height = 0, bits_per_pixel = 0;
  bool interlaced = false;
};

std::string sides_text(const Header& header) {
  return "it says " + std::to_string(header.width) + " x " + std::to_string(header.height) +
         " pixels";
}

Header read_header(const unsigned char* bytes, const FailWith& fail) {
  Header header;
  header.width = big_endian(bytes);
  header.height = big_endian(bytes + 4);
  constexpr std::array<std::uint64_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};
  const unsigned bits = bytes[8], colour = bytes[9];
  if (std::min(header.width, header.height) < 1 ||
      std::max(header.width, header.height) > kLargestImageSide) {
    fail("IHDR", sides_text(header) + ", but 1 to 65536 a side are possible", kExportAgain);
  }
  if (colour >= kChannels.size() || kChannels[colour] == 0 || bits == 0 || bits > 16) {
    fail("IHDR",
         "it has colour type " + std::to_string(colour) + " with " + std::to_string(bits) +
             " bits, which is invalid in PNG",
         kExportAgain);
  }
  header.bits_per_pixel = bits * kChannels[colour];
  header.interlaced = bytes[12] != 0;
  return header;
}

/// Number of bytes that the image data must unpack to: for each row of each pass, a filter byte and
/// the pixels.
std::uint64_t count_raw_bytes(const Header& header) {
  const auto pass = [&](std::uint64_t width, std::uint64_t height) {
    return width == 0 ? 0 : height * (1 + (width * header.bits_per_pixel + 7) / 8);
  };
  if (!header.interlaced) return pass(header.width, header.height);
  struct Pass {
    std::uint64_t x, y, dx, dy;
  };
  constexpr std::array<Pass, 7> kAdam7 = {{{0, 0, 8, 8},
                                           {4, 0, 8, 8},
                                           {0, 4, 4, 8},
                                           {2, 0, 4, 4},
                                           {0, 2, 2, 4},
                                           {1, 0, 2, 2},
                                           {0, 1, 1, 2}}};
  std::uint64_t sum = 0;
  for (const Pass& p : kAdam7) {
    sum += pass((header.width + p.dx - 1 - p.x) / p.dx, (header.height + p.dy - 1 - p.y) / p.dy);
  }
  return sum;
}

}  // namespace

void check_png(const ByteSource& source, const FailWith& fail, const ImageLimits& limits) {
  FileWindow file_window(source);
  const auto fail_cut_short = [&](const std::string& place) {
    fail(place, "the file ends inside (truncated)", kExportAgain);
  };
  const unsigned char* start = file_window.at(0, 33);
  if (start == nullptr) return fail_cut_short("IHDR");
  if (std::memcmp(start, "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", 16) != 0) {
    return fail("byte 8", "its first chunk is not IHDR", kExportAgain);
  }
  const Header header = read_header(start + 16, fail);
  if (header.width * header.height > limits.pixels) {
    fail("IHDR",
         sides_text(header) + ", but at most " + std::to_string(limits.pixels) + " are read",
         "Scale the image down.");
  }
  std::uint64_t data = 0;
  for (std::uint64_t at = 8;;) {
    const unsigned char* chunk = file_window.at(at, 8);
    if (chunk == nullptr) return fail_cut_short("byte " + std::to_string(at));
    const std::uint64_t length = big_endian(chunk);
    const bool image = std::memcmp(chunk + 4, "IDAT", 4) == 0;
    const bool end = std::memcmp(chunk + 4, "IEND", 4) == 0;
    if (length + 12 > source.size() - at) {
      return fail_cut_short("chunk at byte " + std::to_string(at));
    }
    if (image) data += length;
    if (end) break;
    at += length + 12;
  }
  const std::uint64_t most = max_unpacked_bytes(Packing::deflate, data);
  if (count_raw_bytes(header) > most) {
    fail("IHDR",
         sides_text(header) + " of " + std::to_string(header.bits_per_pixel) + " bits, " +
             std::to_string(count_raw_bytes(header)) + " bytes, but the " + std::to_string(data) +
             " bytes of its IDAT chunks hold at most " + std::to_string(most),
         kExportAgain);
  }
}

}  // namespace kiln
