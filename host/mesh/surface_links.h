// Links between neighbouring texels, including those across seams of the UV layout.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Which triangles of a low poly are adjacent.
struct SurfaceTopology {
  /// Vertices of each triangle; vertices of equal position count as one
  std::vector<std::array<std::uint32_t, 3>> vertices;
  /// For each triangle, the neighbour across the edge opposite corner k, or KILN_NO_TRIANGLE
  std::vector<std::array<std::uint32_t, 3>> neighbour;
  std::vector<std::uint32_t> chart;  ///< UV chart of each triangle
  std::uint32_t vertex_count = 0;

  /// Triangles are neighbours if an edge has exactly two triangles, in opposite directions. Unusable triangles have no
  /// neighbours. A chart consists of neighbours that also share the edge in UV space.
  static SurfaceTopology of(const LowSurface& surface);
};

/// The end point of a straight walk over the surface.
struct SurfacePlace {
  std::uint32_t triangle =
      0xFFFFFFFFU;      ///< KILN_NO_TRIANGLE if the walk ended at the mesh's border
  double u = 0, v = 0;  ///< UVs of the end point in that triangle
};

/// Walks from one point to another in the UVs of a triangle. At each edge, the walk continues as if the next triangle
/// lay in the same plane.
/// \param from, to  UVs of both points; `from` lies inside of the triangle
SurfacePlace walk_surface(const LowSurface& surface, const SurfaceTopology& topology,
                          std::uint32_t triangle, const std::array<double, 2>& from,
                          const std::array<double, 2>& to);

/// Links between texels, with which a field can be smoothed over the surface.
struct TexelLinks {
  /// Kind of each pixel: KILN_VISIBILITY_EMPTY, _INNER or _BORDER
  std::vector<std::uint8_t> kind;
  std::vector<std::uint32_t>
      links;  ///< Nine links per border texel, see kiln_visibility_smooth_seams

  /// \param texel_triangle  triangle of each pixel, row by row from the top (v = 1); KILN_NO_TRIANGLE if there is none
  /// \param first_row       first row if the pixels are a band of rows; links to other bands are omitted
  static TexelLinks of(const LowSurface& surface, const SurfaceTopology& topology,
                       std::span<const std::uint32_t> texel_triangle, std::uint32_t width,
                       std::uint32_t height, std::uint32_t first_row = 0);
};

}  // namespace kiln
