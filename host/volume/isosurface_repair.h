// Repairs a low poly's flaws: folds, degenerate triangles, gaps of zero width.
#pragma once

#include <cstdint>

#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// Flaws of a low poly, counted in triangles.
struct IsosurfaceFlaws {
  std::uint64_t mended = 0;  ///< Repaired folds and degenerate triangles
  /// Triangles removed in pairs that were back to back without solid between them
  std::uint64_t removed_back_to_back = 0;
  /// Number of remaining flaws, and the position of one of them: world units, relative to the volume's
  /// origin.
  struct Left {
    std::uint64_t count = 0;
    Vec3 place{};
  };
  Left folded;    ///< Triangles that face away from the fine surface.
  Left flat;      ///< Triangles without area.
  Left repeated;  ///< Triangles with the corners of another one.
};

/// Removes pairs of triangles back to back between which a gap closed; each edge keeps equal numbers of triangles in
/// both directions. At folds and degenerate triangles, vertices are moved or edges collapsed by
/// EdgeCollapser::mend(), which keeps the topology. Open borders do not move. Walls that became two triangles back to
/// back are kept, since removing them would open a hole.
IsosurfaceFlaws repair_isosurface(const FineSurface& surface, const Volume& volume,
                                  SimplifiedIsosurface& low_poly);

}  // namespace kiln
