// Which texels are neighbours on the surface, across the seams of the UV layout.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Neighbours of a low poly's triangles.
struct SurfaceTopology {
  std::vector<std::array<std::uint32_t, 3>> vertices;  ///< Per triangle; those at one place are one
  std::vector<std::array<std::uint32_t, 3>> neighbour;  ///< Across the edge opposite corner k, or
                                                        ///< KILN_NO_TRIANGLE
  std::vector<std::uint32_t> chart;                     ///< Per triangle
  std::uint32_t vertex_count = 0;

  /// Triangles are neighbours where exactly two share an edge, running along it in opposite senses.
  /// Unusable ones have no neighbours. Charts join neighbours that share the edge in the UVs, too.
  static SurfaceTopology of(const LowSurface& surface);
};

/// A texel's place after going straight on over the surface.
struct SurfacePlace {
  std::uint32_t triangle = 0xFFFFFFFFU;  ///< KILN_NO_TRIANGLE: the way ends at the mesh's border
  double u = 0, v = 0;                   ///< In the UV layout there
};

/// Goes from a place of a triangle the way that its UVs show. Over edges it goes straight on, as if
/// the triangles beyond lay in the same plane.
/// \param from,to  UVs; `from` inside the triangle
SurfacePlace walk_surface(const LowSurface& surface, const SurfaceTopology& topology,
                          std::uint32_t triangle, const std::array<double, 2>& from,
                          const std::array<double, 2>& to);

/// Links between texels, for smoothing a field of them.
struct TexelLinks {
  std::vector<std::uint8_t> kind;    ///< Per pixel: KILN_VISIBILITY_EMPTY, _INNER, _BORDER
  std::vector<std::uint32_t> links;  ///< 9 a border texel, see kiln_visibility_link

  /// \param texel_triangle  of each pixel, row by row from the top (v = 1), or KILN_NO_TRIANGLE
  /// \param first_row       the pixels are a band of rows, from this one on, which knows nothing of others
  static TexelLinks of(const LowSurface& surface, const SurfaceTopology& topology,
                       std::span<const std::uint32_t> texel_triangle, std::uint32_t width,
                       std::uint32_t height, std::uint32_t first_row = 0);
};

}  // namespace kiln
