// Assigns texels to charts that lie between the centres of samples.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/low_surface.h"
#include "texel/texel_pieces.h"

namespace kiln {

/// Texels for charts that contain no sample's centre.
struct SmallCharts {
  /// Assigned texels, sorted by row, then column; each occurs once
  std::vector<AssignedTexel> texels;
  /// Triangles of charts that contain no sample's centre, ascending
  std::vector<std::uint32_t> triangles;
  /// Triangles, included in `triangles`, for which no texel was found, ascending
  std::vector<std::uint32_t> triangles_without_texel;

  /// A small chart is a set of triangles connected at corners of equal UV and position, none of which covers a sample
  /// or touches a triangle that does. Texels without any covered sample are assigned in three steps:
  ///
  /// 1. Each chart gets the texel with the nearest centre. 2. Each texel that small charts
  /// overlap is assigned to the triangle nearest to its centre. 3. Each triangle without a
  /// texel gets the free one with the nearest centre.
  ///
  /// The distance is at most 8 texels; a triangle without a free texel within it gets none. Ties go to the lowest
  /// row, then to the lowest column. Charts are processed in the order of their first triangles, triangles in the
  /// order of their indices. Pieces keep the samples that they cover.
  ///
  /// The result is deterministic. Cost: one test a triangle if all charts cover samples; otherwise about 10 us more
  /// for each small chart and the triangles around it.
  /// \param pieces the pieces of `surface`
  /// \param width, height, samples  size of the map in texels; N: N x N samples a texel
  static SmallCharts of(const LowSurface& surface, const TexelPieces& pieces, std::uint32_t width,
                        std::uint32_t height, std::uint32_t samples);
};

}  // namespace kiln
