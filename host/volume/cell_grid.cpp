#include "volume/cell_grid.h"

#include <algorithm>

#include "base/parallel.h"
#include "kiln/error.h"

namespace kiln {
namespace {

/// Mask of bits `first` to `last` - 1 of a row, restricted to word w of the row.
std::uint64_t range_mask(std::uint32_t word, std::uint32_t first, std::uint32_t last) {
  const std::int64_t bit = std::int64_t{word} * 64;
  const std::int64_t begin = std::clamp<std::int64_t>(std::int64_t{first} - bit, 0, 64);
  const std::int64_t end = std::clamp<std::int64_t>(std::int64_t{last} - bit, 0, 64);
  if (begin >= end) return 0;
  const std::uint64_t below_end = end == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << end) - 1;
  return below_end & ~((std::uint64_t{1} << begin) - 1);
}

}  // namespace

CellGrid::CellGrid(const std::array<std::uint32_t, 3>& size)
    : size_(size), words_per_row_((size[0] + 2 + 63) / 64) {
  inside_bits_.resize(plane_words() * (size[2] + 2));
}

void CellGrid::build(bool open) {
  const std::uint32_t planes = size_[2] + 2;
  const std::uint32_t rows = size_[1] + 2;
  const std::size_t row = words_per_row_;
  word_ranks_.resize(inside_bits_.size());
  // Range of the coordinates of cells, and of the lower ends of edges, along each axis. With
  // `open`, cells and edges in the padding are excluded.
  const std::uint32_t first = open ? 1 : 0;
  const auto last = [&](int axis) { return open ? size_[axis] : size_[axis] + 1; };
  std::vector<std::uint64_t> edges(planes), cells(planes);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      const bool z_cell = z >= first && z < last(2);
      for (std::uint32_t y = 0; y < rows; ++y) {
        const bool y_cell = y >= first && y < last(1);
        const std::uint64_t* row_here = &inside_bits_[(z * rows + y) * row];
        const std::uint64_t* up = y_cell ? row_here + row : row_here;
        const std::uint64_t* row_above = z_cell ? row_here + rows * row : row_here;
        const std::uint64_t* row_diagonal = y_cell ? row_above + row : row_above;
        kiln_volume_word* out = &word_ranks_[(z * rows + y) * row];
        for (std::uint32_t w = 0; w < row; ++w) {
          const bool has_next_word = w + 1 < row;
          // Shifts a row's bits by one voxel, so that each voxel gets the bit of the next voxel
          // along x.
          const auto next = [&](const std::uint64_t* line) {
            return line[w] >> 1 | (has_next_word ? line[w + 1] << 63 : 0);
          };
          const std::uint64_t x_edges = range_mask(w, first, last(0));
          const std::uint64_t voxels = range_mask(w, 1, size_[0] + 1);
          kiln_volume_word word{};
          word.edge[0] = (row_here[w] ^ next(row_here)) & x_edges;
          word.edge[1] = y_cell ? (row_here[w] ^ up[w]) & voxels : 0;
          word.edge[2] = z_cell ? (row_here[w] ^ row_above[w]) & voxels : 0;
          if (y_cell && z_cell) {
            const std::uint64_t any_inside = row_here[w] | up[w] | row_above[w] | row_diagonal[w] |
                                             next(row_here) | next(up) | next(row_above) |
                                             next(row_diagonal);
            const std::uint64_t all_inside = row_here[w] & up[w] & row_above[w] & row_diagonal[w] &
                                             next(row_here) & next(up) & next(row_above) &
                                             next(row_diagonal);
            word.cell = any_inside & ~all_inside & x_edges;
          }
          for (const std::uint64_t bits : word.edge) {
            edges[z] += static_cast<std::uint64_t>(std::popcount(bits));
          }
          cells[z] += static_cast<std::uint64_t>(std::popcount(word.cell));
          out[w] = word;
        }
      }
    }
  });
  plane_edges_.assign(planes + 1, 0);
  plane_cells_.assign(planes + 1, 0);
  std::uint64_t edge_count_so_far = 0, cell_count_so_far = 0;
  for (std::uint32_t z = 0; z < planes; ++z) {
    edge_count_so_far += edges[z];
    cell_count_so_far += cells[z];
    // The limit leaves room in 32 bits for four vertices per cell and two triangles per edge.
    if (edge_count_so_far >= kNone / 4 || cell_count_so_far >= kNone / 4) {
      throw Error(ErrorCode::input,
                  "The volume's surface crosses more than a billion edges: smooth the volume, take "
                  "another iso value, or cut it into parts.");
    }
    plane_edges_[z + 1] = static_cast<std::uint32_t>(edge_count_so_far);
    plane_cells_[z + 1] = static_cast<std::uint32_t>(cell_count_so_far);
  }
  edge_count_ = plane_edges_[planes];
  cell_count_ = plane_cells_[planes];
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      std::uint32_t edge = plane_edges_[z];
      std::uint32_t cell = plane_cells_[z];
      kiln_volume_word* word = &word_ranks_[z * plane_words()];
      for (std::size_t w = 0; w < plane_words(); ++w, ++word) {
        word->edge_base = edge;
        word->cell_base = cell;
        for (const std::uint64_t bits : word->edge) {
          edge += static_cast<std::uint32_t>(std::popcount(bits));
        }
        cell += static_cast<std::uint32_t>(std::popcount(word->cell));
      }
    }
  });
}

std::uint32_t CellGrid::corners(const CellPlace& at) const {
  std::uint32_t result = 0;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::size_t word = word_index({at[0], at[1] + (k & 1), at[2] + (k >> 1)});
    const std::uint32_t bit = at[0] & 63;
    auto pair = static_cast<std::uint32_t>(inside_bits_[word] >> bit & 3);
    if (bit == 63) pair |= static_cast<std::uint32_t>(inside_bits_[word + 1] & 1) << 1;
    result |= pair << (2 * k);
  }
  return result;
}

}  // namespace kiln
