// Reads the headers of an OpenEXR file without OpenEXR, which would allocate the memory that they
// declare before reading the data. The layout: "OpenEXR File Layout",
// https://openexr.com/en/latest/OpenEXRFileLayout.html.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/file/bounds.h"
#include "io/file/byte_source.h"

namespace kiln {

/// The pixels from (x0, y0) to (x1, y1), both included.
struct ExrBox {
  std::int64_t x0 = 0, y0 = 0, x1 = -1, y1 = -1;
  std::uint64_t width() const { return static_cast<std::uint64_t>(x1 - x0 + 1); }
  std::uint64_t height() const { return static_cast<std::uint64_t>(y1 - y0 + 1); }
  std::uint64_t pixels() const { return width() * height(); }
  bool lies_in(const ExrBox& outer) const {
    return x0 >= outer.x0 && y0 >= outer.y0 && x1 <= outer.x1 && y1 <= outer.y1;
  }
};

struct ExrChannel {
  std::uint64_t bytes = 0;  ///< Bytes per value
  std::int64_t dx = 1, dy = 1;
};

struct ExrPart {
  ExrBox data, display;
  std::vector<ExrChannel> channels;
  std::string type;
  Packing packing = Packing::none;
  std::string compression;       ///< Name of the compression method
  std::uint64_t block_rows = 0;  ///< Scan lines per block
  bool tiled = false;
  std::uint64_t tile_width = 0, tile_height = 0;
  unsigned level_mode = 0;  ///< 0: a single level, 1: mip-map, 2: rip-map
  bool round_up = false;

  /// Number of unpacked bytes of the pixels in a box.
  std::uint64_t bytes_of(const ExrBox& box) const;
  /// Number of columns of tiles of the finest level.
  std::uint64_t tiles_x() const { return (data.width() + tile_width - 1) / tile_width; }
  std::uint64_t tiles_y() const { return (data.height() + tile_height - 1) / tile_height; }
  /// Number of blocks of the finest level, or of all levels.
  std::uint64_t blocks() const;
  std::uint64_t blocks_of_all_levels() const;
};

struct ExrHeaders {
  bool multi_part = false;
  std::vector<ExrPart> parts;  ///< At least one
  std::uint64_t end = 0;       ///< End of the headers, where the tables of block offsets start
  /// Offsets of the type names of attributes that hold ID manifests. OpenEXR 3.1 reads 4 bytes too
  /// many for such an attribute, and then misreads those after it. So ExrSource replaces the type's
  /// name by an unknown one.
  std::vector<std::uint64_t> manifests;
};

/// \param largest  maximum width and height of a window
/// \throws what `fail` throws, if the file is truncated, not OpenEXR, or has an invalid field
ExrHeaders read_exr_headers(const ByteSource& source, const FailWith& fail, std::uint32_t largest);

/// How to read the first part.
struct ExrPlan {
  /// Number of OpenEXR's threads. Each has two buffers, which together stay below the image's size
  int threads = 0;
  std::uint64_t buffers = 0;  ///< Total size of OpenEXR's buffers, in bytes
  /// Offsets of the type names of ID manifests; see ExrHeaders::manifests
  std::vector<std::uint64_t> manifests;
};

/// Checks the headers, and every block of the first part: its bytes must exist, must not overlap
/// those of other blocks, and must suffice for its pixels. Thus it refuses files for which OpenEXR
/// would allocate more memory than their content justifies.
/// \throws what `fail` throws
ExrPlan check_exr(const ByteSource& source, const FailWith& fail, std::uint32_t largest,
                  const ImageLimits& limits);

}  // namespace kiln
