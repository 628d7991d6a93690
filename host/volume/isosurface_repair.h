// Repairs a low poly's flaws: folds, degenerate triangles, gaps of zero width.
#pragma once

#include <cstdint>

#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// Flaws of a low poly, counted in triangles.
struct IsosurfaceFlaws {
  std::uint64_t mended = 0;  ///< Number of folded or degenerate triangles that were repaired
  /// Number of triangles removed in pairs that lay back to back with no solid between them
  std::uint64_t removed_back_to_back = 0;
  /// Remaining flaws of one kind: their number, and the position of one of them in world units,
  /// relative to the volume's origin.
  struct RemainingFlaws {
    std::uint64_t count = 0;
    Vec3 place{};
  };
  RemainingFlaws folded;      ///< Triangles that face away from the fine surface.
  RemainingFlaws degenerate;  ///< Triangles without area.
  RemainingFlaws duplicates;  ///< Triangles with the same corners as another one
};

/// Repairs flaws in two steps. First, where simplification closed a gap of the surface, it removes
/// the pairs of triangles that now lie back to back; so each edge keeps equal numbers of triangles
/// in both directions. Pairs that represent a thin wall are kept, since removing them would open a
/// hole. Then, at folded and degenerate triangles, EdgeCollapser::repair_triangle() moves vertices or
/// collapses edges, which keeps the topology. Vertices on open borders do not move.
IsosurfaceFlaws repair_isosurface(const FineSurface& surface, const Volume& volume,
                                  SimplifiedIsosurface& low_poly);

}  // namespace kiln
