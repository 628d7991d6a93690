#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Settings of simplify().
struct SimplifyOptions {
  /// Target number of triangles. 0: few triangles within `max_error`. Since edges collapse one by one
  /// while the bound holds around each, this is not the smallest possible number.
  std::uint32_t faces = 0;
  /// With faces = 0: largest distance between the high poly and the low poly, as a share of the
  /// bounding box's diagonal; above 0, at most 1. Measured as SimplifyReport::error is.
  double max_error = 0.002;
  /// The mesh is a height field: it covers the rectangle of its bounding box once in z, counter-clockwise
  /// from above. The result covers the same rectangle and keeps its corners.
  bool height_field = false;
  /// Preserve the UVs, groups, objects, materials and their borders: seams keep their position on the surface and in
  /// the layout, and both sides of a seam move together. Not with height_field. The mesh must have UVs.
  bool keep_uvs = false;
  /// The result encloses the high poly: it contains or touches all points that the high poly
  /// contains, including its own vertices. So the high poly never pokes through the result, up to
  /// rounding in double precision. Open borders only move outwards. Not with height_field or
  /// keep_uvs.
  bool hull = false;
  /// Keep all parts, including very small ones. If false and `faces` is given, small components are
  /// dropped (see simplify()).
  bool keep_parts = false;
  /// Compute normals by fit_normals(). If false, normals are averages weighted by angles, which is
  /// faster, and sufficient if unwrap() and fit_normals() follow.
  bool fit_normals = true;
};

/// Report of simplify().
struct SimplifyReport {
  std::uint64_t input_faces =
      0;  ///< Number of triangles of the given mesh, including degenerate and non-finite ones.
  std::uint64_t faces = 0;  ///< Triangles of the result.
  /// Measured deviation: the largest distance from a sample of the high poly to the low poly, as a share
  /// of the diagonal. Samples are the corners and centroids of the high poly's triangles, up to 262,144
  /// of them, evenly spaced.
  double error = 0;
  double mean_error = 0;  ///< The mean distance over the same samples, as a share of the diagonal.
  /// With a bound of the error: the largest distance from a sample of the low poly to the high poly, as a
  /// share of the diagonal; else 0. Samples are corners, centroids and edge midpoints of the low poly's
  /// triangles.
  double back_error = 0;
  /// Search distance for bakes onto the result (MatchOptions::max_distance), as a share of the
  /// diagonal: the larger of the default search distance of bakes and 2.5 times `error`, since rays
  /// start at the low poly and measure the distance along their direction.
  double search_distance() const {
    return 2.5 * error > kSearchDistance ? 2.5 * error : kSearchDistance;
  }
  /// First search distance for bakes onto the result (MatchOptions::near_distance), as a share of the diagonal: a
  /// multiple of the mean distance. 0 (none) if small components were dropped, since rays must find these at their full
  /// distance from the low poly.
  double near_distance() const {
    if (dropped_parts > 0 && !(search_distance() > kSearchDistance)) return 0;
    const double near = 4 * mean_error;
    return near < 0.0025 ? 0.0025 : near;
  }
  /// Number of triangles that were folded, had no area or faced down, and were repaired. On two-sided sheets, only
  /// one side is counted.
  std::uint64_t mended = 0;
  /// Remaining triangles that face away from the high poly, or down in a height field.
  std::uint64_t folded = 0;
  std::uint64_t without_area = 0;  ///< Remaining triangles without area.
  std::uint64_t holes = 0;  ///< Number of new holes: loops of open edges that the high poly lacks.
  std::uint64_t dropped_parts = 0;  ///< Number of small components that were dropped
  std::uint64_t charts = 0;  ///< With keep_uvs: number of charts (connected pieces) of the layout.
  /// With keep_uvs: area of the UV layout, in units of the unit square, including parts outside of
  /// the unit square.
  double coverage = 0;
  /// With keep_uvs: largest distance of the result's UVs from the high poly's charts, where the unit square's side
  /// is 1. Textures of the high poly need at least this width of padding around their charts. Samples are those of
  /// back_error.
  double uv_strays = 0;
  double seconds = 0;                  ///< Duration
  std::vector<Warning> warnings = {};  ///< Warnings of imperfect data that was handled
};

/// Decimates by edge collapse with quadric errors (Garland and Heckbert 1997).
///
/// Exactly coincident vertices are welded first. Triangles without area, duplicates and triangles with a non-finite
/// corner are dropped. Warnings count them ("degenerate-triangles", "non-finite-triangles", "duplicate-triangles").
/// Open borders, edges with more than two triangles and several parts are all allowed; topology is kept, so closed
/// meshes stay closed, and only small components vanish. If that needs more than `faces` triangles, the warning is
/// "faces-not-reached"; if the mesh has fewer, all are kept ("faces-above-input").
///
/// With a bound instead, the result's measured error never exceeds it. A collapse is rejected if a sample would be too
/// far from the triangles around it (Klein, Liebich and Strasser 1996, "Mesh Reduction with Error Control"); other
/// collapses continue. Vertices move within the bound, which permits more collapses. The bound also holds for corners,
/// centroids and edge midpoints of the low poly (`back_error`). If no face can be removed, or one is left, the warning
/// is "all-faces-kept" or "one-triangle".
///
/// If `faces` does not suffice for four triangles per part (or all triangles of a part that has fewer), the smallest
/// parts are dropped first.
///
/// A small component is a part (triangles connected by shared vertices) that is smaller than the error elsewhere. It is
/// found by simplifying all parts to `faces` triangles together: the diagonal of its bounding box is below the largest
/// deviation of the part with the largest area. Small components are dropped first, so that their faces can be used
/// elsewhere, and counted ("dropped-parts"). Deviations are then those of the remaining parts. The largest part is
/// always kept. Nothing is dropped with a bound, `height_field`, `keep_uvs`, `hull` or `keep_parts`.
///
/// Two-sided sheets (cloth, flags, leaves) have each triangle twice, once with each winding. One side is simplified,
/// and the other is its reversed copy with separate vertices. Both count as faces. Each side has its own groups,
/// objects, materials, colours and normals. Sheets may touch bodies and each other. With `height_field`, `keep_uvs` or
/// `hull`, back sides are ordinary triangles, and hardly any of them can be removed.
///
/// The result is compared with the high poly, and faults are repaired: triangles that face away from the surface near
/// them, or have no area; triangles back to back with a neighbour where the high poly has no such edge; in a height
/// field, triangles that face down. New holes are counted. With a bound, regions that cannot be repaired within it are
/// simplified again with a tighter bound. The report counts repairs; remaining faults are warnings ("folded-triangles",
/// "flat-triangles", "new-holes").
///
/// The result has the normals of fit_normals(), and the input's name, place and units (same origin); UVs with
/// `keep_uvs`, else none. Collapses preserve the borders between its groups, objects and materials; triangles inherit
/// the names of those that they replace. If borders are half of a low poly's edges or more, they are not preserved:
/// each triangle gets the names of most of the high poly under it. The error bound applies to the surface, not to these
/// borders. Vertex colours are fitted to the high poly's (least squares in linear light). The triangle count is the
/// target, or one below it, since a collapse removes two; with two-sided sheets, up to three below it. Each repaired
/// triangle may remove up to two more. The result does not depend on scale.
/// Deterministic: the same on every run and number of threads. Lifetimes: `high` is read during the call, and the
/// result is the caller's own. Thread safety: may be called from several threads. Reports to a ProgressScope, which may
/// cancel it.
/// \param report  receives the report; may be null (which saves measuring with `faces`)
///
/// With `keep_uvs`, vertices of seams, open borders and borders between groups move along these lines only. Ends and
/// crossings are fixed, and no triangle is mirrored in the layout. Charts that did not overlap never do. UVs inside a
/// chart follow the affine maps of the original triangles (Hoppe 1999). A corner without a finite UV gets its chart's
/// UV at that vertex, or else the mean of its neighbours'. "non-finite-uvs" counts such triangles; those without any UV
/// are unchanged. Triangles out of the unit square are counted ("uv-outside").
///
/// With `hull`, each collapse moves its vertex to a position outside of, or on, the planes of all triangles
/// around the edge. Of these positions, the one with the least sum of squared distances is used (Sander, Gu, Gortler,
/// Hoppe and Snyder 2000, "Silhouette Clipping", section 4.1).
/// \throws Error(usage) for options out of range or that exclude each other; Error(input) if no usable triangle is
///         left, or keep_uvs finds no UVs
/// Cost, two cores: 0.4 s for 70,000 faces to 2,000; 1.0 to 1.4 s for a million to 5,000; with a bound about twice
/// that. O(n log n) in the number of triangles, regardless of vertex valence.
Mesh simplify(const Mesh& high, const SimplifyOptions& options = {},
              SimplifyReport* report = nullptr);

/// A low poly of simplify_levels().
struct SimplifiedLevel {
  Mesh mesh = {};  ///< The simplified mesh, as simplify() returns it
  /// Report of this level, like that of simplify(); `seconds` is the time that the level took
  SimplifyReport report = {};
};

/// Low polys with several numbers of faces from one run of collapses, such as levels of detail: they cost little more
/// than the finest alone. A level equals the result of simplify() for its number of faces if the mesh needs no
/// presimplification, or if no number exceeds 5,000; else coarse levels may differ slightly.
/// \param faces  descending. For a number below the fewest faces that keep the topology, the coarsest level is
///               returned
/// \param options  keep_uvs or height_field; `faces` is ignored, and the other members must have their defaults
/// \returns a level for each number, in their order
/// \throws as simplify(); Error(usage) for numbers that do not descend, or for none
/// Thread safety, lifetimes and progress: as simplify().
std::vector<SimplifiedLevel> simplify_levels(const Mesh& high, std::span<const std::uint32_t> faces,
                                             const SimplifyOptions& options = {});

}  // namespace kiln
