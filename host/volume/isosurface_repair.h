// Flaws of a low poly: folds, triangles without area, gaps of no width. Mended, left out, counted.
#pragma once

#include <cstdint>

#include "kiln/contour.h"
#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// Flaws of a low poly, in triangles.
struct IsosurfaceFlaws {
  std::uint64_t mended = 0;    ///< Folded or without area, and no longer
  std::uint64_t left_out = 0;  ///< Two back to back at a time, with no solid between them
  /// Flaws that stay, and where one is: world, relative to the volume's origin.
  struct Left {
    std::uint64_t count = 0;
    Vec3 place{};
  };
  Left folded;    ///< They face away from the fine surface.
  Left flat;      ///< They have no area.
  Left repeated;  ///< They have the corners of another one.
};

/// Pairs of triangles back to back, between which a gap closed, are left out: every edge keeps as many triangles of
/// one sense as of the other. Around folds and triangles without area vertices move, or edges collapse, by
/// EdgeCollapser::mend(). So the topology stays. Open borders stay where they are. Walls that became two
/// triangles back to back stay: without these there would be a hole.
IsosurfaceFlaws repair_isosurface(const FineSurface& surface, const Volume& volume,
                                  SimplifiedIsosurface& low_poly);

}  // namespace kiln
