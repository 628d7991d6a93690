#pragma once

#include <cstdint>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Quality of a mesh's UV layout, whatever is baked into it.
///
/// S maps texels (s, t) of a width x height map to the surface of a triangle. It is affine, with the
/// derivatives Ss and St. With a = Ss.Ss, b = Ss.St and c = St.St its singular values are
/// sqrt(((a + c) +- sqrt((a - c)^2 + 4 b^2)) / 2) (Sander, Snyder, Gortler, Hoppe, "Texture Mapping Progressive
/// Meshes", 2001, section 3).
struct LayoutRating {
  std::uint64_t triangles = 0;  ///< Rated: all but those of the next two lines
  std::uint64_t degenerate =
      0;  ///< Without area on the surface, or with a corner or UV that is not finite
  std::uint64_t flat =
      0;  ///< With area on the surface but none in the layout: no texel, no end of stretch
  std::uint64_t mirrored = 0;  ///< Rated triangles that run clockwise in the layout
  double area = 0;             ///< Surface of the rated triangles, world units squared

  /// Sander et al., L2(M): the root mean square, by area, of sqrt((a + c) / 2), times sqrt(texels / area). 1 is
  /// without any stretch, at one scale.
  double stretch_l2 = 0;
  /// Linf(M): the largest singular value of all triangles, times the same factor.
  double stretch_linf = 0;
  /// Tarini, Cignoni, Scopigno (2003), section 4.3, as their section 6 proposes it for layouts: mean of
  /// 100 | step / mean step - 1 | over texels and their neighbours beside and below. A step is the distance
  /// on the surface, |Ss| or |St|: the limit for fine maps, where each triangle has its share of the texels.
  double uniformity_percent = 0;
  /// Texels a world unit, the root of texels over surface: of the triangle with the fewest
  double least_density = 0;
  double mean_density = 0;      ///< ... of all triangles together
  double greatest_density = 0;  ///< ... of the triangle with the most

  std::uint64_t charts = 0;  ///< Connected pieces of the layout
  std::uint64_t seams = 0;   ///< Edges between two faces, where UVs part
  double seam_length = 0;    ///< Length of these, world units

  std::uint64_t texels = 0;  ///< Texels of width x height whose centre a triangle covers
  double used = 0;           ///< Their share of the unit square, 0 to 1
  double overlap =
      0;  ///< Share of them that several triangles cover, 0 to 1. Copies (UvCopies) are none
  double seconds = 0;                  ///< That the rating took
  std::vector<Warning> warnings = {};  ///< "uv-outside" and the like, as of bake()
};

/// Rates a mesh's UVs for maps of this size. The figures of stretch, uniformity, charts and seams hardly depend on
/// it: a map that is not square stretches.
/// Deterministic. Lifetimes: all is read during the call. Threads: as bake().
/// \param width,height  of maps, 1 to 16384
/// \throws Error(usage) for a size out of range, Error(input) where the mesh has no UVs or no usable triangle
LayoutRating rate_layout(const Device& device, const Mesh& mesh, std::uint32_t width,
                         std::uint32_t height);

}  // namespace kiln
