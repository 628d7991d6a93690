#include "texel/texel_bins.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

/// Index on a Morton curve, and its inverse, for coordinates below 2^8.
std::uint32_t interleave(std::uint32_t x, std::uint32_t y) {
  std::uint32_t result = 0;
  for (std::uint32_t bit = 0; bit < 8; ++bit) {
    result |= ((x >> bit) & 1U) << (2 * bit) | ((y >> bit) & 1U) << (2 * bit + 1);
  }
  return result;
}

}  // namespace

TexelGrid TexelGrid::of(std::uint32_t width, std::uint32_t height, std::uint32_t samples,
                        std::uint32_t max_samples) {
  TexelGrid grid;
  grid.width = width;
  grid.height = height;
  grid.samples = samples;
  grid.block_texels = 1;
  while (grid.block_texels * 2 * samples <= 8) grid.block_texels *= 2;
  grid.block_samples = grid.block_texels * samples;
  grid.slot_groups = (grid.block_samples * grid.block_samples + 7) / 8;
  const auto row_samples = [&](std::uint64_t rows_of_blocks) {
    return rows_of_blocks * grid.block_samples * samples * width;
  };
  grid.tile_blocks = 8;
  while (grid.tile_blocks > 1 && row_samples(grid.tile_blocks) > max_samples) grid.tile_blocks /= 2;
  const std::uint64_t fitting = max_samples / row_samples(grid.tile_blocks);
  const std::uint32_t tile_texels = grid.tile_blocks * grid.block_texels;
  const std::uint32_t needed = (height + tile_texels - 1) / tile_texels;
  grid.band_tiles = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(fitting, 1, needed));
  return grid;
}

std::vector<std::int32_t> TexelGrid::slot_table() const {
  const std::size_t slot_plane_size = std::size_t{8} * slot_groups;
  constexpr std::int32_t kOutsideSlot = 1 << 18;
  std::vector<std::int32_t> slot_values(4 * slot_plane_size, 0);
  std::fill_n(slot_values.begin(), slot_plane_size, kOutsideSlot);
  for (std::uint32_t ty = 0; ty < block_texels; ++ty) {
    for (std::uint32_t tx = 0; tx < block_texels; ++tx) {
      const std::uint32_t texel = interleave(tx, ty);
      slot_values[3 * slot_plane_size + texel] = static_cast<std::int32_t>(ty * width + tx);
      for (std::uint32_t place = 0; place < samples * samples; ++place) {
        const std::size_t slot = std::size_t{texel} * samples * samples + place;
        slot_values[slot] = static_cast<std::int32_t>(tx * samples + place % samples);
        slot_values[slot_plane_size + slot] =
            static_cast<std::int32_t>(ty * samples + place / samples);
        slot_values[2 * slot_plane_size + slot] = static_cast<std::int32_t>(place);
      }
    }
  }
  return slot_values;
}

TexelBins::TexelBins(const TexelGrid& grid, const TexelPieces& pieces)
    : grid_(grid), pieces_(pieces), band_first_entries_(grid.band_count() + std::size_t{1}, 0) {
  const std::int64_t band_samples = std::int64_t{grid.band_rows()} * grid.samples;
  const auto bands_of = [&](const FixedPointTriangle& f) {
    const SampleRange rows = rows_of(f, pieces.fraction_bits, grid.height * grid.samples);
    if (rows.last < rows.first) return SampleRange{0, -1};
    return SampleRange{rows.first / band_samples, rows.last / band_samples};
  };
  for (const FixedPointTriangle& f : pieces.fixed_point_triangles) {
    const SampleRange bands = bands_of(f);
    for (std::int64_t b = bands.first; b <= bands.last; ++b) {
      ++band_first_entries_[static_cast<std::size_t>(b) + 1];
    }
  }
  for (std::size_t b = 1; b < band_first_entries_.size(); ++b)
    band_first_entries_[b] += band_first_entries_[b - 1];
  band_pieces_.resize(band_first_entries_.back());
  std::vector<std::uint32_t> cursor(band_first_entries_.begin(), band_first_entries_.end() - 1);
  for (std::size_t i = 0; i < pieces.fixed_point_triangles.size(); ++i) {
    const SampleRange bands = bands_of(pieces.fixed_point_triangles[i]);
    for (std::int64_t b = bands.first; b <= bands.last; ++b) {
      band_pieces_[cursor[static_cast<std::size_t>(b)]++] = static_cast<std::uint32_t>(i);
    }
  }
}

std::uint32_t TexelBins::key(std::uint32_t column, std::uint32_t row) const {
  const std::uint32_t t = grid_.tile_blocks;
  const std::uint32_t tiles_across =
      (grid_.width + t * grid_.block_texels - 1) / (t * grid_.block_texels);
  return (row / t * tiles_across + column / t) * t * t + interleave(column % t, row % t);
}

void TexelBins::add_spans(std::uint32_t piece, std::uint32_t first_row, std::uint32_t last_row) {
  const FixedPointTriangle& f = pieces_.fixed_point_triangles[piece];
  const std::uint32_t shift = pieces_.fraction_bits;
  const SampleRange rows = rows_of(f, shift, grid_.height * grid_.samples);
  struct Edge {
    double x, y, y_low, y_high, slope;
  };
  std::array<Edge, 3> edges{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const double rise = double{1.0} * f.y[next] - f.y[k];
    edges[k] = {double{1.0} * f.x[k], double{1.0} * f.y[k],
                double{1.0} * std::min(f.y[k], f.y[next]),
                double{1.0} * std::max(f.y[k], f.y[next]),
                rise != 0 ? (double{1.0} * f.x[next] - f.x[k]) / rise : 0.0};
  }
  const double half = static_cast<double>(std::int64_t{1} << (shift - 1));
  const double unit = 2 * half;
  const std::uint32_t side = grid_.block_samples;
  const auto begin = std::max(first_row, static_cast<std::uint32_t>(rows.first / side));
  const auto end = std::min(last_row, static_cast<std::uint32_t>(rows.last / side) + 1);
  for (std::uint32_t row = begin; row < end; ++row) {
    // Clips the triangle in y to a row of blocks: from the centres of its first row of samples to those of its last.
    const double top = double{1.0} * row * side * unit + half;
    const double bottom = top + (side - 1) * unit;
    double low = 1e30;
    double high = -1e30;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge& edge = edges[k];
      if (edge.y_high < top || edge.y_low > bottom) continue;
      if (edge.y_high == edge.y_low) {
        const std::size_t next = (k + 1) % 3;
        low = std::min({low, edge.x, edges[next].x});
        high = std::max({high, edge.x, edges[next].x});
        continue;
      }
      const double x0 = edge.x + (std::max(edge.y_low, top) - edge.y) * edge.slope;
      const double x1 = edge.x + (std::min(edge.y_high, bottom) - edge.y) * edge.slope;
      low = std::min({low, x0, x1});
      high = std::max({high, x0, x1});
    }
    if (high < low) continue;
    // The range is widened on each side by one fixed-point unit, far more than the error of double precision.
    const SampleRange columns = samples_within(static_cast<std::int64_t>(std::floor(low)) - 1,
                                               static_cast<std::int64_t>(std::ceil(high)) + 1,
                                               shift, grid_.width * grid_.samples);
    if (columns.last < columns.first) continue;
    block_spans_.push_back({piece, row - first_row,
                            static_cast<std::uint32_t>(columns.first) / side,
                            static_cast<std::uint32_t>(columns.last) / side + 1});
  }
}

void TexelBins::fill(std::uint32_t band, Bins& bins) {
  const std::uint32_t rows = grid_.band_tiles * grid_.tile_blocks;
  const std::uint32_t first_row = band * rows;
  block_spans_.clear();
  for (std::uint32_t i = band_first_entries_[band]; i < band_first_entries_[band + std::size_t{1}];
       ++i) {
    add_spans(band_pieces_[i], first_row, first_row + rows);
  }

  const std::uint32_t t = grid_.tile_blocks;
  const std::uint32_t tile_texels = t * grid_.block_texels;
  const std::uint32_t tiles_across = (grid_.width + tile_texels - 1) / tile_texels;
  block_cursors_.assign(std::size_t{grid_.band_tiles} * tiles_across * t * t, 0);
  for (const Span& span : block_spans_) {
    for (std::uint32_t column = span.begin; column < span.end; ++column) {
      ++block_cursors_[key(column, span.row)];
    }
  }
  bins.blocks.clear();
  std::uint32_t piece_entry_count = 0;
  for (std::uint32_t tile = 0; tile < grid_.band_tiles * tiles_across; ++tile) {
    for (std::uint32_t place = 0; place < t * t; ++place) {
      std::uint32_t& entry = block_cursors_[tile * t * t + place];
      const std::uint32_t count = entry;
      entry = piece_entry_count;
      if (count == 0) continue;
      std::uint32_t column = 0;
      std::uint32_t row = 0;
      for (std::uint32_t bit = 0; bit < 8; ++bit) {
        column |= ((place >> (2 * bit)) & 1U) << bit;
        row |= ((place >> (2 * bit + 1)) & 1U) << bit;
      }
      column += tile % tiles_across * t;
      row += tile / tiles_across * t + first_row;
      bins.blocks.push_back({static_cast<kiln_int>(column * grid_.block_samples),
                             static_cast<kiln_int>(row * grid_.block_samples), piece_entry_count,
                             piece_entry_count + count});
      piece_entry_count += count;
    }
  }
  bins.piece_lists.resize(piece_entry_count);
  for (const Span& span : block_spans_) {
    for (std::uint32_t column = span.begin; column < span.end; ++column) {
      bins.piece_lists[block_cursors_[key(column, span.row)]++] = span.piece;
    }
  }
}

}  // namespace kiln
