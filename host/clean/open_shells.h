// Surfaces whose backs are seen through their borders.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// What views from outside see of the open parts of a material: parts (triangles connected over edges of two) with
/// borders.
struct OpenShells {
  std::uint64_t front = 0;  ///< Pixels that show their fronts
  std::uint64_t back = 0;   ///< Pixels that show their backs
  Vec3 example =
      {};  ///< A corner of the first open part, as Mesh::positions; valid if any pixel shows one

  /// Smallest share of backs, and fewest pixels of backs, of a shell that needs both sides: sleeves and hems show 3% and
  /// more, a sheet half; a small hole of a scan shows less.
  static constexpr double kMinBackShare = 0.02;
  static constexpr std::uint64_t kMinBackPixels = 16;
  /// True if backs are missed where they are not drawn.
  bool shows_backs() const {
    return back >= kMinBackPixels &&
           static_cast<double>(back) >= kMinBackShare * static_cast<double>(front + back);
  }
};

/// Looks at a mesh's open parts from outside, by material: see look_from_outside(). A mesh of which views see mostly
/// backs is a room: nothing is reported.
/// \returns per material of the mesh, or one entry; empty: no part is open
std::vector<OpenShells> find_open_shells(const Mesh& mesh);

}  // namespace kiln
