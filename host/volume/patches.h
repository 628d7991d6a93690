// Sheets of surface within a cell.
#pragma once

#include <array>
#include <cstdint>

namespace kiln {

/// Splits a cell's crossed edges into the sheets of surface there, by the signs of its corners
/// alone (Nielson 2004, "Dual Marching Cubes").
///
/// Edges are numbered as in shared/volume.h, corners x + 2 y + 4 z, faces 2 axis + side. On a face whose
/// corners alternate the surface's lines part the two inside corners; where a face is "flipped" they
/// part the two outside ones.
class PatchTable {
 public:
  static constexpr std::uint32_t kNoFace = 6;
  static constexpr std::uint32_t kFlips = 7;  // each of the six faces, or none

  static const PatchTable& get();

  /// Number of sheets, 0 to 4. \param flipped  the one flipped face, or kNoFace
  std::uint32_t count(std::uint32_t corners, std::uint32_t flipped) const {
    return counts_[corners][flipped];
  }
  /// Which sheet crosses an edge.
  std::uint32_t patch(std::uint32_t corners, std::uint32_t flipped, std::uint32_t edge) const {
    return edges_[corners][flipped] >> (2 * edge) & 3;
  }
  /// 12 bits: the crossed edges.
  std::uint32_t crossed(std::uint32_t corners) const { return crossed_[corners]; }

  /// The face whose two lines belong to the same sheet, or kNoFace. It may be so in both cells at a
  /// face. Then the two vertices would share two edges of the dual mesh (four faces at one edge): such
  /// a face must be flipped, which parts the sheet in both (Wenger 2013, "Isosurfaces", section 3.3.5).
  std::uint32_t doubled_face(std::uint32_t corners) const { return doubled_[corners]; }

  /// A crossed edge of each of the two lines on a face whose corners alternate.
  static std::array<std::uint32_t, 2> opposite_edges(std::uint32_t face);

 private:
  PatchTable();
  std::array<std::array<std::uint32_t, kFlips>, 256> edges_{};
  std::array<std::array<std::uint8_t, kFlips>, 256> counts_{};
  std::array<std::uint16_t, 256> crossed_{};
  std::array<std::uint8_t, 256> doubled_{};
};

}  // namespace kiln
