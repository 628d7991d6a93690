#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/measure.h"
#include "kiln/mesh.h"
#include "kiln/simplify.h"
#include "kiln/source.h"
#include "kiln/unwrap.h"

namespace KILN_PUBLIC kiln {

// Plans reach a bound of the rendered normals' error at the least cost: bake_planned() for a given low poly,
// plan_low_poly() for one that it makes, bake_lods() for one per size on screen. All are deterministic: the same on
// every run and number of threads. Lifetimes, threads, tangents and welding are those of bake() and simplify(): no
// argument is kept, and several threads may plan from one Source. BakeOptions::progress runs on the calling thread, ten
// times a second; if it cancels, the result's `cancelled` is set. The share done of bake_planned() stays 0.

/// Number of directions from which plans measure, and pixels a side of bake_planned()'s pictures. `kiln measure` uses
/// the same directions; matches never use them.
inline constexpr std::uint32_t kPlanViews = 30, kPlanPixels = 64;
/// Smallest side of maps in plan_low_poly(), texels.
inline constexpr std::uint32_t kSmallestMap = 16;

// ---- A given low poly: choice of the match and of the map's size ----

/// Bound of the error, and options of the bake.
struct PlanOptions {
  /// Bound of the mean angle, degrees, between rendered normals of the low poly with its map and the high
  /// poly's. 0: the error from which larger maps improve by less than 5%.
  double max_error = 0;
  /// Bounds of other baked maps, each once. Maps grow beyond what `max_error` needs until each is within its bound.
  std::vector<MapBound> bounds = {};
  /// With a bound of the map ao and no OcclusionOptions::max_error: sets that to half of the bound.
  bool choose_rays = true;
  /// All other options; the method is ignored. Width and height are the largest size of the map.
  BakeOptions bake = {};
};

/// A bake that was tried and measured.
struct PlanTrial {
  MatchMethod method = MatchMethod::ray;  ///< Match that was tried
  std::uint32_t width = 0;                ///< Side of the map, texels
  std::uint32_t height = 0;               ///< Side of the map, texels
  NormalError error = {};                 ///< Over kPlanViews pictures of kPlanPixels x kPlanPixels
  double missed = 0;                      ///< Share of samples that were missed
  double lost =
      0;  ///< Share of the high poly that no sample stands for (HighCoverageReport::lost), or 0
  double seconds =
      0;  ///< Duration of the bake, with structures of the source that it was the first to need
};

/// Error that a match would reach with a map of unlimited size: measured by matching the points that pictures
/// show.
struct PlanLimit {
  MatchMethod method = MatchMethod::ray;  ///< Match that was evaluated
  NormalError error = {};                 ///< Error over the same pixels
  double missed = 0;                      ///< Share of pixels that were missed
  double seconds = 0;                     ///< Duration of the evaluation
};

/// The chosen bake, and the alternatives.
struct PlannedBake {
  BakeResult result = {};              ///< The maps
  std::vector<PlanTrial> trials = {};  ///< Trials in order
  std::vector<PlanLimit> limits = {};  ///< Limits of the evaluated matches, in order
  /// Smallest error that any map can reach, if no match reaches the bound, since a place shows one normal to all sides.
  double least = 0;
  PlanTrial chosen = {};         ///< The trial of `result`
  NormalError without_map = {};  ///< Error of the low poly's own normals, measured the same way
  double wanted = 0;             ///< Bound, degrees; with max_error 0: the one that was derived
  bool reached = false;  ///< `chosen` is within `wanted`, and each of `bounds` within its own
  std::vector<MapReached> bounds = {};  ///< Errors of `result` for PlanOptions::bounds
  double seconds_measure = 0;           ///< Duration of measuring, without the bakes
};

/// Bakes with the cheapest match for a mesh of this size that reaches the bound, and with the smallest such map.
///
/// Matching the points that pictures show gives the error of a map of unlimited size. A small map is baked and measured
/// there, errors of larger ones are extrapolated, and the smallest map expected to reach the bound is baked. `reached`
/// is measured on the final map. Matching by UVs comes first where the high poly's lie over the low poly's, then rays
/// (of more than two million triangles: views); with a cage, rays alone. If no match is expected to reach the bound,
/// the closest one is baked, at a size that larger ones would improve by less than 5%. Parts of the high poly that a
/// trial loses count as without a map.
/// \throws as bake(), and Error(usage) for a negative or not finite error, or maps without a normal map
PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options);

// ---- A low poly made by Kiln: choice of faces, map size, samples, match and bits together ----

/// Memory that a low poly and its maps take in a renderer.
///
/// A vertex has 24 bytes: position 12, normal 4, tangent 4, UV 4; without a map 16. A vertex at a seam counts once per
/// side. An index has 2 bytes, 4 beyond 65,536 vertices. Maps have mip-maps, which add a third. A texel has 1 byte in
/// blocks of 8 bits per channel (BC5, BC7), half a byte with one channel (BC4), 2 bytes per channel with 16 bits.
struct LowPolyBytes {
  std::uint64_t vertices = 0;  ///< Bytes of vertices and indices
  std::uint64_t texels = 0;    ///< Bytes of all maps
  /// Bytes of both.
  std::uint64_t total() const { return vertices + texels; }
};

struct LowPolyPlan;

/// Bound of the error, size on screen, and options of the bake.
struct LowPolyPlanOptions {
  /// Bound of the mean angle, degrees, between rendered normals of the low poly with its map and the high poly's.
  /// Above 0.
  double max_error = 0;
  /// Bounds of other baked maps, each once. Maps too small for one of them are excluded.
  std::vector<MapBound> bounds = {};
  /// With a bound of the map ao and no OcclusionOptions::max_error: sets that to half of the bound.
  bool choose_rays = true;
  /// Largest size at which the mesh is seen, pixels: the longer of width and height that it covers, 16 to 16384, from
  /// all sides. Mean normals of pixels are compared, so finer detail does not count. 0: unlimited.
  std::uint32_t screen = 0;
  /// Bound of the silhouettes' difference: the share of the covered area in pictures that only one mesh covers; below
  /// 1. 0: derived from the error; meshes with a difference over 10% are replaced by finer ones if these have less.
  double max_outline = 0;
  bool choose_match = true;  ///< Choose the match; else MatchOptions::method is used.
  /// Allow a result without a map, if the low poly's own normals suffice.
  bool may_leave_map_out = true;
  bool choose_samples = true;  ///< Choose BakeOptions::samples; false: the given value is used.
  std::uint32_t bits = 0;      ///< Bits per channel of saved maps: 8 or 16; 0: choose.
  /// Options of the bake, with the map MapKind::normal. Its size is the largest size of maps, at least kSmallestMap;
  /// maps are square. Without a max_distance or cage, the search distance grows up to 16% of the diagonal if samples
  /// are missed. No cage mesh, no parts, no saved match.
  BakeOptions bake = {};
  UnwrapMethod unwrap = UnwrapMethod::charts;  ///< Layout of the low poly
  TexelDensity density = TexelDensity::area;   ///< Texel density of large charts
  /// The high poly is a height_field_mesh(). Low polys keep its border (SimplifyOptions::height_field) and its layout,
  /// and MatchMethod::uv is tried first.
  bool height_field = false;
  /// Called on the calling thread once the choice is measured, so that it can be shown early. LowPolyPlan::chosen,
  /// candidates, trade, outlook, levels and wanted are final then. Called again if the choice missed the bound and the
  /// search continued. May be null.
  std::function<void(const LowPolyPlan&)> on_measured = {};
};

/// A low poly with a map of some size: expected by the model, or made and measured.
struct Candidate {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices before seams split them
  /// Vertices with seams split; estimated unless the mesh was laid out
  std::uint64_t vertices = 0;
  std::uint64_t charts = 0;               ///< Charts of its layout; 0 if it was not laid out
  std::uint32_t size = 0;                 ///< Texels a side; 0: no map
  std::uint32_t samples = 1;              ///< BakeOptions::samples
  std::uint32_t bits = 8;                 ///< Bits per channel
  MatchMethod method = MatchMethod::ray;  ///< Match method
  LowPolyBytes bytes = {};                ///< Memory in a renderer
  double expected = 0;                    ///< Mean angle predicted by the model, degrees
  double measured = -1;            ///< Mean angle measured with the map, degrees; below 0: not made
  double silhouette_mismatch = 0;  ///< NormalError::one_sided_share of the same pictures
  double standard_error = 0;  ///< Standard error of `measured`: NormalError::standard_error_degrees
};

/// A simplified mesh that the plan evaluated, and the errors that it can reach.
struct PlanLevel {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices
  double without_map = 0;       ///< Mean angle of its own normals, degrees
  double limit = 0;             ///< Error with a map of unlimited size, degrees
};

/// The low poly and maps of least memory that reach a bound, and the alternatives.
struct LowPolyPlan {
  Mesh low = {};                               ///< With UVs if there is a map
  SimplifyReport simplified = {};              ///< Report of the mesh's simplification
  std::optional<UnwrapReport> unwrapped = {};  ///< Report of the layout; none without a map
  std::optional<BakeResult> result = {};       ///< The maps; none if no map is needed
  BakeOptions bake = {};                       ///< Options that `result` was baked with
  Image drawn = {};  ///< The normal map as renderers read it: n/2 + 1/2, rounded to `chosen`'s bits
  Candidate chosen = {};                   ///< The candidate of `low` and `result`
  std::vector<Candidate> candidates = {};  ///< Candidates that were made and measured, in order
  /// By rising map size: the fewest faces expected to reach the bound with each
  std::vector<Candidate> trade = {};
  std::vector<Candidate> outlook =
      {};                              ///< Expected candidates: each of `levels` with each map size
  std::vector<PlanLevel> levels = {};  ///< Levels that were evaluated, by rising faces
  double wanted = 0;                   ///< LowPolyPlanOptions::max_error
  double max_outline = 0;              ///< LowPolyPlanOptions::max_outline
  /// `chosen` was measured within `wanted`, within `max_outline` if one was requested, and each of `bounds` within its
  /// own.
  bool reached = false;
  std::vector<MapReached> bounds = {};  ///< Errors of `result` for LowPolyPlanOptions::bounds
  bool cancelled = false;               ///< Cancelled by BakeOptions::progress
  double seconds_simplify = 0;          ///< Simplification
  double seconds_unwrap = 0;            ///< Layouts
  double seconds_measure = 0;           ///< Evaluation of meshes and maps
};

/// Memory of a low poly with square maps.
/// \param vertices  with seams split
/// \param size      texels a side; 0: no maps
/// \param channels  of each map
LowPolyBytes low_poly_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                            const std::vector<std::uint32_t>& channels, std::uint32_t bits);

/// Number of vertices in a renderer's buffer: a position counts once for every pair of UV and normal that its
/// corners have, by index.
std::uint64_t split_vertices(const Mesh& mesh);

/// Chooses faces, map size, samples, match and bits together, for the least memory that reaches a bound.
///
/// One run of simplify() gives meshes of all numbers of faces. Pictures of some of them give the error without a map
/// and with a map of unlimited size; one map and its mip-maps give the error that texels of each size add. The pair of
/// faces and map size of least memory that is expected to reach the bound is made and measured, which corrects the
/// predictions for the others; this repeats until no lighter pair is expected to reach it. The returned result is
/// always measured with its final map. Meshes with defects are replaced by finer ones.
/// \param high  the mesh from which `source` was made
/// \throws as simplify(), unwrap() and bake(); Error(usage) for options out of range, or options for a given low poly
LowPolyPlan plan_low_poly(const Source& source, const Mesh& high,
                          const LowPolyPlanOptions& options);

// ---- A chain of low polys, each for half the size on screen of the one before ----

/// The first level's plan, and the differences of the others.
struct LodOptions {
  /// Bound of every level's error, and options of the bake. `screen` is the largest size at which the first level
  /// will be seen. The last one's, screen / 2^(levels - 1), must be 16 pixels or more.
  LowPolyPlanOptions plan = {};
  std::uint32_t levels = 4;  ///< 2 to 8
  /// Factor of the error bounds from level to level, of silhouettes and `plan.bounds`, too: 1 to 4.
  double error_growth = 1;
  /// All levels share the first level's UV layout and maps. Else each has its own. A map in tangent space rotates
  /// with the normals of each level; one in object space needs fewer faces.
  bool share_uvs = false;
};

/// One mesh of a chain.
struct LodLevel {
  /// Width of the mesh on screen, pixels, at and below which this level is used, down to the next
  /// level's.
  std::uint32_t screen = 0;
  bool own_maps =
      true;  ///< True: it has its own maps, or needs none; false: the first level's maps are used.
  /// `chosen.measured` is the error at `screen`, `wanted` its bound. With the first level's maps there is no `result`,
  /// and `candidates` holds the measured meshes.
  LowPolyPlan plan = {};
};

/// Levels of detail that bake_lods() made.
struct LodChain {
  std::vector<LodLevel> levels =
      {};  ///< By falling `screen` and bytes; may be fewer than requested
  std::vector<Warning> warnings = {};  ///< "lod-left-out": a size for which no level was made
  bool reached = false;                ///< All levels are within their bounds.
  /// Cancelled by BakeOptions::progress; `levels` is then incomplete.
  bool cancelled = false;
};

/// Plans a chain of low polys: plan_low_poly() for `screen`, half of it, a quarter and so on. A level with more faces
/// than the one before, or over 90% of its bytes, is left out with a warning, and the one before is used for its size,
/// too. With shared UVs the levels after the first are simplified from it with its layout kept: the fewest faces with
/// which its map, rounded as it is saved, stays within the error.
/// \throws as plan_low_poly(); Error(usage) for levels, growth or screen out of range
LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options);

}  // namespace kiln
