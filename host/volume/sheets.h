// Sheets of all cells that the surface crosses, and the quads between them.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/cell_grid.h"
#include "volume/fine_surface.h"

namespace kiln {

/// Signs of a cell's corners, and the number of its first vertex.
struct CellRecord {
  std::uint32_t first_vertex;
  std::uint8_t corners;
  std::uint8_t flipped;
};

struct Sheets {
  RawVector<CellRecord> cells;
  /// Packed key of each vertex, ordered by cell, plane by plane
  RawVector<std::uint64_t> keys;
  /// First vertex of each plane, and one extra entry at the end
  std::vector<std::uint32_t> plane_vertices;
  std::vector<ForkedVertex> forked_vertices;
};

Sheets find_sheets(const CellGrid& cells);

/// \param quads  [out] number of edges with four cells
RawVector<FineEdge> find_quads(const CellGrid& cells, const RawVector<CellRecord>& records,
                               std::uint64_t& quads);

}  // namespace kiln
