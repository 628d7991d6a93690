// Finds surfaces whose backs are visible through their borders.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// What views from outside show of the open parts of a material. An open part consists of triangles connected over
/// edges of two, and has a border.
struct OpenShells {
  std::uint64_t front = 0;  ///< Pixels that show their fronts
  std::uint64_t back = 0;   ///< Pixels that show their backs
  /// A corner of the first open part, as in Mesh::positions; valid if a pixel shows an open part
  Vec3 example = {};

  /// Smallest share of pixels that show backs, and smallest number of these, for shells that need both sides: sleeves
  /// and hems show 3% and more, a sheet half; a small hole of a scan shows less.
  static constexpr double kMinBackShare = 0.02;
  static constexpr std::uint64_t kMinBackPixels = 16;
  /// True if the parts look incomplete without back faces.
  bool shows_backs() const {
    return back >= kMinBackPixels &&
           static_cast<double>(back) >= kMinBackShare * static_cast<double>(front + back);
  }
};

/// Looks at a mesh's open parts from outside, by material: see look_from_outside(). For a room, of which views show
/// mostly backs, nothing is reported.
/// \returns one entry per material of the mesh, or a single one; empty if no part is open
std::vector<OpenShells> find_open_shells(const Mesh& mesh);

}  // namespace kiln
