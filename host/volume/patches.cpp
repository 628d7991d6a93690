#include "volume/patches.h"

#include "kiln/error.h"

namespace kiln {
namespace {

/// The corner at offsets u and v from an end of the edge along `axis`.
std::uint32_t corner(std::uint32_t axis, std::uint32_t along, std::uint32_t u, std::uint32_t v) {
  return along << axis | u << ((axis + 1) % 3) | v << ((axis + 2) % 3);
}

struct EdgePartition {
  std::array<std::uint8_t, 12> parent{};
  std::uint32_t find(std::uint32_t edge) const {
    while (parent[edge] != edge) edge = parent[edge];
    return edge;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent[a > b ? a : b] = static_cast<std::uint8_t>(a > b ? b : a);
  }
};

/// A face's corners in order, and the edges between them.
struct Face {
  std::array<std::uint32_t, 4> corners, edges;
};

Face face(std::uint32_t index) {
  const std::uint32_t axis = index / 2, side = index % 2;
  const std::uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  // An edge along u has the number 4 u + (offset along v) + 2 (offset along the axis), and an edge
  // along v the number 4 v + (offset along the axis) + 2 (offset along u).
  return {{corner(axis, side, 0, 0), corner(axis, side, 1, 0), corner(axis, side, 1, 1),
           corner(axis, side, 0, 1)},
          {4 * u + 0 + 2 * side, 4 * v + side + 2, 4 * u + 1 + 2 * side, 4 * v + side + 0}};
}

bool is_ambiguous(const Face& face, std::uint32_t signs) {
  const auto inside = [&](std::size_t k) { return signs >> face.corners[k] & 1; };
  return inside(0) == inside(2) && inside(1) == inside(3) && inside(0) != inside(1);
}

EdgePartition trace_sheets(std::uint32_t signs, std::uint32_t flipped) {
  EdgePartition sheets;
  for (std::uint32_t edge = 0; edge < 12; ++edge) {
    sheets.parent[edge] = static_cast<std::uint8_t>(edge);
  }
  for (std::uint32_t index = 0; index < 6; ++index) {
    const Face f = face(index);
    const auto is_corner_inside = [&](std::size_t k) { return signs >> f.corners[k] & 1; };
    if (is_ambiguous(f, signs)) {
      // The two lines on an ambiguous face separate the two corners inside of the solid from each
      // other, or if the face is flipped, the two corners outside.
      const std::uint32_t separated_state = index == flipped ? 0 : 1;
      for (std::size_t k = 0; k < 4; ++k) {
        if (is_corner_inside(k) == separated_state) sheets.join(f.edges[k], f.edges[(k + 3) % 4]);
      }
      continue;
    }
    std::uint32_t first = 12;
    for (std::size_t k = 0; k < 4; ++k) {
      if (is_corner_inside(k) == is_corner_inside((k + 1) % 4)) continue;
      if (first == 12) {
        first = f.edges[k];
      } else {
        sheets.join(first, f.edges[k]);
      }
    }
  }
  return sheets;
}

}  // namespace

SheetTable::SheetTable() {
  for (std::uint32_t signs = 0; signs < 256; ++signs) {
    for (std::uint32_t edge = 0; edge < 12; ++edge) {
      const std::uint32_t axis = edge / 4;
      const std::uint32_t a = corner(axis, 0, edge & 1, edge >> 1 & 1);
      const std::uint32_t b = corner(axis, 1, edge & 1, edge >> 1 & 1);
      if ((signs >> a & 1) != (signs >> b & 1)) {
        crossed_edges_[signs] = static_cast<std::uint16_t>(crossed_edges_[signs] | 1U << edge);
      }
    }
    for (std::uint32_t flipped = 0; flipped < kFlipChoices; ++flipped) {
      const EdgePartition sheets = trace_sheets(signs, flipped);
      std::array<std::uint32_t, 12> number{};
      std::uint8_t count = 0;
      for (std::uint32_t edge = 0; edge < 12; ++edge) {
        if ((crossed_edges_[signs] >> edge & 1) == 0) continue;
        const std::uint32_t root = sheets.find(edge);
        if (root == edge) number[edge] = count++;
        sheets_of_edges_[signs][flipped] |= number[root] << (2 * edge);
      }
      sheet_counts_[signs][flipped] = count;
    }
    doubled_faces_[signs] = kNoFace;
    for (std::uint32_t index = 0; index < 6; ++index) {
      const Face f = face(index);
      if (!is_ambiguous(f, signs)) continue;
      // If the face's two lines belong to different sheets, the face is not doubled.
      if (sheet_of_edge(signs, kNoFace, f.edges[0]) != sheet_of_edge(signs, kNoFace, f.edges[2]))
        continue;
      if (doubled_faces_[signs] != kNoFace) {
        throw Error(ErrorCode::internal,
                    "Internal error: inconsistent orientation of the faces in a cell.");
      }
      doubled_faces_[signs] = static_cast<std::uint8_t>(index);
    }
  }
}

std::array<std::uint32_t, 2> SheetTable::opposite_edges(std::uint32_t face_index) {
  const Face f = face(face_index);
  return {f.edges[0], f.edges[2]};
}

const SheetTable& SheetTable::get() {
  static const SheetTable patch_table;
  return patch_table;
}

}  // namespace kiln
