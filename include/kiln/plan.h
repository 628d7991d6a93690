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
// times a second; if it cancels, the result's `cancelled` is set. The completed share that bake_planned() reports stays
// 0.

/// Number of directions from which plans measure errors, and pixels a side of the pictures of bake_planned(). `kiln
/// measure` uses the same directions; matches never use them.
inline constexpr std::uint32_t kPlanViews = 30, kPlanPixels = 64;
/// Smallest side of maps in plan_low_poly(), texels.
inline constexpr std::uint32_t kSmallestMap = 16;

// ---- A given low poly: choice of the match and of the map's size ----

/// Settings of bake_planned(): bounds of errors, and options of the bake.
struct PlanOptions {
  /// Bound of the mean angle, degrees, between rendered normals of the low poly with its map and those of the high
  /// poly. 0: the bound is the error beyond which a larger map would improve it by less than 5%.
  double max_error = 0;
  /// Error bounds of other baked maps, at most one for each map. Maps grow beyond the size that
  /// `max_error` needs until each map is within its bound.
  std::vector<MapBound> bounds = {};
  /// If there is a bound for the map ao, and OcclusionOptions::max_error is 0: set the latter to
  /// half of the bound.
  bool choose_rays = true;
  /// All other options of the bake. Its match method is ignored; width and height are the largest
  /// size of the map.
  BakeOptions bake = {};
};

/// A bake that a plan made and measured.
struct PlanTrial {
  MatchMethod method = MatchMethod::ray;  ///< Match that was tried
  std::uint32_t width = 0;                ///< Side of the map, texels
  std::uint32_t height = 0;               ///< Side of the map, texels
  NormalError error = {};  ///< Error over kPlanViews pictures of kPlanPixels x kPlanPixels pixels
  double missed = 0;       ///< Share of samples that were missed
  /// Share of the high poly that no sample represents (HighCoverageReport::lost); 0 if not measured
  double lost = 0;
  /// Duration of the bake, including the building of structures of the source that no earlier bake
  /// had needed
  double seconds = 0;
};

/// Error that a match would reach with a map of unlimited size. It is measured by matching the surface points that the
/// rendered pictures show.
struct PlanLimit {
  MatchMethod method = MatchMethod::ray;  ///< Match that was evaluated
  NormalError error = {};                 ///< Error over the pixels of PlanTrial::error
  double missed = 0;                      ///< Share of pixels that were missed
  double seconds = 0;                     ///< Duration of the evaluation
};

/// The chosen bake, and the alternatives that were measured.
struct PlannedBake {
  BakeResult result = {};              ///< The maps
  std::vector<PlanTrial> trials = {};  ///< Trials in the order in which they were made
  /// For each evaluated match, its error with a map of unlimited size; in the order of evaluation
  std::vector<PlanLimit> limits = {};
  /// If no match reaches the bound: a lower limit of the error of any map, degrees. It is above 0, since a texel shows
  /// the same normal in all views.
  double least = 0;
  PlanTrial chosen = {};  ///< The trial that produced `result`
  /// Error of the low poly's own normals, without a map, over the same pixels
  NormalError without_map = {};
  /// Error bound in use, degrees: PlanOptions::max_error; if that is 0, the bound that the plan
  /// derived
  double wanted = 0;
  /// True if the error of `chosen` is at most `wanted`, and all `bounds` are reached
  bool reached = false;
  std::vector<MapReached> bounds = {};  ///< Errors of `result` for PlanOptions::bounds
  double seconds_measure = 0;           ///< Duration of measuring, without that of the bakes
};

/// Bakes with the cheapest match that reaches the bound for a high poly of this size, and with the smallest map that
/// reaches it.
///
/// Errors are measured in rendered pictures of the low poly. For each match that is tried, the surface points that the
/// pictures show are matched directly, without texels. Their error is that of a map of unlimited size. Then a small map
/// is baked and its error measured in the same pictures. Errors of larger maps are extrapolated, and the smallest map
/// that is expected to reach the bound is baked. `reached` is measured on the final map. Matching by UVs is tried first
/// if the high poly's UVs coincide with the low poly's, then rays (views, if the high poly has more than two million
/// triangles); with a cage, only rays are tried. If no match is expected to reach the bound, the one with the smallest
/// error is baked, at the size beyond which a larger map would reduce the error by less than 5%. For the
/// choice between bakes, the error without a map counts for the share of the high poly that no sample represents.
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

/// Settings of plan_low_poly(): bounds of errors, size on screen, and options of the bake.
struct LowPolyPlanOptions {
  /// Bound of the mean angle, degrees, between rendered normals of the low poly with its map and the high poly's.
  /// Above 0.
  double max_error = 0;
  /// Error bounds of other baked maps, at most one for each map. Map sizes at which a map exceeds
  /// its bound are excluded.
  std::vector<MapBound> bounds = {};
  /// If there is a bound for the map ao, and OcclusionOptions::max_error is 0: set the latter to
  /// half of the bound.
  bool choose_rays = true;
  /// Largest size at which the mesh is seen: the longer of width and height that it covers in pictures from all
  /// sides, 16 to 16384 pixels. The mean normals of pixels are compared, so detail that is finer than a pixel does
  /// not count. 0: unlimited.
  std::uint32_t screen = 0;
  /// Bound of the difference between the silhouettes of the low poly and the high poly, below 1:
  /// the share of the pixels covered by either mesh that only one mesh covers. 0: no bound, but a
  /// mesh with a difference over 10% is replaced by a finer mesh if the finer one differs less.
  double max_outline = 0;
  bool choose_match = true;  ///< Choose the match method; if false, MatchOptions::method is used.
  /// Allow a result without a map, if the low poly's own normals suffice.
  bool may_leave_map_out = true;
  bool choose_samples = true;  ///< Choose BakeOptions::samples; if false, the given value is used.
  std::uint32_t bits = 0;      ///< Bits per channel of saved maps: 8 or 16; 0: the plan chooses.
  /// Options of the bake, with the map MapKind::normal. Its size is the largest size of maps, at least kSmallestMap;
  /// maps are square. Without a max_distance or cage, the search distance grows up to 16% of the diagonal if samples
  /// are missed. No cage mesh, no parts, no saved match.
  BakeOptions bake = {};
  UnwrapMethod unwrap = UnwrapMethod::charts;  ///< Layout of the low poly
  TexelDensity density = TexelDensity::area;   ///< Texel density of large charts
  /// The high poly is a height_field_mesh(). Low polys keep its border (SimplifyOptions::height_field) and its layout,
  /// and MatchMethod::uv is tried first.
  bool height_field = false;
  /// Called on the calling thread once the chosen candidate is measured, so that it can be shown before the other
  /// results. LowPolyPlan::chosen, candidates, trade, outlook, levels and wanted are final then. Called again if that
  /// candidate missed the bound and the search continued. May be null.
  std::function<void(const LowPolyPlan&)> on_measured = {};
};

/// A low poly with a map of some size: predicted by the error model, or made and measured.
struct Candidate {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Number of vertices before they are split at seams
  /// Number of vertices after they are split at seams; estimated unless the mesh was unwrapped
  std::uint64_t vertices = 0;
  std::uint64_t charts = 0;               ///< Number of charts; 0 if the mesh was not unwrapped
  std::uint32_t size = 0;                 ///< Texels a side of the maps; 0: no map
  std::uint32_t samples = 1;              ///< Value of BakeOptions::samples
  std::uint32_t bits = 8;                 ///< Bits per channel
  MatchMethod method = MatchMethod::ray;  ///< Match method
  LowPolyBytes bytes = {};                ///< Memory in a renderer
  double expected = 0;                    ///< Mean angle predicted by the model, degrees
  /// Mean angle that was measured with the map, degrees; below 0: the candidate was not made
  double measured = -1;
  double silhouette_mismatch = 0;  ///< NormalError::one_sided_share in the pictures of `measured`
  /// Standard error of `measured`, see NormalError::standard_error_degrees
  double standard_error = 0;
};

/// A simplified mesh that the plan evaluated, and the errors that it can reach.
struct PlanLevel {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices
  double without_map = 0;       ///< Mean angle of the level's own normals, without a map, degrees
  double limit = 0;             ///< Mean angle with a map of unlimited size, degrees
};

/// The low poly and maps of least memory that reach a bound, and the alternatives.
struct LowPolyPlan {
  Mesh low = {};                               ///< The low poly, with UVs if there is a map
  SimplifyReport simplified = {};              ///< Report of the mesh's simplification
  std::optional<UnwrapReport> unwrapped = {};  ///< Report of unwrapping; none if there is no map
  std::optional<BakeResult> result = {};       ///< The maps; none if no map is needed
  BakeOptions bake = {};                       ///< Options that `result` was baked with
  Image drawn = {};  ///< The normal map as renderers read it: n/2 + 1/2, rounded to `chosen`'s bits
  Candidate chosen = {};  ///< The candidate to which `low` and `result` belong
  /// Candidates that were made and measured, in the order in which they were made
  std::vector<Candidate> candidates = {};
  /// For each map size, in ascending order, the candidate with the fewest faces that is expected to
  /// reach the bound
  std::vector<Candidate> trade = {};
  std::vector<Candidate> outlook =
      {};  ///< All predicted candidates: each of `levels` with each map size
  /// Levels that were evaluated, in the order of ascending numbers of faces
  std::vector<PlanLevel> levels = {};
  double wanted = 0;  ///< Bound of the error: LowPolyPlanOptions::max_error
  /// Bound of the silhouettes' difference: LowPolyPlanOptions::max_outline
  double max_outline = 0;
  /// True if the measured error of `chosen` is at most `wanted`, its difference of silhouettes at most `max_outline`
  /// if one was requested, and all `bounds` are reached.
  bool reached = false;
  std::vector<MapReached> bounds = {};  ///< Errors of `result` for LowPolyPlanOptions::bounds
  bool cancelled = false;               ///< True if BakeOptions::progress cancelled
  double seconds_simplify = 0;          ///< Duration of simplification
  double seconds_unwrap = 0;            ///< Duration of unwrapping
  double seconds_measure = 0;           ///< Duration of evaluating meshes and maps
};

/// Memory of a low poly with square maps.
/// \param vertices  with seams split
/// \param size      texels a side; 0: no maps
/// \param channels  of each map
LowPolyBytes low_poly_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                            const std::vector<std::uint32_t>& channels, std::uint32_t bits);

/// Number of vertices in a renderer's vertex buffer: a position counts once for each pair of UV index and
/// normal index that its corners have.
std::uint64_t split_vertices(const Mesh& mesh);

/// Chooses faces, map size, samples, match and bits together, for the least memory that reaches a bound.
///
/// One run of simplify() makes meshes with all numbers of faces. For some of them, the error without a map and the
/// error with a map of unlimited size are measured in pictures. One map and its mip-maps show how much error texels of
/// each size add. Of all pairs of a mesh and a map size that are expected to reach the bound, the one of least memory
/// is made and measured, which corrects the predictions for the others. This repeats until no lighter pair is expected
/// to reach the bound. The returned result is always measured with its final map. Meshes with defects are replaced by
/// finer ones.
/// \param high  the mesh from which `source` was made
/// \throws as simplify(), unwrap() and bake(); Error(usage) for options out of range, or options for a given low poly
LowPolyPlan plan_low_poly(const Source& source, const Mesh& high,
                          const LowPolyPlanOptions& options);

// ---- Levels of detail: a chain of low polys, each for half the size on screen of the previous one
// ----

/// Settings of bake_lods(): the plan of the first level, and how the other levels differ from it.
struct LodOptions {
  /// Bound of every level's error, and options of the bake. `screen` is the largest size at which the first level
  /// will be seen. The size for the last level, screen / 2^(levels - 1), must be 16 pixels or more.
  LowPolyPlanOptions plan = {};
  std::uint32_t levels = 4;  ///< 2 to 8
  /// Ratio of the error bounds of consecutive levels, 1 to 4; it applies to the silhouettes and
  /// `plan.bounds`, too.
  double error_growth = 1;
  /// All levels share the first level's UV layout and maps. If false, each level has its own layout and maps.
  /// With shared maps, normals in tangent space turn with the normals of each level; a map in object space allows
  /// levels with fewer faces.
  bool share_uvs = false;
};

/// One level of a chain of levels of detail.
struct LodLevel {
  /// Largest width of the mesh on screen, pixels, at which this level is used. At the next
  /// level's `screen` and below, that level replaces it.
  std::uint32_t screen = 0;
  /// True: the level has its own maps, or needs none; false: it uses the first level's maps.
  bool own_maps = true;
  /// Plan of the level. `chosen.measured` is the level's error at the size `screen`, and `wanted`
  /// is the bound of this error. If the level uses the first level's maps, there is no `result`,
  /// and `candidates` holds the measured meshes.
  LowPolyPlan plan = {};
};

/// Levels of detail that bake_lods() made.
struct LodChain {
  std::vector<LodLevel> levels =
      {};  ///< Levels in the order of descending `screen` and bytes; may be fewer than requested
  /// Warnings, such as "lod-left-out" about a size for which no level was made
  std::vector<Warning> warnings = {};
  bool reached = false;  ///< True if all levels are within their bounds.
  /// True if BakeOptions::progress cancelled; `levels` is then incomplete.
  bool cancelled = false;
};

/// Plans a chain of low polys: plan_low_poly() for `screen`, half of it, a quarter and so on. A
/// level that has more faces than the previous level, or over 90% of the previous level's bytes, is
/// left out with a warning; the previous level then also serves the size of the omitted one. With
/// shared UVs the later levels are simplified from the first one, and keep its layout. They have
/// the fewest faces with which the first level's map, rounded as in files, stays within the error.
/// \throws as plan_low_poly(); Error(usage) for levels, growth or screen out of range
LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options);

}  // namespace kiln
