// Charts that lie between the centres of samples, and the texels that they get all the same.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/low_surface.h"
#include "texel/texel_pieces.h"

namespace kiln {

/// Texels for charts without the centre of a sample.
struct SmallCharts {
  std::vector<OwnedTexel> texels;        ///< By row, then column; none twice
  std::vector<std::uint32_t> triangles;  ///< Triangles of these charts, ascending
  std::vector<std::uint32_t> without;    ///< Those among them without a texel, ascending

  /// A small chart is a set of triangles that share corners (equal UV and position) of which none covers a
  /// sample, and none touches a triangle that does. Of texels without any covered sample:
  ///
  /// 1. each chart gets the one whose centre is nearest to it;
  /// 2. all that the charts reach into go to the triangle nearest to their centre;
  /// 3. each triangle that has none yet gets the one whose centre is nearest to it.
  ///
  /// The nearest is within 8 texels, or there is none. Ties go to the lowest row, then column; charts come in the
  /// order of their first triangles, triangles in their own. Pieces cover what they covered before.
  ///
  /// Deterministic. Nothing but a look at each triangle where all charts cover samples; else some 10 us a small
  /// chart, and the triangles around.
  /// \param pieces  of `surface`
  /// \param width, height, samples  of the map, in texels; N: N x N samples a texel
  static SmallCharts of(const LowSurface& surface, const TexelPieces& pieces, std::uint32_t width,
                        std::uint32_t height, std::uint32_t samples);
};

}  // namespace kiln
