#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "io/image/exr.h"

// OpenEXR takes memory by what a header says before it looks at the rest of the file: tables by the
// height, buffers by the width, channels and tiles. The layout read here: "OpenEXR File Layout",
// https://openexr.com/en/latest/OpenEXRFileLayout.html.
namespace kiln {
namespace {

constexpr std::size_t kLargestHeader = std::size_t{1} << 20;
// No compression of OpenEXR's makes more bytes of one: ZIP about 1000, PIZ about 400, DWA beyond, but
// for flat images only.
constexpr std::uint64_t kLargestRatio = 4096;
constexpr std::uint64_t kSlack = 1 << 16;
constexpr std::uint32_t kMultiPart = 1U << 12;
constexpr std::size_t kLargestChannels = 1024;

struct Cursor {
  const std::vector<char>& bytes;
  const std::string& file;
  std::size_t at = 0;

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::input, "Could not read '" + file + "' as OpenEXR: " + what +
                                      ". Export or copy the file again.");
  }
  std::size_t left() const { return bytes.size() - at; }
  std::uint32_t word() {
    if (left() < 4) fail("its header is cut short");
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) {
      value |= std::uint32_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
    }
    at += 4;
    return value;
  }
  std::int64_t number() { return static_cast<std::int32_t>(word()); }
  std::string text() {
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = std::find(begin, bytes.end(), '\0');
    if (end == bytes.end()) fail("its header is cut short");
    std::string result(begin, end);
    at += result.size() + 1;
    return result;
  }
};

// What one part asks for.
struct Part {
  std::uint64_t width = 0, height = 0;
  std::uint64_t tile_width = 0, tile_height = 0;
  std::uint64_t pixel_bytes = 0;
};

std::uint64_t extent(const Cursor& cursor, std::int64_t low, std::int64_t high,
                     std::uint32_t largest) {
  const std::int64_t size = high - low + 1;
  if (size < 1 || size > static_cast<std::int64_t>(largest)) {
    cursor.fail("its header says " + std::to_string(size) + " pixels a side, but 1 to " +
                std::to_string(largest) + " are possible");
  }
  return static_cast<std::uint64_t>(size);
}

void read_channels(Cursor& cursor, std::size_t end, Part& part) {
  std::size_t count = 0;
  while (cursor.at < end) {
    if (cursor.text().empty()) break;
    const std::uint32_t type = cursor.word();
    for (int i = 0; i < 3; ++i) cursor.word();  // linear flag, sampling in x and y
    part.pixel_bytes += type == 1 ? 2 : 4;
    if (++count > kLargestChannels) cursor.fail("it has too many channels");
  }
}

// Reads one header; false at the empty one that ends a list of them.
bool read_part(Cursor& cursor, std::uint32_t largest, Part& part) {
  bool any = false;
  for (;;) {
    const std::string name = cursor.text();
    if (name.empty()) return any;
    any = true;
    const std::string type = cursor.text();
    const std::uint32_t size = cursor.word();
    if (size > cursor.left()) cursor.fail("its header is cut short");
    const std::size_t end = cursor.at + size;
    if (type == "box2i" && (name == "dataWindow" || name == "displayWindow")) {
      const std::int64_t x0 = cursor.number(), y0 = cursor.number();
      const std::int64_t x1 = cursor.number(), y1 = cursor.number();
      const std::uint64_t width = extent(cursor, x0, x1, largest);
      const std::uint64_t height = extent(cursor, y0, y1, largest);
      if (name == "dataWindow") part.width = width, part.height = height;
    } else if (type == "tiledesc") {
      part.tile_width = cursor.word();
      part.tile_height = cursor.word();
    } else if (type == "chlist") {
      read_channels(cursor, end, part);
    }
    cursor.at = end;
  }
}

}  // namespace

void check_exr_headers(const std::filesystem::path& path, std::uint32_t largest) {
  const std::string name = path.string();
  std::error_code error;
  const std::uint64_t file_bytes = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  std::vector<char> bytes(error ? 0 : std::min<std::uint64_t>(file_bytes, kLargestHeader));
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  Cursor cursor{bytes, name};
  if (error || !file) cursor.fail("it cannot be opened");
  if (cursor.word() != 20000630) cursor.fail("it is no OpenEXR file");
  const std::uint32_t version = cursor.word();

  std::uint64_t wanted = 0;
  Part part;
  while (read_part(cursor, largest, part)) {
    if (part.width == 0 || part.pixel_bytes == 0) cursor.fail("its header is incomplete");
    if (part.tile_width > largest || part.tile_height > largest) {
      cursor.fail("its header says impossible tiles");
    }
    wanted +=
        std::max(part.width * part.height, part.tile_width * part.tile_height) * part.pixel_bytes;
    if ((version & kMultiPart) == 0) break;
    part = {};
  }
  if (wanted / kLargestRatio > file_bytes + kSlack) {
    cursor.fail("its header says " + std::to_string(wanted >> 20) +
                " MiB of pixels, more than the file can hold");
  }
}

}  // namespace kiln
