#pragma once

#include <cstdint>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Quality of a mesh's UV layout, independent of the maps baked into it.
struct LayoutRating {
  /// Number of rated triangles: all triangles except those that `degenerate` and `flat` count
  std::uint64_t triangles = 0;
  std::uint64_t degenerate =
      0;  ///< Triangles without area on the surface, or with a corner or UV that is not finite
  /// Triangles with area on the surface but none in the layout: they get no texels, and their
  /// stretch is infinite
  std::uint64_t flat = 0;
  std::uint64_t mirrored = 0;  ///< Rated triangles with clockwise winding in the layout
  double area = 0;             ///< Surface area of the rated triangles, world units squared

  /// Sander et al., L2(M): the root mean square, by area, of sqrt((a + c) / 2), times sqrt(texels / area). 1:
  /// no stretch, one scale.
  double stretch_l2 = 0;
  /// Linf(M) of Sander et al.: the largest singular value of all triangles, times the same factor
  /// as in L2(M).
  double stretch_linf = 0;
  /// Tarini, Cignoni, Scopigno (2003), section 4.3, applied to layouts as their section 6 proposes: mean of
  /// 100 | step / mean step - 1 | over texels and their neighbours beside and below. A step is the distance
  /// on the surface, |Ss| or |St|: this is the limit for fine maps, in which each triangle has texels in
  /// proportion to its UV area.
  double uniformity_percent = 0;
  /// Texel density (the square root of texels over surface area, in texels per world unit) of the
  /// triangle with the lowest density
  double least_density = 0;
  double mean_density = 0;  ///< Texel density of all triangles together, texels per world unit
  /// Texel density of the triangle with the highest density, texels per world unit
  double greatest_density = 0;

  std::uint64_t charts = 0;  ///< Number of charts: connected pieces of the layout
  std::uint64_t seams = 0;   ///< Number of edges between two faces at which UVs are split
  double seam_length = 0;    ///< Total length of the seams, world units

  std::uint64_t texels = 0;  ///< Texels of width x height whose centre a triangle covers
  double used = 0;           ///< Share of the unit square that `texels` cover, 0 to 1
  /// Share of `texels` that several triangles cover, 0 to 1. UV copies (UvCopies) do not count
  double overlap = 0;
  double seconds = 0;  ///< Duration of the rating
  /// Warnings about the layout, such as "uv-outside", as those of bake()
  std::vector<Warning> warnings = {};
};

/// Rates a mesh's UVs for maps of this size. Stretch, uniformity, charts and seams hardly depend on the size,
/// unless the map is not square.
/// Deterministic. Lifetimes: arguments are read during the call. Rules for threads are those of bake().
/// \param width,height  size of the maps, 1 to 16384 texels
/// \throws Error(usage) for a size out of range, Error(input) if the mesh has no UVs or no usable triangle
LayoutRating rate_layout(const Device& device, const Mesh& mesh, std::uint32_t width,
                         std::uint32_t height);

}  // namespace kiln
