// Headers of an OpenEXR file, read without OpenEXR: that takes memory by them before it looks at the
// rest of the file. The layout: "OpenEXR File Layout",
// https://openexr.com/en/latest/OpenEXRFileLayout.html.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/file/bounds.h"
#include "io/file/byte_source.h"

namespace kiln {

/// Pixels from (x0, y0) to (x1, y1), both included.
struct ExrBox {
  std::int64_t x0 = 0, y0 = 0, x1 = -1, y1 = -1;
  std::uint64_t width() const { return static_cast<std::uint64_t>(x1 - x0 + 1); }
  std::uint64_t height() const { return static_cast<std::uint64_t>(y1 - y0 + 1); }
  std::uint64_t pixels() const { return width() * height(); }
  bool inside(const ExrBox& outer) const {
    return x0 >= outer.x0 && y0 >= outer.y0 && x1 <= outer.x1 && y1 <= outer.y1;
  }
};

struct ExrChannel {
  std::uint64_t bytes = 0;  ///< Bytes a value
  std::int64_t dx = 1, dy = 1;
};

struct ExrPart {
  ExrBox data, display;
  std::vector<ExrChannel> channels;
  std::string type;
  Packing packing = Packing::none;
  std::string compression;       ///< Its name
  std::uint64_t block_rows = 0;  ///< Rows of a block of scan lines
  bool tiled = false;
  std::uint64_t tile_width = 0, tile_height = 0;
  unsigned level_mode = 0;  ///< 0: one, 1: mip-map, 2: rip-map
  bool round_up = false;

  /// Bytes of the pixels of a box, unpacked.
  std::uint64_t bytes_of(const ExrBox& box) const;
  /// Columns of tiles of the finest level.
  std::uint64_t tiles_x() const { return (data.width() + tile_width - 1) / tile_width; }
  std::uint64_t tiles_y() const { return (data.height() + tile_height - 1) / tile_height; }
  /// Blocks of the finest level, or of all of them.
  std::uint64_t blocks() const;
  std::uint64_t blocks_of_all_levels() const;
};

struct ExrHeaders {
  bool multi_part = false;
  std::vector<ExrPart> parts;  ///< One at least
  std::uint64_t end = 0;       ///< Offset at which the tables of blocks begin
  /// Offsets of the types of ID manifests. OpenEXR 3.1 reads such an attribute 4 bytes too far, and what
  /// comes after it wrongly: ExrSource gives it a type that no library knows.
  std::vector<std::uint64_t> manifests;
};

/// \param largest  largest width and height of a window
/// \throws what `fail` throws: cut short, no OpenEXR, or a field that cannot be
ExrHeaders read_exr_headers(const ByteSource& source, const FailWith& fail, std::uint32_t largest);

/// Plan for reading the first part.
struct ExrPlan {
  int threads = 0;  ///< For OpenEXR: its buffers, two a thread, stay below the image's size
  std::uint64_t buffers = 0;             ///< Bytes of them
  std::vector<std::uint64_t> manifests;  ///< As in ExrHeaders
};

/// Refuses what OpenEXR would take memory for that the file does not have: looks at the headers and at
/// every block of the first part. A block's bytes must be there, its own, and able to hold its pixels.
/// \throws what `fail` throws
ExrPlan check_exr(const ByteSource& source, const FailWith& fail, std::uint32_t largest,
                  const ImageLimits& limits);

}  // namespace kiln
