#include "volume/sheets.h"

#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "volume/patches.h"

namespace kiln {
namespace {

/// Computes for each cell its signs, its flipped face, and the number of vertices in earlier cells
/// of its plane.
/// \param doubled_face_cells  [out] for each plane, the cells with a doubled face (SheetTable) that
///   is not flipped
void find_records(const CellGrid& cells, RawVector<CellRecord>& records,
                  std::vector<std::uint32_t>& first,
                  std::vector<std::vector<CellPlace>>& doubled_face_cells) {
  const SheetTable& table = SheetTable::get();
  const std::uint32_t planes = cells.size()[2] + 2;
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      std::uint32_t count = 0;
      cells.for_each_cell(static_cast<std::uint32_t>(z),
                          [&](std::uint32_t number, CellPlace place) {
                            CellRecord& record = records[number];
                            const std::uint32_t corners = cells.corners(place);
                            record.corners = static_cast<std::uint8_t>(corners);
                            record.flipped = SheetTable::kNoFace;
                            const std::uint32_t face = table.doubled_face(corners);
                            if (face != SheetTable::kNoFace) {
                              // An ambiguous face has crossed edges, so the neighbour is a crossed cell unless it lies beyond an open
                              // border.
                              CellPlace neighbour = place;
                              neighbour[face / 2] += face % 2 == 0 ? ~0U : 1U;
                              if (cells.cell(neighbour) != CellGrid::kNone) {
                                if (table.doubled_face(cells.corners(neighbour)) == (face ^ 1U)) {
                                  record.flipped = static_cast<std::uint8_t>(face);
                                } else {
                                  doubled_face_cells[z].push_back(place);
                                }
                              }
                            }
                            record.first_vertex = count;
                            count += table.sheet_count(corners, record.flipped);
                          });
      first[z + 1] = count;
    }
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
}

DoubledFaceVertex find_doubled_face_vertex(const CellGrid& cells,
                                           const RawVector<CellRecord>& records,
                                           const CellPlace& place) {
  const SheetTable& table = SheetTable::get();
  const CellRecord& record = records[cells.cell(place)];
  const std::uint32_t face = table.doubled_face(record.corners);
  CellPlace neighbour_beyond = place;
  neighbour_beyond[face / 2] += face % 2 == 0 ? ~0U : 1U;
  const CellRecord& other = records[cells.cell(neighbour_beyond)];
  DoubledFaceVertex doubled{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto vertex = [&](const CellRecord& cell, std::uint32_t side) {
      const std::uint32_t edge = SheetTable::opposite_edges(side)[k];
      return cell.first_vertex + table.sheet_of_edge(cell.corners, cell.flipped, edge);
    };
    doubled.vertex = vertex(record, face);
    doubled.neighbours[k] = vertex(other, face ^ 1U);
  }
  return doubled;
}

}  // namespace

Sheets find_sheets(const CellGrid& cells) {
  const SheetTable& table = SheetTable::get();
  const std::uint32_t planes = cells.size()[2] + 2;
  Sheets sheets;
  RawVector<CellRecord>& records = sheets.cells;
  records.resize(cells.cell_count());
  std::vector<std::uint32_t>& first = sheets.plane_vertices;
  first.resize(planes + 1);
  std::vector<std::vector<CellPlace>> doubled_face_cells(planes);
  find_records(cells, records, first, doubled_face_cells);
  RawVector<std::uint64_t>& keys = sheets.keys;
  keys.resize(first[planes]);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      cells.for_each_cell(
          static_cast<std::uint32_t>(z), [&](std::uint32_t number, CellPlace place) {
            CellRecord& record = records[number];
            record.first_vertex += first[z];
            std::array<std::uint32_t, 4> sheet_masks{};
            for (std::uint32_t crossed_edges = table.crossed_edges(record.corners);
                 crossed_edges != 0; crossed_edges &= crossed_edges - 1) {
              const auto edge = static_cast<std::uint32_t>(std::countr_zero(crossed_edges));
              sheet_masks[table.sheet_of_edge(record.corners, record.flipped, edge)] |= 1U << edge;
            }
            for (std::size_t k = 0; k < 4 && sheet_masks[k] != 0; ++k) {
              keys[record.first_vertex + k] = pack_cell_place(place, sheet_masks[k]);
            }
          });
    }
  });
  for (const auto& plane : doubled_face_cells) {
    for (const CellPlace& place : plane)
      sheets.doubled_face_vertices.push_back(find_doubled_face_vertex(cells, records, place));
  }
  return sheets;
}

RawVector<FineEdge> find_quads(const CellGrid& cells, const RawVector<CellRecord>& records,
                               std::uint64_t& quads) {
  const SheetTable& table = SheetTable::get();
  const std::uint32_t planes = cells.size()[2] + 2;
  RawVector<FineEdge> edges(cells.edge_count());
  std::vector<std::uint64_t> counts(planes);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      cells.for_each_edge(
          static_cast<std::uint32_t>(z),
          [&](std::uint32_t number, const CellPlace& place, std::uint32_t axis) {
            FineEdge& edge = edges[number];
            const std::uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            constexpr std::array<std::array<std::uint32_t, 2>, 4> kCellOffsetsAroundEdge = {
                {{1, 1}, {0, 1}, {0, 0}, {1, 0}}};
            for (std::size_t k = 0; k < 4; ++k) {
              const auto [du, dv] = kCellOffsetsAroundEdge[k];
              edge.vertices[k] = CellGrid::kNone;
              if (place[u] < du || place[v] < dv) continue;
              CellPlace cell = place;
              cell[u] -= du;
              cell[v] -= dv;
              const std::uint32_t index = cells.cell(cell);
              if (index == CellGrid::kNone) continue;
              const CellRecord& record = records[index];
              edge.vertices[k] =
                  record.first_vertex +
                  table.sheet_of_edge(record.corners, record.flipped, 4 * axis + du + 2 * dv);
            }
            const auto level = [](std::uint32_t at) {
              return static_cast<std::uint8_t>(at == 0 ? 31 : std::countr_zero(at));
            };
            edge.u_level = level(place[u]);
            edge.v_level = level(place[v]);
            edge.axis = static_cast<std::uint8_t>(axis);
            edge.solid_at_lower_end = cells.is_inside(place) ? 1 : 0;
            counts[z] += edge.is_quad() ? 1 : 0;
          });
    }
  });
  quads = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  return edges;
}

}  // namespace kiln
