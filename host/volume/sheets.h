// Sheets of all cells that the surface crosses, and the quads between them.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/cell_grid.h"
#include "volume/fine_surface.h"

namespace kiln {

/// Signs of a cell's corners, its flipped face, and the number of its first vertex.
struct CellRecord {
  std::uint32_t first_vertex;
  std::uint8_t corners;
  std::uint8_t flipped;
};

struct Sheets {
  RawVector<CellRecord> cells;
  /// Packed key of each vertex, ordered by cell, plane by plane
  RawVector<std::uint64_t> keys;
  /// Number of the first vertex of each plane; the last entry is the total number of vertices
  std::vector<std::uint32_t> plane_vertices;
  std::vector<DoubledFaceVertex> doubled_face_vertices;
};

Sheets find_sheets(const CellGrid& cells);

/// \param quads  [out] number of crossed edges that have four cells, hence a quad
RawVector<FineEdge> find_quads(const CellGrid& cells, const RawVector<CellRecord>& records,
                               std::uint64_t& quads);

}  // namespace kiln
