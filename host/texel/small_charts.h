// Gives texels to charts that lie between the centres of samples.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/low_surface.h"
#include "texel/texel_pieces.h"

namespace kiln {

/// Texels for charts that contain no sample's centre.
struct SmallCharts {
  std::vector<OwnedTexel> texels;        ///< Sorted by row, then column; unique
  std::vector<std::uint32_t> triangles;  ///< Triangles of these charts, ascending
  std::vector<std::uint32_t> without;    ///< Those for which no texel was found, ascending

  /// A small chart is a set of triangles connected at corners of equal UV and position, none of which covers a sample
  /// or touches a triangle that does. Texels without any covered sample are assigned in three steps:
  ///
  /// 1. Each chart gets the texel with the nearest centre.
  /// 2. Each texel that small charts overlap goes to the triangle nearest to its centre.
  /// 3. Each triangle that has no texel yet gets the one with the nearest centre.
  ///
  /// The distance is at most 8 texels; otherwise the triangle gets none. Ties go to the lowest row, then column. Charts
  /// are processed in the order of their first triangles, triangles in their own. Pieces keep the samples that they
  /// covered before.
  ///
  /// Deterministic. If all charts cover samples, the cost is one test a triangle; otherwise some 10 us for each small
  /// chart and the triangles around.
  /// \param pieces  of `surface`
  /// \param width, height, samples  size of the map in texels; N: N x N samples a texel
  static SmallCharts of(const LowSurface& surface, const TexelPieces& pieces, std::uint32_t width,
                        std::uint32_t height, std::uint32_t samples);
};

}  // namespace kiln
