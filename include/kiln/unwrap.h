#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Methods for new UVs.
enum class UnwrapMethod : std::uint8_t {
  /// Two triangles per rectangle. Fast, and uses texels well, but gives thousands of seams; only
  /// for baking.
  pairs,
  charts,  ///< Few large charts, with few seams, so that mip-maps, compression and painting work.
  /// Two triangles per square, all squares of one size, as Wang, Froehlich and Goebel pack them, for
  /// comparison. Small triangles get as many texels as large ones.
  squares,
};

/// Distribution of texels over large charts.
enum class TexelDensity : std::uint8_t {
  area,  ///< Texels in proportion to the surface's area.
  /// More texels where the high poly's normals change within a texel, which gives a lower error for the
  /// same number of texels.
  detail,
};

/// Settings of unwrap().
struct UnwrapOptions {
  UnwrapMethod method = UnwrapMethod::charts;  ///< Method
  /// Side of the map, texels, which defines the padding and the texel grid (for a map that is not
  /// square, the smaller side). 16 to 65536.
  std::uint32_t size = 2048;
  /// Padding: empty texels between neighbouring charts, 1 to size / 4. Each chart owns half of
  /// them: with 2, bilinear filtering of the full map never mixes charts. (The borders of pairs lie
  /// on texel boundaries.) Each further mip level needs twice as many.
  std::uint32_t border_texels = 2;
  /// For charts: the high poly whose detail controls the density (TexelDensity::detail); null:
  /// TexelDensity::area. Read during the call.
  const Mesh* detail_of = nullptr;
};

/// Report of unwrap().
struct UnwrapReport {
  std::uint64_t charts = 0;  ///< Number of charts.
  double coverage = 0;       ///< Share of the unit square that triangles cover, 0 to 1.
  /// Standard deviation of log2(texture area / surface area) over the surface: 0 is perfectly even.
  double density_spread = 0;
  double border_texels = 0;  ///< Padding in use, texels: as requested, or less (see warnings).
  double seconds = 0;        ///< Duration
  std::vector<Warning> warnings = {};  ///< Warnings of imperfect data that was handled
};

/// Makes UVs for a mesh, by one of the methods below.
///
/// **Charts** are grown by merging: triangles become patches while their normals agree, patches become charts
/// while they can be laid flat within limits of distortion. Each is relaxed as rigidly as possible (Liu, Zhang,
/// Xu, Gotsman, Gortler 2008). Then its symmetric Dirichlet energy is lowered without a flip (Rabinovich, Poranne,
/// Panozzo, Sorkine-Hornung 2017). Protruding parts of charts are cut off if that packs better (after Limper,
/// Vining, Sheffer 2018). Charts are packed by bitmaps, at one scale: the texel density follows the area. The
/// returned UVs satisfy exactly: no triangle is mirrored or without area; no two overlap; charts are `border_texels`
/// apart (half of that from the map's edges). A triangle too small for a chart becomes its own chart. Vertices at
/// exactly the same position count as one. Padding that is too wide shrinks, as below.
///
/// With `detail_of`, charts have individual scales. For points on each triangle, the high poly's normals at the
/// nearest points determine the error e that remains with texels of three sizes, and the exponent p with which this
/// error falls with the texel's side. Sides of charts then are proportional to (p e)^(1 / (2 + p)), which minimises the
/// sum of errors for a number of texels (Lagrange). The densest chart has at most 4 times as many texels per length as
/// the least dense. Charts are cut where parts need different densities, if the gain outweighs the seam. If less than
/// 1% would be gained, the density stays even. Cost: a box tree of the high poly; about 100,000 to 200,000
/// nearest-point queries; up to two more packings.
///
/// **Pairs**: triangles are paired along shared edges and packed as rectangles (Wang, Froehlich, Goebel, "Fast
/// Normal Map Generation for Simplified Meshes", section 2, where they are squares). **Squares** are those of the
/// paper: one size for all pairs, one square for each unpaired triangle, regardless of shape or area.
///
/// A pair becomes the two halves of a rectangle. The rectangle's sides are proportional to those of the
/// quadrilateral, its area to that of the pair, so texel density is even; unpaired triangles share rectangles with
/// padding along the diagonal. The map from surface to texture is affine in each triangle, with some shear. Chart
/// corners lie on whole texels of the given size; charts are `border_texels` apart (half of that, rounded down,
/// from the map's edges); every chart keeps the triangle's orientation, so none is mirrored. Every triangle of
/// positive area gets at least the area of a texel.
///
/// If there are too many charts for the size, the padding shrinks to 1 texel; then the layout uses a grid finer
/// than texels, still without overlap, but with triangles smaller than a texel (warning "border-shrunk").
/// Triangles without area or with a corner that is not finite get UVs at one point and are counted
/// ("degenerate-triangles").
///
/// Existing UVs are replaced, and tangents, which belong to them, dropped; all else is kept. Deterministic: the
/// same on every run and number of threads.
/// Rules for lifetimes and threads are those of simplify().
/// \param report  receives the report; may be null
/// \throws Error(usage) for options out of range, Error(input) if no triangle has any area
/// Cost of pairs: about 10 ms for 5,000 triangles, 2 s for a million, on one core. Of charts: see
/// tools/bench/README.md; meant for low polys.
Mesh unwrap(const Mesh& mesh, const UnwrapOptions& options = {}, UnwrapReport* report = nullptr);

}  // namespace kiln
