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

// Plans reach an error of rendered normals at the least cost: bake_planned() for a given low poly, plan_low_poly() with
// one of its own, bake_lods() with one for each size on screen. All are deterministic: the same on every run and number
// of threads. Lifetimes, threads, tangents and welding are those of bake() and simplify(): nothing is kept, and several
// threads may plan from one Source. BakeOptions::progress comes on the caller's thread, ten times a second; where it
// says stop, the result's `cancelled` is set. The share done of bake_planned() stays 0.

/// Directions that plans measure from, and pixels a side of bake_planned()'s pictures. `kiln measure` looks from these
/// directions too; nothing is matched from them.
inline constexpr std::uint32_t kPlanViews = 30, kPlanPixels = 64;
/// Maps of plan_low_poly() have so many texels a side at least.
inline constexpr std::uint32_t kSmallestMap = 16;

// ---- A given low poly: which match, and which size of the map ----

/// The error to reach, and what to bake.
struct PlanOptions {
  /// The mean angle, degrees, between rendered normals of the low poly with its map and the high poly's. 0: what
  /// larger maps would not improve by more than 5%.
  double max_error = 0;
  /// Bounds of other maps that are baked, each once. Maps grow beyond what `max_error` needs until each is within its bound.
  std::vector<MapBound> bounds = {};
  /// For a bound of the map ao without OcclusionOptions::max_error: half of it is left to the rays.
  bool choose_rays = true;
  /// Everything but the method. Its size is the largest that the map may have.
  BakeOptions bake = {};
};

/// One bake that was tried and measured.
struct PlanTrial {
  MatchMethod method = MatchMethod::ray;  ///< That was tried
  std::uint32_t width = 0;                ///< Side of the map, texels
  std::uint32_t height = 0;               ///< Side of the map, texels
  NormalError error = {};                 ///< Over kPlanViews pictures of kPlanPixels x kPlanPixels
  double missed = 0;                      ///< Share of samples
  double lost =
      0;  ///< Share of the high poly that no sample stands for (HighCoverageReport::lost), or 0
  double seconds =
      0;  ///< Time of the bake; structures of the source that it was the first to need included
};

/// Error that a way to match would reach with a map of endless size: its matches of the points that pictures show.
struct PlanLimit {
  MatchMethod method = MatchMethod::ray;  ///< That was looked at
  NormalError error = {};                 ///< Over the same pixels
  double missed = 0;                      ///< Share of them
  double seconds = 0;                     ///< That finding it took
};

/// The bake that a plan chose, and what it chose from.
struct PlannedBake {
  BakeResult result = {};              ///< The maps
  std::vector<PlanTrial> trials = {};  ///< In order
  std::vector<PlanLimit> limits =
      {};  ///< Limits of the ways to match that were looked at, in order
  /// Least error that any map can reach, where nothing reaches the one asked for, since a place shows one normal to all sides.
  double least = 0;
  PlanTrial chosen = {};         ///< The trial that `result` is of
  NormalError without_map = {};  ///< The low poly's own normals, measured alike
  double wanted = 0;             ///< Degrees; with max_error 0: what that came to
  bool reached = false;  ///< `chosen` is within `wanted`, and each of `bounds` within its own
  std::vector<MapReached> bounds = {};  ///< Errors that `result` reaches, for PlanOptions::bounds
  double seconds_measure = 0;           ///< Time of measuring, beside the bakes
};

/// Bakes with the match that costs least on a mesh of this size and reaches the error, and the smallest such map.
///
/// Points that pictures show are matched as texels would be: what a map of endless size reaches. A small map is baked
/// and measured there, errors of larger ones follow, and the smallest that should do is baked. `reached` is measured on
/// the very map. Matching by UVs comes first where the high poly's lie over the low poly's, then rays (of more than two
/// million triangles: views); with a cage, rays alone. Where none is expected to do, the one that gets nearest is baked
/// at a size that larger ones would not improve by 5%. Parts of the high poly that a trial loses count as without a map.
/// \throws as bake(), and Error(usage) for a negative or not finite error, or maps without a normal map
PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options);

// ---- A low poly of Kiln's own: faces, map size, samples, match and bits together ----

/// Memory that a low poly and its maps take in a renderer.
///
/// A vertex takes 24 bytes: position 12, normal 4, tangent 4, UV 4; without a map 16. A vertex at a seam counts once a
/// side. An index takes 2 bytes, 4 beyond 65,536 vertices. Maps have mip-maps, which add a third. A texel takes 1 byte
/// in blocks of 8 bits a channel (BC5, BC7), half a byte with one channel (BC4), 2 bytes a channel with 16 bits.
struct LowPolyBytes {
  std::uint64_t vertices = 0;  ///< Bytes of vertices and indices
  std::uint64_t texels = 0;    ///< Bytes of all maps
  /// Bytes of both.
  std::uint64_t total() const { return vertices + texels; }
};

struct LowPolyPlan;

/// The error to reach, how large the mesh will be seen, and what to bake.
struct LowPolyPlanOptions {
  /// The mean angle, degrees, between rendered normals of the low poly with its map and the high poly's. Above 0.
  double max_error = 0;
  /// Bounds of other maps that are baked, each once. Maps too small for one of them are left out of the choice.
  std::vector<MapBound> bounds = {};
  /// For a bound of the map ao without OcclusionOptions::max_error: half of it is left to the rays.
  bool choose_rays = true;
  /// Pixels that the mesh covers, the longer of width and height, at the largest size at which it is seen: 16 to 16384,
  /// from all sides. Mean normals of pixels are compared, so what is finer does not count. 0: endlessly many pixels.
  std::uint32_t screen = 0;
  /// Largest difference of outlines: the share of what either mesh covers in pictures that one covers alone; below 1.
  /// 0: as the error asks; but meshes that differ by over a tenth give way where finer ones do.
  double max_outline = 0;
  bool choose_match = true;       ///< Choose how to match; else MatchOptions::method does.
  bool may_leave_map_out = true;  ///< The low poly's own normals may do, without a map.
  bool choose_samples = true;     ///< Choose BakeOptions::samples; else they stay.
  std::uint32_t bits = 0;         ///< Bits a channel that maps are saved with: 8 or 16; 0: choose.
  /// Options of the bake, with the map MapKind::normal. Its size is the largest that maps may have, kSmallestMap at least; maps
  /// are square. Without a max_distance or cage, the distance grows up to 16% of the diagonal where samples are missed.
  /// No cage mesh, no parts, no saved match.
  BakeOptions bake = {};
  UnwrapMethod unwrap = UnwrapMethod::charts;  ///< Layout of the low poly
  TexelDensity density = TexelDensity::area;   ///< Texel density of large charts
  /// The high poly is a height_field_mesh(). Low polys keep its border (SimplifyOptions::height_field) and its layout,
  /// and MatchMethod::uv is tried first.
  bool height_field = false;
  /// Called on the caller's thread as soon as the choice is measured, so that it can be shown meanwhile.
  /// LowPolyPlan::chosen, candidates, trade, outlook, levels and wanted stand then. Called again where that missed the
  /// error and the search went on. May be null.
  std::function<void(const LowPolyPlan&)> on_measured = {};
};

/// A low poly with a map of a size: expected, or made and measured.
struct Candidate {
  std::uint64_t faces = 0;                ///< Triangles
  std::uint64_t positions = 0;            ///< Vertices before seams split them
  std::uint64_t vertices = 0;             ///< Vertices after that; expected where nothing was made
  std::uint64_t charts = 0;               ///< Charts of its layout; 0 where nothing was laid out
  std::uint32_t size = 0;                 ///< Texels a side; 0: no map
  std::uint32_t samples = 1;              ///< BakeOptions::samples
  std::uint32_t bits = 8;                 ///< A channel
  MatchMethod method = MatchMethod::ray;  ///< Way to find points of the high poly
  LowPolyBytes bytes = {};                ///< In memory
  double expected = 0;                    ///< Mean angle, degrees, by the model
  double measured = -1;            ///< Mean angle, degrees, of the map itself; below 0: not made
  double silhouette_mismatch = 0;  ///< NormalError::one_sided_share of the same pictures
  double standard_error = 0;  ///< Standard error of `measured`: NormalError::standard_error_degrees
};

/// A simplified mesh that the plan looked at, and the errors that it can reach.
struct PlanLevel {
  std::uint64_t faces = 0;      ///< Triangles
  std::uint64_t positions = 0;  ///< Vertices
  double without_map = 0;       ///< Mean angle of its own normals, degrees
  double limit = 0;             ///< With a map of endless size, degrees
};

/// The lightest low poly and maps that reach an error, and what they were chosen from.
struct LowPolyPlan {
  Mesh low = {};                               ///< With UVs where there is a map
  SimplifyReport simplified = {};              ///< Report of the mesh's simplification
  std::optional<UnwrapReport> unwrapped = {};  ///< None without a map
  std::optional<BakeResult> result = {};       ///< The maps; none where no map is needed
  BakeOptions bake = {};                       ///< That `result` is baked with
  Image drawn = {};  ///< The normal map as renderers read it: n/2 + 1/2, rounded to `chosen`'s bits
  Candidate chosen = {};                   ///< The candidate that `low` and `result` are
  std::vector<Candidate> candidates = {};  ///< That were made and measured, in order
  std::vector<Candidate> trade = {};  ///< By rising size: the fewest faces expected to do with each
  std::vector<Candidate> outlook = {};  ///< Expected, of `levels` with each size
  std::vector<PlanLevel> levels = {};   ///< That were evaluated, by rising faces
  double wanted = 0;                    ///< LowPolyPlanOptions::max_error
  double max_outline = 0;               ///< LowPolyPlanOptions::max_outline
  /// `chosen` was measured within `wanted` and, where it was asked for, `max_outline`; each of `bounds` within its own.
  bool reached = false;
  std::vector<MapReached> bounds =
      {};                       ///< Errors that `result` reaches, for LowPolyPlanOptions::bounds
  bool cancelled = false;       ///< By BakeOptions::progress
  double seconds_simplify = 0;  ///< Making low polys
  double seconds_unwrap = 0;    ///< Laying them out
  double seconds_measure = 0;   ///< Evaluating them and maps
};

/// Bytes of a low poly with square maps.
/// \param vertices  after splitting at seams
/// \param size      texels a side; 0: no maps
/// \param channels  of each map
LowPolyBytes low_poly_bytes(std::uint64_t vertices, std::uint64_t faces, std::uint32_t size,
                            const std::vector<std::uint32_t>& channels, std::uint32_t bits);

/// Vertices of a mesh as a renderer holds them: a position has one for every pair of UV and normal that its corners
/// have, by index.
std::uint64_t split_vertices(const Mesh& mesh);

/// Chooses faces, map size, samples, match and bits together: the fewest bytes that reach an error.
///
/// One run of simplify() gives meshes of all numbers of faces. Pictures of a few tell the error without a map and with
/// an endless one; one map and its mip-maps tell what texels of each size add. The lightest pair of faces and size that
/// is expected to do is made and measured, which corrects what is expected of others; that repeats until nothing
/// lighter is. What is returned is always measured on the very map. Meshes with flaws give way to finer ones.
/// \param high  the mesh that `source` was made of
/// \throws as simplify(), unwrap() and bake(); Error(usage) for options out of range, or of a given low poly
LowPolyPlan plan_low_poly(const Source& source, const Mesh& high,
                          const LowPolyPlanOptions& options);

// ---- A chain of low polys, each for half the size on screen of the one before ----

/// The first level's plan, and how the others differ.
struct LodOptions {
  /// The error that every level is to reach, and what to bake. `screen` is the largest size at which the first level
  /// will be seen. The last one's, screen / 2^(levels - 1), must be 16 pixels or more.
  LowPolyPlanOptions plan = {};
  std::uint32_t levels = 4;  ///< 2 to 8
  /// Each level may be off by so many times the one before, in outlines and `plan.bounds`, too: 1 to 4.
  double error_growth = 1;
  /// All levels have the first one's UV layout, and its maps serve all. Else each has its own. A map in tangent space
  /// turns with the normals of each level; one in object space does with fewer faces.
  bool share_uvs = false;
};

/// One mesh of a chain.
struct LodLevel {
  std::uint32_t screen =
      0;  ///< It takes over where the mesh is so many pixels wide, down to the next level's size.
  bool own_maps =
      true;  ///< It has maps of its own, or needs none; else the first level's serve it.
  /// `chosen.measured` is the error at `screen`, `wanted` its bound. Where the first level's maps serve it, there is no
  /// `result`, and `candidates` has the meshes that were measured.
  LowPolyPlan plan = {};
};

/// Levels of detail that bake_lods() made.
struct LodChain {
  std::vector<LodLevel> levels =
      {};  ///< By falling `screen` and bytes; may be fewer than asked for
  std::vector<Warning> warnings = {};  ///< "lod-left-out": a size for which none was made
  bool reached = false;                ///< All levels are within their bounds.
  bool cancelled = false;              ///< By BakeOptions::progress; then `levels` is not whole.
};

/// Plans a chain of low polys: plan_low_poly() for `screen`, half of it, a quarter and so on. A level with more faces
/// than the one before, or over 90% of its bytes, is left out with a warning: the one before serves its size, too. With
/// shared UVs the levels after the first are simplified from it with its layout kept: the fewest faces with which its
/// map, rounded as it is saved, stays within the error.
/// \throws as plan_low_poly(); Error(usage) for levels, growth or screen out of range
LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options);

}  // namespace kiln
