// Cells and edges of a volume that the surface crosses, and their numbering.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "shared/volume.h"

namespace kiln {

/// Padded coordinates of a cell, or of an edge's lower end (shared/volume.h).
using CellPlace = std::array<std::uint32_t, 3>;

inline std::uint64_t pack_cell_place(const CellPlace& place, std::uint64_t rest = 0) {
  constexpr int kBits = KILN_VOLUME_KEY_BITS;
  return place[0] | std::uint64_t{place[1]} << kBits | std::uint64_t{place[2]} << 2 * kBits |
         rest << 3 * kBits;
}
inline CellPlace unpack_cell_place(std::uint64_t key) {
  constexpr int kBits = KILN_VOLUME_KEY_BITS;
  constexpr std::uint64_t kMask = (1U << kBits) - 1;
  return {static_cast<std::uint32_t>(key & kMask), static_cast<std::uint32_t>(key >> kBits & kMask),
          static_cast<std::uint32_t>(key >> 2 * kBits & kMask)};
}

/// Stores one sign bit per padded voxel, and bits that mark crossed edges and crossed cells, which
/// are computed from the signs. Rank counts with the bits convert between the number and the
/// position of a crossed edge or cell without a search. Takes 6 bits per voxel.
class CellGrid {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// \param size  in voxels
  explicit CellGrid(const std::array<std::uint32_t, 3>& size);

  const std::array<std::uint32_t, 3>& size() const { return size_; }
  std::uint32_t row_words() const { return words_per_row_; }
  /// Sign bits of a plane of padded voxels, written by the caller; the plane holds voxels z = plane - 1.
  std::uint64_t* plane(std::uint32_t plane) { return &inside_bits_[plane * plane_words()]; }
  const std::uint64_t* plane(std::uint32_t plane) const {
    return &inside_bits_[plane * plane_words()];
  }
  std::size_t plane_words() const { return std::size_t{size_[1] + 2} * words_per_row_; }

  /// Finds crossed edges and cells from the signs.
  /// \param open true: excludes edges and cells that touch the padding
  /// \throws Error(input) if there are too many for 32-bit numbers
  void build(bool open);

  std::uint32_t edge_count() const { return edge_count_; }
  std::uint32_t cell_count() const { return cell_count_; }
  const std::vector<kiln_volume_word>& words() const { return word_ranks_; }

  bool is_inside(const CellPlace& at) const {
    return (inside_bits_[word_index(at)] >> (at[0] & 63) & 1) != 0;
  }
  /// Number of a cell; kNone if the surface does not cross it.
  std::uint32_t cell(const CellPlace& at) const {
    const kiln_volume_word& word = word_ranks_[word_index(at)];
    const std::uint64_t bit = std::uint64_t{1} << (at[0] & 63);
    if ((word.cell & bit) == 0) return kNone;
    return word.cell_base + static_cast<std::uint32_t>(std::popcount(word.cell & (bit - 1)));
  }
  /// Signs of a cell's corners: bit x + 2 y + 4 z is 1 if the corner is inside the solid.
  std::uint32_t corners(const CellPlace& at) const;

  /// Number of the first crossed edge of each plane; the last entry is the total number of crossed
  /// edges.
  const std::vector<std::uint32_t>& plane_edges() const { return plane_edges_; }

  /// Calls visit(number, place) for the crossed cells of a plane, in order.
  template <typename Visit>
  void for_each_cell(std::uint32_t plane, const Visit& visit) const {
    std::uint32_t number = plane_cells_[plane];
    for_each_word(plane, [&](const kiln_volume_word& word, std::uint32_t x, std::uint32_t y) {
      for (std::uint64_t bits = word.cell; bits != 0; bits &= bits - 1) {
        visit(number++,
              CellPlace{x + static_cast<std::uint32_t>(std::countr_zero(bits)), y, plane});
      }
    });
  }
  /// Calls visit(number, place, axis) for the crossed edges of a plane, in order.
  template <typename Visit>
  void for_each_edge(std::uint32_t plane, const Visit& visit) const {
    std::uint32_t number = plane_edges_[plane];
    for_each_word(plane, [&](const kiln_volume_word& word, std::uint32_t x, std::uint32_t y) {
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        for (std::uint64_t bits = word.edge[axis]; bits != 0; bits &= bits - 1) {
          visit(number++,
                CellPlace{x + static_cast<std::uint32_t>(std::countr_zero(bits)), y, plane}, axis);
        }
      }
    });
  }

 private:
  std::size_t word_index(const CellPlace& at) const {
    return (std::size_t{at[2]} * (size_[1] + 2) + at[1]) * words_per_row_ + (at[0] >> 6);
  }
  template <typename Visit>
  void for_each_word(std::uint32_t plane, const Visit& visit) const {
    const kiln_volume_word* word = &word_ranks_[plane * plane_words()];
    for (std::uint32_t y = 0; y < size_[1] + 2; ++y) {
      for (std::uint32_t w = 0; w < words_per_row_; ++w, ++word) {
        if ((word->cell | word->edge[0] | word->edge[1] | word->edge[2]) != 0) {
          visit(*word, w * 64, y);
        }
      }
    }
  }

  std::array<std::uint32_t, 3> size_;
  std::uint32_t words_per_row_;
  std::vector<std::uint64_t> inside_bits_;
  std::vector<kiln_volume_word> word_ranks_;
  std::vector<std::uint32_t> plane_cells_, plane_edges_;
  std::uint32_t edge_count_ = 0, cell_count_ = 0;
};

}  // namespace kiln
