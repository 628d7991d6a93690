#include <algorithm>
#include <string>
#include <vector>

#include "io/image/exr.h"
#include "io/image/exr_header.h"

// OpenEXR allocates as much memory as the header declares. If the bytes of a block do not fill a
// buffer, the rest of it stays uninitialised. Therefore each block is checked before OpenEXR reads
// it.
namespace kiln {
namespace {

const std::string kExportAgain = "Export or copy the file again.";

// Limits on the number of pixels in the display window that lie outside of the data window. Up to
// kMaxEmptyPixels (8192 x 4096) are allowed; more only if they are at most 15 in 16 of all pixels.
constexpr std::uint64_t kMaxEmptyPixels = std::uint64_t{1} << 25;
constexpr std::uint64_t kMaxDisplayToDataRatio = 16;
// Maximum number of pixels by which a row of tiles may extend beyond the image.
constexpr std::uint64_t kTileRowPixels = std::uint64_t{1} << 22;
// Maximum number of pixels of a row of tiles. OpenEXR counts them in an int, which might overflow
// above this.
constexpr std::uint64_t kMaxTileRowPixels = std::uint64_t{1} << 30;

std::string sides_text(const ExrBox& box) {
  return std::to_string(box.width()) + " x " + std::to_string(box.height()) + " pixels";
}

std::uint64_t little_endian(const unsigned char* bytes, unsigned count) {
  std::uint64_t value = 0;
  for (unsigned i = 0; i < count; ++i) value |= std::uint64_t{bytes[i]} << (8 * i);
  return value;
}

void check_windows(const ExrPart& part, const FailWith& fail, const ImageLimits& limits) {
  const bool is_data_in_display = part.data.lies_in(part.display);
  const auto check = [&](const char* field, const ExrBox& box) {
    if (box.pixels() <= limits.pixels) return;
    fail(field,
         "it says " + sides_text(box) + ", but at most " + std::to_string(limits.pixels) +
             " are read",
         "Scale the image down.");
  };
  check("dataWindow", part.data);
  if (!is_data_in_display) return;
  check("displayWindow", part.display);
  if (part.display.pixels() >
      std::max(kMaxEmptyPixels, kMaxDisplayToDataRatio * part.data.pixels())) {
    fail("displayWindow",
         "it says " + sides_text(part.display) + ", but the data window has only " +
             sides_text(part.data),
         "Export the image again, cropped to its data.");
  }
}

void check_tiles(const ExrPart& part, const FailWith& fail) {
  if (!part.tiled) return;
  // OpenEXR buffers a row of tiles, including the parts that lie beyond the image.
  const std::uint64_t most =
      std::min(std::max(4 * part.data.pixels(), kTileRowPixels), kMaxTileRowPixels);
  if (std::max(part.data.width(), part.tile_width) * part.tile_height > most) {
    fail("tiles",
         "it says " + std::to_string(part.tile_width) + " x " + std::to_string(part.tile_height) +
             " pixels, but the data window has only " + sides_text(part.data),
         "Export the image again with smaller tiles, or without tiles.");
  }
}

/// The pixels that a block of the finest level holds.
ExrBox block_box(const ExrPart& part, std::uint64_t i) {
  ExrBox box = part.data;
  const std::uint64_t blocks_per_row = part.tiled ? part.tiles_x() : 1;
  const std::uint64_t rows = part.tiled ? part.tile_height : part.block_rows;
  box.y0 += static_cast<std::int64_t>(i / blocks_per_row * rows);
  box.y1 = std::min(box.y1, box.y0 + static_cast<std::int64_t>(rows) - 1);
  if (part.tiled) {
    box.x0 += static_cast<std::int64_t>(i % blocks_per_row * part.tile_width);
    box.x1 = std::min(box.x1, box.x0 + static_cast<std::int64_t>(part.tile_width) - 1);
  }
  return box;
}

void check_blocks(const ByteSource& source, const ExrHeaders& headers, const FailWith& fail) {
  const ExrPart& part = headers.parts.front();
  std::uint64_t all = 0;
  for (const ExrPart& each : headers.parts) all += each.blocks_of_all_levels();
  if (all > (source.size() - headers.end) / 8) {
    fail("dataWindow",
         "it says " + sides_text(part.data) + ", whose table of " + std::to_string(all) +
             " blocks is longer than the file (truncated)",
         kExportAgain);
  }
  const std::uint64_t count = part.blocks();
  std::vector<unsigned char> offset_table(static_cast<std::size_t>(8 * count));
  offset_table.resize(source.read_at(headers.end, offset_table.data(), offset_table.size()));
  // A block's header consists of the part, the position and the number of bytes.
  const std::uint64_t part_bytes = headers.multi_part ? 4 : 0;
  const std::uint64_t position_bytes = part.tiled ? 16 : 4;
  const std::uint64_t head_bytes = part_bytes + position_bytes + 4;
  std::uint64_t total_bytes = 0;
  for (std::uint64_t i = 0; 8 * i + 8 <= offset_table.size(); ++i) {
    const std::string place = "block " + std::to_string(i);
    const std::uint64_t at = little_endian(&offset_table[8 * i], 8);
    unsigned char head[24] = {};
    if (at < headers.end || at > source.size() ||
        source.read_at(at, head, static_cast<std::size_t>(head_bytes)) != head_bytes) {
      fail(place, "the file does not have it (truncated, or the program that wrote it was stopped)",
           kExportAgain);
    }
    const ExrBox box = block_box(part, i);
    const auto field = [&](std::size_t k) { return little_endian(head + part_bytes + 4 * k, 4); };
    const bool placed = part.tiled
                            ? field(0) == i % part.tiles_x() && field(1) == i / part.tiles_x() &&
                                  field(2) == 0 && field(3) == 0
                            : field(0) == static_cast<std::uint32_t>(box.y0);
    if (!placed || (headers.multi_part && little_endian(head, 4) != 0)) {
      fail(place, "another block is at its position", kExportAgain);
    }
    const std::uint64_t size = little_endian(head + part_bytes + position_bytes, 4);
    if (size > source.size() - at - head_bytes) {
      fail(place, "the file ends inside (truncated)", kExportAgain);
    }
    const std::uint64_t needed = part.bytes_of(box);
    if (needed > max_unpacked_bytes(part.packing, size)) {
      fail("dataWindow",
           "it says " + sides_text(part.data) + "; " + place + " of this size takes " +
               std::to_string(needed) + " bytes, but " + std::to_string(size) +
               " bytes are stored, which compression " + part.compression + " expands to at most " +
               std::to_string(max_unpacked_bytes(part.packing, size)),
           kExportAgain);
    }
    total_bytes += size + head_bytes;
    if (total_bytes > source.size()) fail(place, "it overlaps another one", kExportAgain);
  }
}

}  // namespace

ExrPlan check_exr(const ByteSource& source, const FailWith& fail, std::uint32_t largest,
                  const ImageLimits& limits) {
  const ExrHeaders headers = read_exr_headers(source, fail, largest);
  const ExrPart& part = headers.parts.front();
  check_windows(part, fail, limits);
  check_tiles(part, fail);
  check_blocks(source, headers, fail);
  ExrBox block = block_box(part, 0);
  if (part.tiled) {  // Tiles are stored in full size, even at the border
    block.x1 = block.x0 + static_cast<std::int64_t>(part.tile_width) - 1;
    block.y1 = block.y0 + static_cast<std::int64_t>(part.tile_height) - 1;
  }
  // Each thread has one buffer for packed bytes and one for unpacked ones.
  const std::uint64_t each = 4 * std::max<std::uint64_t>(1, part.bytes_of(block));
  const std::uint64_t most = part.bytes_of(part.data) / each;
  ExrPlan plan;
  plan.manifests = headers.manifests;
  const auto all = static_cast<std::uint64_t>(exr_threads(0));
  plan.threads = most < 2 ? 0 : static_cast<int>(std::min(all, most));
  plan.buffers = each * static_cast<std::uint64_t>(std::max(1, plan.threads));
  if (part.tiled) {
    plan.buffers +=
        std::max(part.data.width(), part.tile_width) * part.tile_height * 4 * part.channels.size();
  }
  return plan;
}

}  // namespace kiln
