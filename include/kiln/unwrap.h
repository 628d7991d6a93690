#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Ways to make texture coordinates.
enum class UnwrapMethod : std::uint8_t {
  pairs,  ///< Two triangles a rectangle: quick, texels well used, thousands of seams. For baking only.
  charts,  ///< Few large charts: few seams, so that mip-maps, compression and painting work.
  /// Two triangles a square, all squares alike, as Wang, Froehlich and Goebel pack them: to compare with. Small
  /// triangles get as many texels as large ones.
  squares,
};

/// Distribution of texels over large charts.
enum class TexelDensity : std::uint8_t {
  area,  ///< As many on each piece of the surface as its area is.
  detail,  ///< More where the high poly's normals change within a texel: a lower error for as many texels.
};

/// Settings of unwrap().
struct UnwrapOptions {
  UnwrapMethod method = UnwrapMethod::charts;  ///< Kind of charts
  /// Map size that the border and the texel grid are meant for, texels (of a map that is not square:
  /// the smaller side). 16 to 65536.
  std::uint32_t size = 2048;
  /// Empty texels between neighbouring charts, 1 to size / 4. Each has half of them to itself: with
  /// 2, bilinear filtering of the full map never mixes charts. (Pairs end on texel boundaries.)
  /// Each further mip level needs twice as many.
  std::uint32_t border_texels = 2;
  /// Charts only: a high poly, for texels by its detail (TexelDensity::detail); null: by area. Read during the
  /// call.
  const Mesh* detail_of = nullptr;
};

/// Report of unwrap().
struct UnwrapReport {
  std::uint64_t charts = 0;   ///< Connected pieces of the layout.
  double coverage = 0;        ///< Share of the unit square that triangles cover, 0 to 1.
  double density_spread = 0;  ///< Standard deviation of log2(texture area / surface area) over the
                              ///< surface: 0 is perfectly even.
  double border_texels = 0;   ///< The border that was kept: as asked, or less (see warnings).
  double seconds = 0;         ///< That it took
  std::vector<Warning> warnings = {};  ///< Imperfect data that was handled
};

/// Gives a mesh UVs, by one of two methods.
///
/// **Charts** are grown by merging: triangles become patches while their normals agree, patches
/// become charts while they can be laid flat within limits of distortion. Each is relaxed as
/// rigidly as possible (Liu, Zhang, Xu, Gotsman, Gortler 2008). Then its symmetric Dirichlet energy
/// is lowered without a flip (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017). Limbs are cut
/// off where that packs better (after Limper, Vining, Sheffer 2018). Charts are packed by bitmaps,
/// at one scale: the texel density follows the area. The returned UVs hold exactly: no triangle is
/// mirrored or without area; no two overlap; charts are `border_texels` apart (half of that from
/// the map's edges). A triangle too small for a place in a chart is one of its own. Vertices at
/// exactly the same position count as one. Borders that are too wide shrink, as below.
///
/// With `detail_of`, charts have scales of their own. The high poly's normals nearest to places on
/// each triangle tell how much texels of three sizes leave out. Where that error e falls like the
/// power p of the texel's side, sides of charts follow (p e)^(1 / (2 + p)). That makes the sum of
/// errors least for as many texels (Lagrange). The densest chart has at most 4 times as many texels
/// a length as the least dense. Charts are cut where parts need other densities, if that is worth
/// the seam. Where less than 1% would be gained, texels stay even. Costs: a box tree of the high
/// poly; about 100,000 to 200,000 look-ups of nearest points; packing, up to two times more.
///
/// **Pairs**: triangles are paired along shared edges and packed as rectangles (Wang, Froehlich, Goebel,
/// "Fast Normal Map Generation for Simplified Meshes", section 2, where they are squares). **Squares** are theirs:
/// one size for all pairs, one for each triangle left over, and no regard to shape or area.
///
/// A pair is the two halves of a rectangle. Its sides follow the lengths of the quadrilateral's, its
/// area the pair's, so texel density is even; triangles left over share rectangles with a border
/// along the diagonal. The map from surface to texture is affine in each triangle, with some shear.
/// Chart corners lie on whole texels of the given size; charts are `border_texels` apart (half of
/// that, rounded down, from the map's edges); every chart keeps the triangle's orientation, so none
/// is mirrored. Every triangle of positive area gets a texel's worth of area or more.
///
/// If charts are too many for the size, the border shrinks to 1 texel. Then the layout
/// goes on a grid finer than texels: still without overlap, but with less than a texel for
/// a triangle ("border-shrunk" in the warnings). Triangles without area or with a corner
/// that is not finite get UVs at one point and are counted ("degenerate-triangles").
///
/// UVs the mesh had are replaced, and its tangents, which went with them, left out; all else is kept.
/// Deterministic: the same on every run and number of threads.
/// Lifetimes and threads as simplify().
/// \param report  where to write what was done; may be null
/// \throws Error(usage) for options out of range, Error(input) where no triangle has any area
/// Cost of pairs: about 10 ms for 5,000 triangles, 2 s for a million, on one core. Of charts: see
/// tools/bench/README.md; meant for low polys.
Mesh unwrap(const Mesh& mesh, const UnwrapOptions& options = {}, UnwrapReport* report = nullptr);

}  // namespace kiln
