#include "io/image/exr_header.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxExrHeaderBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxExrChannels = 1024;
constexpr std::size_t kMaxExrParts = 1024;
constexpr std::uint32_t kTiledFlag = 1U << 9;
constexpr std::uint32_t kDeepFlag = 1U << 11;
constexpr std::uint32_t kMultiPartFlag = 1U << 12;

struct Compression {
  const char* name;
  Packing packing;
  std::uint64_t rows;  // Scan lines per block
};
constexpr std::array<Compression, 10> kCompressions = {{{"none", Packing::none, 1},
                                                        {"RLE", Packing::exr_rle, 1},
                                                        {"ZIPS", Packing::deflate, 1},
                                                        {"ZIP", Packing::deflate, 16},
                                                        {"PIZ", Packing::exr_piz, 32},
                                                        {"PXR24", Packing::exr_pxr24, 16},
                                                        {"B44", Packing::exr_b44, 32},
                                                        {"B44A", Packing::exr_b44, 32},
                                                        {"DWAA", Packing::exr_dwa, 32},
                                                        {"DWAB", Packing::exr_dwa, 256}}};

class Cursor {
 public:
  Cursor(const std::string& bytes, bool whole, const FailWith& fail)
      : bytes_(bytes), is_whole_file_(whole), fail_(fail) {}

  [[noreturn]] void fail(const std::string& field, const std::string& what) const {
    fail_(field, what, "Export or copy the file again.");
    throw Error(ErrorCode::internal, "An OpenEXR error was lost.");
  }
  [[noreturn]] void fail_truncated() const {
    fail("header", is_whole_file_ ? "the file ends inside (truncated)" : "it is longer than 1 MiB");
  }
  std::size_t at() const { return at_; }
  void seek(std::size_t at) { at_ = at; }
  std::size_t remaining_bytes() const { return bytes_.size() - at_; }
  unsigned byte() {
    if (remaining_bytes() < 1) fail_truncated();
    return static_cast<unsigned char>(bytes_[at_++]);
  }
  std::uint32_t word() {
    if (remaining_bytes() < 4) fail_truncated();
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) value |= std::uint32_t{byte()} << (8 * i);
    return value;
  }
  std::int64_t number() { return static_cast<std::int32_t>(word()); }
  std::string text() {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string::npos) fail_truncated();
    std::string result = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return result;
  }
  bool starts_with(std::string_view text) const {
    return std::string_view(bytes_).substr(at_).starts_with(text);
  }
  std::string text(std::size_t size) {
    std::string result = bytes_.substr(at_, size);
    at_ += result.size();
    return result;
  }

 private:
  const std::string& bytes_;
  bool is_whole_file_;
  const FailWith& fail_;
  std::size_t at_ = 0;
};

ExrBox read_box(Cursor& cursor, const std::string& name, std::uint32_t largest) {
  ExrBox box;
  box.x0 = cursor.number(), box.y0 = cursor.number();
  box.x1 = cursor.number(), box.y1 = cursor.number();
  for (const std::int64_t size : {box.x1 - box.x0 + 1, box.y1 - box.y0 + 1}) {
    if (size < 1 || size > static_cast<std::int64_t>(largest)) {
      cursor.fail(name, "it says " + std::to_string(size) + " pixels a side, but 1 to " +
                            std::to_string(largest) + " are possible");
    }
  }
  return box;
}

std::vector<ExrChannel> read_channels(Cursor& cursor, std::size_t end) {
  std::vector<ExrChannel> channels;
  while (cursor.at() < end && !cursor.text().empty()) {
    ExrChannel channel;
    const std::uint32_t type = cursor.word();
    if (type > 2) cursor.fail("channels", "type " + std::to_string(type) + " is none of OpenEXR's");
    channel.bytes = type == 1 ? 2 : 4;
    cursor.word();  // Skips the channel's flag pLinear
    channel.dx = cursor.number(), channel.dy = cursor.number();
    if (channel.dx < 1 || channel.dy < 1) cursor.fail("channels", "a sampling rate is below 1");
    channels.push_back(channel);
    if (channels.size() > kMaxExrChannels) cursor.fail("channels", "there are more than 1024");
  }
  return channels;
}

void read_compression(Cursor& cursor, ExrPart& part) {
  const unsigned number = cursor.byte();
  if (number >= kCompressions.size()) {
    cursor.fail("compression", std::to_string(number) + " is none of OpenEXR's, 0 to 9");
  }
  const Compression& compression = kCompressions[number];
  part.compression = compression.name;
  part.packing = compression.packing;
  part.block_rows = compression.rows;
}

void read_tiles(Cursor& cursor, std::uint32_t largest, ExrPart& part) {
  part.tile_width = cursor.word();
  part.tile_height = cursor.word();
  const unsigned mode = cursor.byte();
  part.level_mode = mode & 15;
  part.round_up = mode >> 4 != 0;
  const auto [least, most] = std::minmax(part.tile_width, part.tile_height);
  if (least < 1 || most > largest || part.level_mode > 2) {
    cursor.fail("tiles", "it says " + std::to_string(part.tile_width) + " x " +
                             std::to_string(part.tile_height) + " pixels and level mode " +
                             std::to_string(part.level_mode) + ", which is invalid");
  }
}

struct TypeSize {
  std::string_view type;
  std::uint32_t bytes;
};
constexpr std::array<TypeSize, 24> kTypeSizes = {{{"box2f", 16},
                                                  {"box2i", 16},
                                                  {"chromaticities", 32},
                                                  {"compression", 1},
                                                  {"deepImageState", 1},
                                                  {"double", 8},
                                                  {"envmap", 1},
                                                  {"float", 4},
                                                  {"int", 4},
                                                  {"keycode", 28},
                                                  {"lineOrder", 1},
                                                  {"m33d", 72},
                                                  {"m33f", 36},
                                                  {"m44d", 128},
                                                  {"m44f", 64},
                                                  {"rational", 8},
                                                  {"tiledesc", 9},
                                                  {"timecode", 8},
                                                  {"v2d", 16},
                                                  {"v2f", 8},
                                                  {"v2i", 8},
                                                  {"v3d", 24},
                                                  {"v3f", 12},
                                                  {"v3i", 12}}};

/// Checks that an attribute of a known type has the length of that type: OpenEXR reads that many
/// bytes regardless of the stored length, and would take the bytes after them for lengths.
void check_size(Cursor& cursor, const std::string& name, const std::string& type, std::size_t end) {
  const std::size_t begin = cursor.at(), size = end - begin;
  const auto check = [&](bool fits) {
    if (fits) return;
    cursor.fail(name, "it says " + std::to_string(size) + " bytes, which no " + type + " has");
  };
  for (const TypeSize& known : kTypeSizes) {
    if (known.type == type) check(size == known.bytes);
  }
  if (type == "preview") {
    check(size >= 8);
    const std::uint64_t width = cursor.word(), height = cursor.word();
    check(width <= size && height <= size && size == 8 + 4 * width * height);
  }
  while (type == "stringvector" && cursor.at() < end) {
    check(end - cursor.at() >= 4);
    const std::uint32_t length = cursor.word();
    check(length <= end - cursor.at());
    cursor.seek(cursor.at() + length);
  }
  if (type == "floatvector") check(size % 4 == 0);
  if (type == "chlist") {  // The list of channels ends with an empty name
    for (bool more = true; more;) {
      check(cursor.at() < end);
      more = !cursor.text().empty();
      if (more) cursor.seek(std::min(cursor.at() + 16, end + 1));
    }
    check(cursor.at() == end);
  }
  cursor.seek(begin);
}

/// Reads one header. Returns false for the empty header at the end of the list.
bool read_part(Cursor& cursor, std::uint32_t largest, ExrPart& part,
               std::vector<std::uint64_t>& manifests) {
  bool any = false;
  for (;;) {
    const std::string name = cursor.text();
    if (name.empty()) return any;
    any = true;
    if (cursor.starts_with("idmanifest")) manifests.push_back(cursor.at());
    const std::string type = cursor.text();
    const std::uint32_t size = cursor.word();
    if (size > cursor.remaining_bytes()) cursor.fail_truncated();
    const std::size_t end = cursor.at() + size;
    check_size(cursor, name, type, end);
    if (type == "box2i" && name == "dataWindow") part.data = read_box(cursor, name, largest);
    if (type == "box2i" && name == "displayWindow") part.display = read_box(cursor, name, largest);
    if (type == "tiledesc" && name == "tiles") read_tiles(cursor, largest, part);
    if (type == "chlist" && name == "channels") part.channels = read_channels(cursor, end);
    if (type == "compression" && name == "compression") read_compression(cursor, part);
    if (type == "string" && name == "type") part.type = cursor.text(size);
    cursor.seek(end);
  }
}

void check_complete(const Cursor& cursor, const ExrPart& part) {
  const auto lacks = [&](const char* field) { cursor.fail(field, "the header lacks this field"); };
  if (part.data.x1 < part.data.x0) lacks("dataWindow");
  if (part.display.x1 < part.display.x0) lacks("displayWindow");
  if (part.channels.empty()) lacks("channels");
  if (part.compression.empty()) lacks("compression");
  if (part.tiled && part.tile_width == 0) lacks("tiles");
}

/// Number of multiples of `step` from a to b, inclusive.
std::uint64_t count_multiples(std::int64_t a, std::int64_t b, std::int64_t step) {
  const auto floor = [step](std::int64_t v) {
    return v >= 0 ? v / step : -((-v + step - 1) / step);
  };
  return static_cast<std::uint64_t>(floor(b) - floor(a - 1));
}

/// Sizes of all levels along one axis, starting with the finest.
std::vector<std::uint64_t> level_sizes(std::uint64_t size, std::uint64_t until, bool round_up) {
  std::vector<std::uint64_t> result;
  for (std::uint64_t span = 1, k = 0;; span *= 2, ++k) {
    const std::uint64_t add = round_up ? span - 1 : 0;
    result.push_back(std::max<std::uint64_t>(1, (size + add) >> k));
    if ((until + add) >> k <= 1) return result;
  }
}

}  // namespace

std::uint64_t ExrPart::bytes_of(const ExrBox& box) const {
  std::uint64_t sum = 0;
  for (const ExrChannel& channel : channels) {
    const bool all = channel.dx == 1 && channel.dy == 1;
    sum += channel.bytes * (all ? box.pixels()
                                : count_multiples(box.x0, box.x1, channel.dx) *
                                      count_multiples(box.y0, box.y1, channel.dy));
  }
  return sum;
}

std::uint64_t ExrPart::blocks() const {
  return tiled ? tiles_x() * tiles_y() : (data.height() + block_rows - 1) / block_rows;
}

std::uint64_t ExrPart::blocks_of_all_levels() const {
  if (!tiled || level_mode == 0) return blocks();
  const std::uint64_t larger = std::max(data.width(), data.height());
  const bool mip = level_mode == 1;
  const auto widths = level_sizes(data.width(), mip ? larger : data.width(), round_up);
  const auto heights = level_sizes(data.height(), mip ? larger : data.height(), round_up);
  const auto tiles = [](std::uint64_t size, std::uint64_t tile) {
    return (size + tile - 1) / tile;
  };
  std::uint64_t sum = 0;
  for (std::size_t y = 0; y < heights.size(); ++y) {
    for (std::size_t x = 0; x < widths.size(); ++x) {
      if (!mip || x == y) sum += tiles(widths[x], tile_width) * tiles(heights[y], tile_height);
    }
  }
  return sum;
}

ExrHeaders read_exr_headers(const ByteSource& source, const FailWith& fail, std::uint32_t largest) {
  const std::string bytes = source.head(kMaxExrHeaderBytes);
  Cursor cursor(bytes, bytes.size() == source.size(), fail);
  if (cursor.word() != 20000630) cursor.fail("byte 0", "it is not an OpenEXR file");
  const std::uint32_t version = cursor.word();
  ExrHeaders headers;
  headers.multi_part = (version & kMultiPartFlag) != 0;
  for (;;) {
    ExrPart part;
    if (!read_part(cursor, largest, part, headers.manifests)) {
      if (headers.parts.empty()) cursor.fail("header", "it is empty");
      break;
    }
    part.tiled = headers.multi_part ? part.type == "tiledimage" || part.type == "deeptile"
                                    : (version & kTiledFlag) != 0;
    check_complete(cursor, part);
    headers.parts.push_back(std::move(part));
    if (!headers.multi_part) break;
    if (headers.parts.size() > kMaxExrParts) cursor.fail("header", "it has more than 1024 parts");
  }
  const std::string& type = headers.parts.front().type;
  // Parts of a deep type are refused even if the file's flag is not set, since OpenEXR would read
  // them as deep data.
  if ((!headers.multi_part && (version & kDeepFlag) != 0) || type.starts_with("deep")) {
    cursor.fail("type", "it holds deep data; flatten it to one value a pixel");
  }
  headers.end = cursor.at();
  return headers;
}

}  // namespace kiln
