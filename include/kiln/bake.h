#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "kiln/mesh.h"
#include "kiln/source.h"
#include "kiln/texture.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Recall: detail of the high poly that the map lacks, which no measure over the low poly can show. It is
/// the share of the visible high poly near the low poly that no sample stands for.
///
/// Sample places lie evenly over the high poly's area. A place counts if it is within the match's search
/// distance of the low poly, and if its face deviates by less than 60 degrees from the low poly's there, since a map
/// along the low poly's normal cannot hold steeper faces. Its weight is the sum of cosines over those of 64
/// directions all around that see it past the high poly, as pixels of pictures would count it. A sample
/// stands for a place within 1.5 sample spacings of its matched point if the two faces do not look
/// opposite ways. Layers closer than that are not told apart.
struct HighCoverageReport {
  std::uint64_t places = 0;  ///< Number of places that count
  /// Sum of the weights of all places, for joining reports of several maps
  double weight = 0;
  double lost = 0;     ///< Weighted share of places that no sample stands for, 0 to 1
  double largest = 0;  ///< Share of the largest connected part of the lost surface, 0 to 1
  /// Share of `lost` that is due to UV copies, 0 to 1: it lies near triangles that are not baked, and whose texels show
  /// another surface (BakeReport::uv_copies_differ). Copies of the same surface lose nothing.
  double by_copies = 0;
  std::array<double, 3> where{};  ///< A point in the middle of the largest lost part, world units
};

/// Per vertex of the high poly: whether a sample stands for it.
enum class VertexCoverage : std::uint8_t {
  beside,  ///< Not counted: unseen, steep, or not near the low poly
  held,    ///< A sample stands for it
  lost,    ///< No sample stands for it
};

/// Encoding of values as pictures.
struct EncodingOptions {
  NormalMapSpace space = NormalMapSpace::tangent;  ///< Space of maps of unit vectors
  Bitangent bitangent = Bitangent::pixel;          ///< Third axis of NormalMapSpace::tangent
  bool flip_y = false;                             ///< Green down (DirectX); default up (OpenGL)
  /// Leave out the third component (0): z = sqrt(1 - x^2 - y^2). A normal below the surface loses its sign
  /// and is counted ("below-surface").
  bool two_component = false;
  bool raw = false;  ///< Components in [-1, 1] instead of n/2 + 1/2
  /// Values that integer formats store as 0 and 1, for some of the maps; no map twice. Other maps use the rule of
  /// BakedMap::ranges, which is the same for all maps that are baked from one high poly with the same options.
  std::vector<MapRange> ranges = {};
  /// Origin of the map position and of positions in own maps, world units. None given: 0; for a high poly farther
  /// from 0 than 16 of its diagonals, the middle of its box, rounded to a power of two above the diagonal. So all
  /// maps of one high poly agree; maps of several high polys agree if an origin is given. The result is in
  /// BakedMap::origin.
  std::optional<std::array<double, 3>> origin = {};
  MissPolicy miss = MissPolicy::keep;    ///< Value of samples without a point, after all fallbacks
  std::int32_t gutter = kPaddingTexels;  ///< Texels, 0 to 4096; -1: infinite (push-pull)
  /// Also make mip-maps, filtered within charts: texels of one chart, and of its padding, never mix
  /// with another chart (Wang et al., section 6). Mip-maps made from the image alone do.
  bool mips = false;
};

/// Measures and by-products of a bake beside its maps.
struct ReportOptions {
  /// Compare each map at up to 2,000 texels with a finer evaluation (BakeReport::errors).
  bool errors = false;
  /// Number of places that HighCoverageReport samples, 0 (off) to 2^20. For matches that search the high
  /// poly's BVH (those that obey "report.recall"); not for saved matches, and not in sessions. The standard
  /// error of a share p is sqrt(p (1 - p) / places): 0.1% for 1% of 8192.
  std::uint32_t recall = 8192;
  bool vertex_coverage = false;  ///< Also fill BakeResult::recalled
  bool keep_match = false;       ///< Return the correspondence in BakeResult::match
};

/// Options of a bake: maps, match, encoding and report.
struct BakeOptions {
  std::uint32_t width = 2048;   ///< 1 to 16384 texels
  std::uint32_t height = 2048;  ///< 1 to 16384 texels
  std::uint32_t samples = 1;    ///< N x N samples a texel, 1 to 16
  /// One or more maps, none twice.
  std::vector<MapKind> maps = std::vector<MapKind>(1, MapKind::normal);
  std::vector<Transfer> transfers =
      {};  ///< One map each, after `maps`; names that no map has, none twice
  std::vector<OwnMap> own_maps = {};  ///< One map each, after the transfers; names as of transfers
  /// One map each, after the own maps; names as of transfers. The settings below apply to all maps, unless a
  /// variant overrides them.
  std::vector<MapVariant> variants = {};
  /// Time limit for an own map: of its compilation, and of each 65,536 samples, 1 to 86400 seconds. Neither can
  /// be interrupted: past the limit the bake ends with Error(input), and this process uses no device any more.
  double own_map_seconds = 60;
  OcclusionOptions occlusion = {};  ///< For the maps ao, bent_normal and thickness
  /// Curvature is the mean over the high poly's surface within this distance of the point. Above 0. None given:
  /// 0.5% of the diagonal, but 3 facets of its smooth surfaces at least; BakedMap::curvature_radius holds the
  /// result.
  std::optional<Length> curvature_radius = {};
  ShadowLight light = {};   ///< For the map shadow
  IdBy id_by = IdBy::part;  ///< For the map id
  /// For the map color: the high poly's own textures, sRGB. None given: its vertex colours.
  std::optional<Texture> color = {};
  /// For the map opacity, one channel. None given: the vertex colours' alpha.
  std::optional<Texture> opacity = {};
  /// Leave the background around charts in the high poly's pictures out of averages
  bool fill_high = true;
  MatchOptions match = {};        ///< Search for points of the high poly
  EncodingOptions encoding = {};  ///< Encoding of the maps
  ReportOptions report = {};      ///< Measures beside the maps
  /// Called about ten times a second; may cancel. See Progress for what it may do
  Progress progress = {};
};

/// Change of the map from texel to texel at the borders between match methods, compared with all
/// other texels.
struct TransitionReport {
  /// Number of pairs of adjacent texels of one chart that were decided by different methods, or of which one was
  /// missed
  std::uint64_t sides = 0;
  double mean_degrees = 0;       ///< Mean angle between the map's unit vectors of these pairs
  double elsewhere_degrees = 0;  ///< Mean angle of all other pairs
};

/// Report of a bake: counts, measures, seconds and warnings.
struct BakeReport {
  std::uint64_t texels = 0;   ///< Covered by the low poly
  std::uint64_t samples = 0;  ///< Samples that the low poly covers
  std::uint64_t outward = 0;  ///< Samples decided by a ray that hit outwards
  std::uint64_t inward = 0;   ///< Samples decided by a ray that hit inwards
  std::uint64_t cage = 0;     ///< Samples decided by a ray from the cage
  std::uint64_t viewed = 0;   ///< Samples decided by a depth view
  std::uint64_t closest = 0;  ///< Samples decided by the nearest point
  std::uint64_t by_uv = 0;    ///< Samples decided by their own UV
  /// Samples whose ray outwards passed over a nearer face (RayRule::outermost)
  std::uint64_t passed_over = 0;
  std::uint64_t uv_copies = 0;  ///< Triangles of the low poly that share others' texels
  /// Share of the copies' area, 0 to 1, where the match finds another surface than for the baked triangles:
  /// no texel holds it. Estimated at 4096 places; not with saved matches, MatchMethod::uv and in sessions.
  double uv_copies_differ = 0;
  /// Triangles of charts without the centre of a sample: they get the nearest free texels.
  std::uint64_t small_triangles = 0;
  /// Triangles of such charts for which no free texel lies within 8 texels
  std::uint64_t small_without_texel = 0;
  std::uint64_t missed = 0;              ///< Samples without a matched point
  std::uint64_t gutter_texels = 0;       ///< Texels that padding filled
  double max_distance = 0;               ///< Search distance in effect, world units
  double mean_abs_distance = 0;          ///< Mean |distance| of the samples that hit, world units
  std::optional<ViewReport> views = {};  ///< Set if matched by views
  std::optional<TransitionReport> transitions =
      {};  ///< Set if a fallback was requested; before blending
  std::optional<TransitionReport> transitions_blended =
      {};  ///< After blending, if it was requested
  std::uint64_t blended_texels =
      0;  ///< Texels of the method into which fallback normals were blended
  std::optional<VisibilityReport> visibility = {};  ///< Set if matched by visibility
  std::optional<UvReport> uv = {};                  ///< Set if matched by UVs
  EdgeReport edges = {};                     ///< Filled if rays turn at hard edges; else 0 edges
  std::optional<CageReport> cage_mesh = {};  ///< Set if rays start from a cage mesh
  std::optional<HighCoverageReport> recall = {};  ///< Set if requested and defined for the match
  double curvature_radius = 0;    ///< Radius in effect, world units; 0 if curvature was not baked
  std::vector<IdEntry> ids = {};  ///< The legend of the map id, if it was baked
  std::optional<OcclusionReport> occlusion =
      {};                     ///< Set if ao or bent_normal was baked; for variants see BakedMap
  double seconds_recall = 0;  ///< Computing `recall`
  double seconds_build =
      0;  ///< Building structures of the source that this bake was the first to need
  double seconds_texels = 0;            ///< Rasterising the low poly's samples
  double seconds_match = 0;             ///< The match and its fallbacks
  double seconds_detail = 0;            ///< Reading of the maps' values
  double seconds_image = 0;             ///< Padding and encoding
  double seconds_mips = 0;              ///< Charts, mip levels, their padding and encoding
  std::vector<MapError> errors = {};    ///< Set if ReportOptions::errors is true
  double seconds_errors = 0;            ///< The finer evaluation
  std::uint64_t peak_device_bytes = 0;  ///< Largest amount of device memory at once
  std::vector<Warning> warnings = {};   ///< Warnings of all steps
};

/// The maps of a bake, and its report.
struct BakeResult {
  std::vector<BakedMap> maps = {};          ///< In the order of BakeOptions::maps, then by cluster
  std::vector<std::uint8_t> coverage = {};  ///< Per texel, rows from the top: values of TexelState
  std::optional<Match> match = {};          ///< Set if ReportOptions::keep_match is true
  std::vector<VertexCoverage> recalled =
      {};  ///< Per vertex of the high poly, if ReportOptions::vertex_coverage is true
  std::optional<VisibilityClusters> clusters = {};  ///< Set if more than one cluster was requested
  /// With several clusters: the first cluster's, apart from values that all share
  BakeReport report = {};
  bool cancelled = false;  ///< The progress callback cancelled: there are no maps.

  /// Finds a map by its name. \param cluster  as BakedMap::cluster. \returns null if it was not requested;
  /// valid as long as `maps` is unchanged
  const BakedMap* find(MapKind kind, std::uint32_t cluster = 0) const noexcept;
  /// Like find(), for a map that must exist. \throws Error(usage), `no-map`, which names the available
  /// maps
  const BakedMap& map(MapKind kind, std::uint32_t cluster = 0) const;
};

/// Bakes maps of the high poly for the low poly.
///
/// The same input gives the same bytes on every run, number of threads and conforming device. Any
/// number of threads may bake from one source at the same time; each has its own result. Memory is
/// bounded by the map and the meshes: work is cut into bands of rows.
///
/// Lifetimes: `low`, `options` and the objects they point to are read during the call and must not
/// change meanwhile; none is kept. The result is the caller's own. Threads: see Source. Work on the
/// host uses up to thread_limit() threads; the callback runs on the calling thread. If it cancels,
/// BakeResult::cancelled is set; its exceptions leave bake(). Tangents: those of `low`
/// (Mesh::tangents), else MikkTSpace's. Render with the same. Welding: vertices of `low` with
/// exactly equal positions count as one for averaged normals, ray directions and charts. A mesh
/// that is split at seams needs none.
/// \param low  needs UVs
/// \throws Error(usage) for a parameter out of range, Error(input) for a mesh without UVs,
///         Error(device). No partial result remains.
BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// A correspondence and its report.
struct MatchResult {
  Match match = {};        ///< Empty where cancelled
  BakeReport report = {};  ///< The maps' entries are empty
  bool cancelled = false;  ///< The progress callback cancelled
};

/// Matches without baking: the first half of bake(), for any number of maps or for values of the caller's
/// own (bake_attribute()). Uses the size, samples, match options and progress callback of `options`.
/// Lifetimes, threads, callback and welding as bake(); no tangents are needed.
/// \throws as bake(); Error(usage) if the options hold a saved match, or request several clusters or
///         blending, which concern maps
MatchResult match(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// Bakes from a match: the second half of bake(). The maps are, to the bit, those of bake() with the
/// options that made the match. The report's counts and distances are the match's. Lifetimes, threads,
/// callback, tangents and welding as the other bake(); several threads may bake from one match.
/// \param match    from match(), BakeResult::match, load_match() or the caller's own; checked by
///                 validate()
/// \param options  width, height and samples as the match was made with; no `match` and no fallback;
///                 other options of the match are ignored
/// \throws as bake(); Error(input) for a match that does not fit: `match-size`, `match-source`,
///         `match-low`, or the errors of validate()
BakeResult bake(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options = {});

}  // namespace kiln
