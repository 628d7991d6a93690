// Sheets of the surface within a cell.
#pragma once

#include <array>
#include <cstdint>

namespace kiln {

/// Divides a cell's crossed edges into sheets of surface, by the signs of its corners alone (Nielson 2004, "Dual
/// Marching Cubes").
///
/// Edges are numbered as in shared/volume.h, corners as x + 2 y + 4 z, and faces as 2 * axis +
/// side. On an ambiguous face, whose corners alternate, the surface separates the two inside
/// corners; if the face is "flipped", the two outside corners.
class SheetTable {
 public:
  static constexpr std::uint32_t kNoFace = 6;
  // Number of choices for the flipped face: six faces, or none
  static constexpr std::uint32_t kFlipChoices = 7;

  static const SheetTable& get();

  /// Number of sheets, 0 to 4.
  /// \param flipped  the flipped face, or kNoFace
  std::uint32_t sheet_count(std::uint32_t corners, std::uint32_t flipped) const {
    return sheet_counts_[corners][flipped];
  }
  /// Index of the sheet that crosses an edge.
  std::uint32_t sheet_of_edge(std::uint32_t corners, std::uint32_t flipped,
                              std::uint32_t edge) const {
    return sheets_of_edges_[corners][flipped] >> (2 * edge) & 3;
  }
  /// Bit mask of the cell's 12 edges; 1: the surface crosses the edge.
  std::uint32_t crossed_edges(std::uint32_t corners) const { return crossed_edges_[corners]; }

  /// The doubled face of a cell: the ambiguous face on which both lines belong to the same sheet;
  /// kNoFace if there is none. If a face is doubled in both of its cells, their two vertices would
  /// share two edges of the dual mesh, so that an edge would have four faces. Such a face must be
  /// flipped, which splits the sheet in both cells (Wenger 2013, "Isosurfaces", section 3.3.5).
  std::uint32_t doubled_face(std::uint32_t corners) const { return doubled_faces_[corners]; }

  /// For each of the two lines on an ambiguous face, one of the crossed edges at its ends.
  static std::array<std::uint32_t, 2> opposite_edges(std::uint32_t face);

 private:
  SheetTable();
  std::array<std::array<std::uint32_t, kFlipChoices>, 256> sheets_of_edges_{};
  std::array<std::array<std::uint8_t, kFlipChoices>, 256> sheet_counts_{};
  std::array<std::uint16_t, 256> crossed_edges_{};
  std::array<std::uint8_t, 256> doubled_faces_{};
};

}  // namespace kiln
