#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "kiln/mesh.h"
#include "kiln/source.h"
#include "kiln/texture.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Detail of the high poly that a bake leaves out, which no measure over the low poly can tell: the share
/// of the high poly near the low poly that views from outside show and no sample stands for.
///
/// Places lie evenly over the high poly's area. A place counts within the match's distance of the
/// low poly. Its face turns less than 60 degrees from the low poly's there: a map along that normal
/// cannot hold steeper ones. Its weight is what 64 directions all around see of it past the high
/// poly: the sum of their cosines, as pixels of pictures would count it. A sample stands for a
/// place within one and a half samples' steps of its point. The two faces do not look opposite
/// ways. Layers closer than that are one.
struct HighCoverageReport {
  std::uint64_t places = 0;  ///< That counted
  double weight = 0;         ///< Sum over all places, so that reports of several maps can be joined
  double lost = 0;           ///< Share that no sample stands for, 0 to 1
  double largest = 0;        ///< Share of the largest connected part of it, 0 to 1
  /// Share of `lost` near triangles that share others' texels and find another surface than these
  /// (BakeReport::uv_copies_differ), 0 to 1. Triangles that find the same surface are on these texels, and not lost.
  double by_copies = 0;
  std::array<double, 3> where{};  ///< A place in the middle of that part, world units
};

/// Per vertex of the high poly: whether a sample stands for it.
enum class VertexCoverage : std::uint8_t {
  beside,  ///< Does not count: unseen, steep, or not near the low poly
  held,    ///< A sample stands for it
  lost,    ///< None does
};

/// Encoding of values as pictures.
struct EncodingOptions {
  NormalMapSpace space = NormalMapSpace::tangent;  ///< Space of maps of unit vectors
  Bitangent bitangent = Bitangent::pixel;          ///< Third axis of NormalMapSpace::tangent
  bool flip_y = false;                             ///< Green down (DirectX); default up (OpenGL)
  /// Third component left out (0): z = sqrt(1 - x^2 - y^2). A normal below the surface loses its sign and is
  /// counted ("below-surface").
  bool two_component = false;
  bool raw = false;  ///< Components in [-1, 1] instead of n/2 + 1/2
  /// Values that integer formats put at 0 and at 1 in some of the maps; none twice. None given: BakedMap::ranges says the
  /// rule, which is the same for all maps that are baked from one high poly with the same options.
  std::vector<MapRange> ranges = {};
  /// For the map position, and places in maps of the caller's own: what they are measured from, world units. None
  /// given: 0; of a high poly whose box lies farther from 0 than 16 of its diagonals, the middle of the box,
  /// rounded to a power of two above the diagonal. Thus all maps of one high poly agree; maps of several agree
  /// by an origin that is given. BakedMap::origin has it.
  std::optional<std::array<double, 3>> origin = {};
  MissPolicy miss = MissPolicy::keep;    ///< Value of undecided samples
  std::int32_t gutter = kPaddingTexels;  ///< Texels, 0 to 4096; -1: infinite (push-pull)
  /// Also make mip-maps, filtered within charts: no texel of one chart, nor of the gutter, gets
  /// into another (Wang et al., section 6). Mip-maps made from the image alone mix them.
  bool mips = false;
};

/// Measures and by-products of a bake beside its maps.
struct ReportOptions {
  /// Compare each map at up to 2,000 texels with a finer evaluation (BakeReport::errors).
  bool errors = false;
  /// Places of the high poly that HighCoverageReport looks at, 0 (none) to 2^20. For matches that search its
  /// hierarchy (they obey "report.recall"), not for saved ones, and not in sessions. The standard error of a
  /// share p is sqrt(p (1 - p) / places): 0.1% for 1% of 8192.
  std::uint32_t recall = 8192;
  bool vertex_coverage = false;  ///< Also fill BakeResult::recalled
  bool keep_match = false;       ///< Return the correspondence in BakeResult::match
};

/// Options of a bake: maps, match, encoding and report.
struct BakeOptions {
  std::uint32_t width = 2048;   ///< 1 to 16384 texels
  std::uint32_t height = 2048;  ///< 1 to 16384 texels
  std::uint32_t samples = 1;    ///< N x N samples a texel, 1 to 16
  /// One or more, none twice.
  std::vector<MapKind> maps = std::vector<MapKind>(1, MapKind::normal);
  std::vector<Transfer> transfers =
      {};  ///< A map each, after `maps`; names that no map has, none twice
  std::vector<OwnMap> own_maps = {};  ///< A map each, after those; names as of transfers
  /// A map each, after those; names as of transfers. What follows is for all maps whose variant does not say else.
  std::vector<MapVariant> variants = {};
  /// The most that one of them may take for 65,536 samples, and its compiler, 1 to 86400 seconds. Neither can be
  /// stopped: past that the bake ends with Error(input), and this process uses no device any more.
  double own_map_seconds = 60;
  OcclusionOptions occlusion = {};  ///< For the maps ao, bent_normal and thickness
  /// Curvature is the mean over the high poly's surface within this distance of the point. Above 0. None
  /// given: 0.5% of the diagonal, but 3 facets of its smooth surfaces at least; BakedMap::curvature_radius says it.
  std::optional<Length> curvature_radius = {};
  ShadowLight light = {};   ///< For the map shadow
  IdBy id_by = IdBy::part;  ///< For the map id
  /// For the map color: the high poly's own textures, sRGB. None given: its vertex colours.
  std::optional<Texture> color = {};
  /// For the map opacity, one channel. None given: the vertex colours' alpha.
  std::optional<Texture> opacity = {};
  bool fill_high = true;    ///< Leave the background around charts of its pictures out of means
  MatchOptions match = {};  ///< Match: search for points of the high poly
  EncodingOptions encoding = {};  ///< Encoding of the maps
  ReportOptions report = {};      ///< Measures beside the maps
  Progress progress = {};  ///< Called now and then; may cancel. See Progress for what it may do
};

/// Change of the map from texel to texel where the method changes, and where it does not.
struct TransitionReport {
  std::uint64_t sides = 0;  ///< Between texels of one chart that different methods decided, or none
  double mean_degrees = 0;  ///< Over these sides, between the map's unit vectors
  double elsewhere_degrees = 0;  ///< Over all others
};

/// Report of a bake: counts, measures, seconds and warnings.
struct BakeReport {
  std::uint64_t texels = 0;   ///< Covered by the low poly
  std::uint64_t samples = 0;  ///< Covered by the low poly
  std::uint64_t outward = 0;  ///< Samples whose ray hit outwards
  std::uint64_t inward = 0;   ///< Samples whose ray hit inwards
  std::uint64_t cage = 0;     ///< Samples whose ray came from the cage
  std::uint64_t viewed = 0;   ///< Samples that a depth view decided
  std::uint64_t closest = 0;  ///< Samples that took the nearest point
  std::uint64_t by_uv = 0;    ///< Samples that took the point with their own UV
  /// Samples whose ray outwards passed over a nearer face (RayRule::outermost)
  std::uint64_t passed_over = 0;
  std::uint64_t uv_copies = 0;  ///< Triangles of the low poly that share others' texels
  /// Share of their area, 0 to 1, where the match finds another surface for them than for the triangles whose
  /// texels they share: it is on no texel. Looked at in 4096 places; not with saved matches, MatchMethod::uv
  /// and in sessions.
  double uv_copies_differ = 0;
  /// Triangles of charts without the centre of a sample: they have the nearest free texels.
  std::uint64_t small_triangles = 0;
  std::uint64_t small_without_texel =
      0;                            ///< Small triangles that found no free texel within 8 texels
  std::uint64_t missed = 0;         ///< Samples without a point
  std::uint64_t gutter_texels = 0;  ///< Texels that padding filled
  double max_distance = 0;          ///< As used, world units
  double mean_abs_distance = 0;     ///< Mean |distance| of the samples that hit, world units
  std::optional<ViewReport> views = {};  ///< Set where matched by views
  std::optional<TransitionReport> transitions =
      {};  ///< Set where a fallback was asked for; before blending
  std::optional<TransitionReport> transitions_blended =
      {};  ///< After, where blending was asked for
  std::uint64_t blended_texels =
      0;  ///< Texels of the method that took some of the fallback's normals
  std::optional<VisibilityReport> visibility = {};  ///< Set where matched by visibility
  std::optional<UvReport> uv = {};                  ///< Set where matched by UVs
  EdgeReport edges = {};                     ///< Set where rays turn at hard edges; else 0 of them
  std::optional<CageReport> cage_mesh = {};  ///< Set where rays start from a mesh
  std::optional<HighCoverageReport> recall = {};  ///< Set where it was asked for and can be told
  double curvature_radius = 0;    ///< As used, world units; 0 where curvature was not baked
  std::vector<IdEntry> ids = {};  ///< The legend of the map id, where it was baked
  std::optional<OcclusionReport> occlusion =
      {};                     ///< Set where ao or bent_normal was baked; of variants: BakedMap
  double seconds_recall = 0;  ///< Telling it
  double seconds_build = 0;   ///< Structures of the source, made for this bake
  double seconds_texels = 0;  ///< Samples of the low poly
  double seconds_match = 0;   ///< The match and its fallbacks
  double seconds_detail = 0;  ///< Reading of the maps' values
  double seconds_image = 0;   ///< Padding and encoding
  double seconds_mips = 0;    ///< Charts, levels, their gutters and encoding
  std::vector<MapError> errors = {};    ///< Set where ReportOptions::errors asks for them
  double seconds_errors = 0;            ///< The finer evaluation
  std::uint64_t peak_device_bytes = 0;  ///< The most memory on the device at once
  std::vector<Warning> warnings = {};   ///< Warnings of all steps
};

/// The maps of a bake, and what there is to say of them.
struct BakeResult {
  std::vector<BakedMap> maps = {};          ///< In the order of BakeOptions::maps, for each cluster
  std::vector<std::uint8_t> coverage = {};  ///< Per texel, rows from the top: values of TexelState
  std::optional<Match> match = {};          ///< Set where ReportOptions::keep_match asks for it
  std::vector<VertexCoverage> recalled =
      {};  ///< Per vertex of the high poly, where vertex_coverage asks for it
  std::optional<VisibilityClusters> clusters = {};  ///< Set where more than one was asked for
  BakeReport report =
      {};  ///< With several clusters of the first one, but for what all have in common
  bool cancelled = false;  ///< The progress callback said stop: there are no maps.

  /// A map by its name. \param cluster  as BakedMap::cluster. \returns null where it was not asked for; good
  /// as long as `maps` stays as it is
  const BakedMap* find(MapKind kind, std::uint32_t cluster = 0) const noexcept;
  /// The same for a map that must be there. \throws Error(usage), `no-map`, that names those there are
  const BakedMap& map(MapKind kind, std::uint32_t cluster = 0) const;
};

/// Bakes maps of the high poly for the low poly.
///
/// The same input gives the same bytes on every run, number of threads and conforming device.
/// Any number of threads may bake from one source at the same time; each needs its own result
/// alone. Memory is bounded by the map and the meshes: work is cut into bands of rows.
///
/// Lifetimes: `low`, `options` and what they point to are read during the call, and none
/// is kept; nobody may change them meanwhile. The result is the caller's own. Threads:
/// see Source. Work on the host takes thread_limit() threads; the callback comes on the
/// caller's. A callback that says stop sets BakeResult::cancelled; what it throws leaves
/// bake(). Tangents: those of `low` (Mesh::tangents), else MikkTSpace's. Render with the
/// same. Welding: vertices of `low` with exactly equal positions count as one for
/// averaged normals, ray directions and charts. A mesh that is split at seams needs none.
/// \param low  needs UVs
/// \throws Error(usage) for a parameter out of range, Error(input) for a mesh without UVs,
///         Error(device). Nothing is left behind.
BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// A correspondence, and what there is to say of it.
struct MatchResult {
  Match match = {};        ///< Empty where cancelled
  BakeReport report = {};  ///< Without what concerns maps
  bool cancelled = false;  ///< The progress callback said stop
};

/// Matches without baking: the first half of bake(), for any number of maps or for values of the caller's
/// own (bake_attribute()). Takes of the options the size, samples, all that concerns the match, and the
/// progress callback. Lifetimes, threads, callback and welding as bake(); no tangents are needed.
/// \throws as bake(); Error(usage) where the options hold a match already, or ask for several
///         clusters or for blending: both are about maps
MatchResult match(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// Bakes from a match: the second half of bake(). The maps are, to the bit, those of bake() with the
/// options that made the match. The report's counts and distances are the match's. Lifetimes, threads,
/// callback, tangents and welding as the other bake(); several threads may bake from one match.
/// \param match    of match(), BakeResult::match, load_match() or the caller's own; checked by validate()
/// \param options  width, height and samples as the match was made with; no `match` and no fallback;
///                 what else concerns matching is not read
/// \throws as bake(); Error(input) for a match that does not fit: `match-size`, `match-source`,
///         `match-low`, or what validate() names
BakeResult bake(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options = {});

}  // namespace kiln
