#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Settings of simplify(), and when it stops.
struct SimplifyOptions {
  /// Target number of triangles. 0: few that `max_error` allows ("model no more than the scene needs"). Edges
  /// collapse one by one while the bound holds around each; so these are not the fewest there could be.
  std::uint32_t faces = 0;
  /// With faces = 0: how far the high poly may be from the low poly anywhere, as a share of the
  /// bounding box's diagonal; above 0, at most 1. Measured as SimplifyReport::error is.
  double max_error = 0.002;
  /// The mesh is a height field: every z over the rectangle of its bounding box once, counter-clockwise from
  /// above. The result is one over the same rectangle, with the same corners.
  bool height_field = false;
  /// Keep the UVs, groups, objects, materials and their borders: seams stay in place on the surface and in the layout, both
  /// sides of one together. Not with height_field. The mesh must have UVs.
  bool keep_uvs = false;
  /// The result encloses the high poly: it winds around or touches all that the high poly's surface
  /// winds around, such as its own vertices. So nothing pokes through, to rounding in double
  /// precision. Open borders move outwards alone. Not with height_field or keep_uvs.
  bool hull = false;
  /// Leave out no part for its size. Else, with `faces`, small components are left out (see simplify()).
  bool keep_parts = false;
  /// True if normals are those of fit_normals(). Else they are angle-weighted: quicker, where unwrap() and
  /// fit_normals() follow.
  bool fit_normals = true;
};

/// Report of simplify().
struct SimplifyReport {
  std::uint64_t input_faces = 0;  ///< Triangles of the given mesh, unusable ones included.
  std::uint64_t faces = 0;        ///< Triangles of the result.
  /// Measured deviation: the largest distance from a sample of the high poly to the low poly, as a
  /// share of the diagonal. Samples are the corners and centroids of the high poly's triangles, or up to
  /// 262,144 of them evenly spaced.
  double error = 0;
  double mean_error = 0;  ///< The mean distance of the same samples, as a share of the diagonal.
  /// With a bound: the largest distance the other way, as a share of the diagonal; else 0. Samples are corners,
  /// centroids and middles of edges of the low poly's triangles.
  double back_error = 0;
  /// Search distance for bakes onto the result, as a share of the diagonal (MatchOptions::max_distance): the default of
  /// bakes, or 2.5 times the deviation. It is along rays, and from the low poly where that is farther off.
  double search_distance() const {
    return 2.5 * error > kSearchDistance ? 2.5 * error : kSearchDistance;
  }
  /// The distance that such bakes look first (MatchOptions::near_distance), a share of the diagonal: some times the mean
  /// distance. 0: none, since small components that were left out close to the low poly are to be found as far out as
  /// they float.
  double near_distance() const {
    if (dropped_parts > 0 && !(search_distance() > kSearchDistance)) return 0;
    const double near = 4 * mean_error;
    return near < 0.0025 ? 0.0025 : near;
  }
  /// Triangles that were folded, flat or facing down, and no longer are. Of two-sided sheets, flaws are counted on one
  /// side.
  std::uint64_t mended = 0;
  /// Triangles that face away from the high poly, or down in a height field, and stayed so.
  std::uint64_t folded = 0;
  std::uint64_t without_area = 0;   ///< Triangles without area that stayed so.
  std::uint64_t holes = 0;          ///< Loops of open edges beyond those of the high poly.
  std::uint64_t dropped_parts = 0;  ///< Small components that were left out
  std::uint64_t charts = 0;         ///< With keep_uvs: connected pieces of the layout that is left.
  double coverage =
      0;  ///< With keep_uvs: area of its triangles, where the unit square's is 1; outside of it, too.
  /// With keep_uvs: how far UVs lie outside of the high poly's charts at most, where the unit square's side is 1. A
  /// texture has to go on so far around its charts. Samples are those of back_error.
  double uv_strays = 0;
  double seconds = 0;                  ///< That it took
  std::vector<Warning> warnings = {};  ///< Imperfect data that was handled
};

/// Decimates by edge collapse with quadric errors (Garland and Heckbert 1997).
///
/// Exactly coincident vertices are welded first. Triangles are left out that have no area, repeat
/// another or have a corner that is not finite. Warnings count them ("degenerate-triangles",
/// "non-finite-triangles", "duplicate-triangles"). Open borders, edges with more than two triangles
/// and several parts are all allowed; topology is kept, so closed meshes stay closed, and no part
/// vanishes but small components. Where that needs more than `faces` triangles, "faces-not-reached" in the
/// warnings says so; where the mesh has fewer, all are kept ("faces-above-input").
///
/// With a bound instead, the result's measured error never exceeds it. A collapse is refused where a sample
/// would be too far from the triangles around (Klein, Liebich and Strasser 1996, "Mesh Reduction with Error Control");
/// others go on. Vertices move within the bound, which makes room for more collapses. Nor may corners, centroids and
/// middles of edges of the low poly be farther from the high poly than that (`back_error`). Where all faces must stay, or one is left, "all-faces-kept" or
/// "one-triangle" in the warnings says so.
///
/// If `faces` are too few for four triangles a part, or all that it has, the smallest parts go first.
///
/// A small component is a part (triangles that shared vertices connect) whose box has a diagonal below the largest
/// deviation that the part of most area has in a low poly of `faces` triangles with all parts: other places are off by
/// more than it is large. It is left out first, so that its faces go elsewhere, and counted ("dropped-parts" in the
/// warnings). Deviations are then of the parts that stay. The largest part stays
/// in any case. Nothing is left out with a bound, `height_field`, `keep_uvs`, `hull` or `keep_parts`.
///
/// Two-sided sheets (cloth, flags, leaves) have each triangle twice, once each way round. One side is simplified, and
/// comes back turned round, with vertices of its own. Both count as faces. Each side has its own groups, objects,
/// materials, colours and normals. Sheets may touch bodies and each other. With `height_field`, `keep_uvs` or `hull`,
/// backs are triangles as any others, and hardly one of them can go.
///
/// The result is compared with the high poly: faults are mended. Faults are triangles that face
/// away from the surface near them, or have no area; triangles back to back with a neighbour where the
/// high poly has no such edge; of a height field, triangles that face down. New holes are counted. With a bound,
/// what cannot be mended within it is tried anew with a closer bound there. The
/// report counts them; what stays is a warning ("folded-triangles", "flat-triangles", "new-holes").
///
/// The result has the normals of fit_normals(), and the input's name, place and units (same
/// origin); UVs with `keep_uvs`, else none. Borders between its groups, objects and materials are lines that collapses
/// hold; triangles have the names of those that they came from. Where borders are half of a low poly's edges or more,
/// they are not held: names are those of most of the high poly under each triangle. A bound is one of the surface, not
/// of lines on it. Where the high poly has vertex colours, its own come nearest
/// to them (least squares in linear light). Its triangle count is the target, or one below it where
/// a collapse takes two; with two-sided sheets, up to three below it. Each mended triangle may take up to two more.
/// Works the same at any scale.
/// Deterministic: the same on every run and number of threads. Lifetimes: `high` is read during the
/// call, and the result is the caller's own. Thread safety: may be called from several threads. A
/// ProgressScope hears of it and may stop it.
/// \param report  where to write what was done; may be null (which saves measuring with `faces`)
///
/// With `keep_uvs`, vertices of seams, open borders and borders between groups move along these lines only.
/// Ends and crossings stay, and no triangle turns over in the layout. Charts that did not overlap do not
/// come to. UVs inside a chart follow the affine maps of the triangles that they stand for (Hoppe 1999).
/// A corner without a finite UV gets its chart's there, or else the mean of those beside it.
/// "non-finite-uvs" counts such triangles; those without any UV stay so. Triangles out of the unit square are counted ("uv-outside").
///
/// With `hull`, each collapse puts its vertex outside of, or on, the planes of all triangles around
/// the edge. There the sum of squared distances is least (Sander, Gu, Gortler, Hoppe and Snyder
/// 2000, "Silhouette Clipping", section 4.1).
/// \throws Error(usage) for options out of range or that exclude each other; Error(input) where nothing
///         usable is left, or keep_uvs finds no UVs
/// Cost, two cores: 0.4 s for 70,000 faces to 2,000; 1.0 to 1.4 s for a million to 5,000; with a bound about twice
/// that. n log n in the number of
/// triangles, however many of them meet at a vertex.
Mesh simplify(const Mesh& high, const SimplifyOptions& options = {},
              SimplifyReport* report = nullptr);

}  // namespace kiln
