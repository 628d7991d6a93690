// Sorts pieces into the blocks of texels that they may overlap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "texel/texel_pieces.h"

namespace kiln {

/// Division of a map into blocks (squares of texels, about 8x8 samples, one work-item each), tiles (squares of blocks
/// in the order of a Morton curve) and bands (rows of tiles).
struct TexelGrid {
  std::uint32_t width = 0, height = 0;  ///< Size of the map in texels
  std::uint32_t samples = 1;  ///< Number of samples along a texel's side: N x N samples per texel
  std::uint32_t block_texels = 8;   ///< Side of a block in texels; a power of two
  std::uint32_t block_samples = 8;  ///< Side of a block in samples
  std::uint32_t tile_blocks = 8;    ///< Side of a tile in blocks; a power of two
  std::uint32_t band_tiles = 1;     ///< Number of rows of tiles in a band
  /// Number of groups of 8 slots, which hold a block's samples
  std::uint32_t slot_groups = 8;

  /// Chooses bands of at most max_samples samples, but at least one row of blocks.
  static TexelGrid of(std::uint32_t width, std::uint32_t height, std::uint32_t samples,
                      std::uint32_t max_samples);

  std::uint32_t band_rows() const { return band_tiles * tile_blocks * block_texels; }
  std::uint32_t band_count() const { return (height + band_rows() - 1) / band_rows(); }
  /// The kernels' table of slots: for each slot, the planes x, y, index within the texel, and texel (see texel.cl).
  std::vector<std::int32_t> slot_table() const;
};

/// Lists the pieces of each band at construction, and the pieces of each block of a band on request.
class TexelBins {
 public:
  TexelBins(const TexelGrid& grid, const TexelPieces& pieces);

  struct Bins {
    std::vector<kiln_texel_block> blocks;    ///< Blocks with pieces, tile by tile
    std::vector<std::uint32_t> piece_lists;  ///< Piece indices, ascending in each list
  };
  /// Fills the lists of a band. Lists are conservative: the range of blocks in a row may be up to a unit in
  /// the last place too wide.
  void fill(std::uint32_t band, Bins& bins);

 private:
  struct Span {
    std::uint32_t piece, row, begin, end;  // Range of blocks [begin, end) within a row of blocks
  };
  void add_spans(std::uint32_t piece, std::uint32_t first_row, std::uint32_t last_row);
  std::uint32_t key(std::uint32_t column, std::uint32_t row) const;

  TexelGrid grid_;
  const TexelPieces& pieces_;
  // [bands + 1] Index of each band's first entry in band_pieces_
  std::vector<std::uint32_t> band_first_entries_;
  std::vector<std::uint32_t> band_pieces_;
  std::vector<Span> block_spans_;
  // For each block of the band, the next position in the lists to write to
  std::vector<std::uint32_t> block_cursors_;
};

}  // namespace kiln
