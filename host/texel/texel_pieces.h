// UV triangles in fixed point: what the texel kernels scan-convert.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "mesh/low_surface.h"
#include "mesh/uv_grid.h"
#include "shared/texel.h"

namespace kiln {

/// The scan-convertible pieces of a low poly, in ascending order of triangles.
struct TexelPieces {
  std::uint32_t shift = 0;  ///< Fixed-point bits below one sample, 10 to 28
  std::vector<kiln_texel_piece> pieces;
  std::vector<kiln_texel_corners> corners;
  std::vector<FixedTriangle> fixed;
  std::vector<Warning> warnings;  ///< "uv-outside", "uv-degenerate", "low-degenerate"

  /// Snaps all usable triangles to the grid of 2^-shift samples. Triangles that reach farther than
  /// one unit out of the unit square are clipped to [-1, 2] x [-1, 2]. They become several pieces,
  /// in double precision, the same way from both sides of a shared edge. Parts outside the unit
  /// square count as outside; triangles wholly outside have no piece.
  /// \param sample_width, sample_height  of the map, in samples, 1 to 2^18
  static TexelPieces of(const LowSurface& surface, std::uint32_t sample_width,
                        std::uint32_t sample_height);
};

}  // namespace kiln
