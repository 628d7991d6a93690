// Finds surfaces whose backs are visible through their openings.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// What views from outside show of the open parts of a material. An open part is a set of triangles, connected over
/// edges of exactly two triangles, that has a border.
struct OpenShells {
  std::uint64_t front = 0;  ///< Number of pixels that show fronts of these parts
  std::uint64_t back = 0;   ///< Number of pixels that show backs of these parts
  /// A corner of the first open part, as in Mesh::positions; only valid if a pixel shows an open part
  Vec3 example = {};

  /// Smallest share of pixels that show backs, and smallest number of such pixels, for shells that need both sides.
  /// Sleeves and hems show 3% and more, a sheet shows half; a small hole of a scan shows less.
  static constexpr double kMinBackShare = 0.02;
  static constexpr std::uint64_t kMinBackPixels = 16;
  /// True if the parts would look incomplete without back faces.
  bool shows_backs() const {
    return back >= kMinBackPixels &&
           static_cast<double>(back) >= kMinBackShare * static_cast<double>(front + back);
  }
};

/// Draws a mesh from outside, and counts the pixels of its open parts by material: see count_seen_pixels(). Nothing is
/// reported for a room, of which views mostly show backs.
/// \returns one entry per material of the mesh, or a single one; empty if no part is open
std::vector<OpenShells> find_open_shells(const Mesh& mesh);

}  // namespace kiln
