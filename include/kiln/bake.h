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

/// Recall: detail of the high poly that the map lacks, which no measure over the low poly can show. It is the share
/// of the visible high poly near the low poly that no sample of the map represents.
///
/// Test points are spread evenly over the high poly's area. A test point is rated if it is within
/// the match's search distance of the low poly, and if its face deviates by less than 60 degrees
/// from the low poly's face there, since a map along the low poly's normal cannot hold steeper
/// faces. The weight of a test point is the sum of its cosines over those of 64 directions all
/// around from which the high poly does not hide it, as pixels of pictures would count it. A sample
/// represents a test point within 1.5 sample spacings of the sample's matched point, unless the
/// faces of the two points look in opposite directions. Layers closer than this distance are not
/// distinguished.
struct HighCoverageReport {
  std::uint64_t places = 0;  ///< Number of test points that are rated
  /// Sum of the weights of all rated test points, needed to combine reports of several maps
  double weight = 0;
  double lost = 0;  ///< Weighted share of the rated test points that no sample represents, 0 to 1
  /// Weighted share of the largest connected part of the lost surface among all test points, 0 to 1
  double largest = 0;
  /// Weighted share of the test points that are lost because of UV copies, 0 to 1 (included in `lost`).
  /// UV copies are not baked, and their texels show another surface (BakeReport::uv_copies_differ).
  /// Copies of the same surface lose nothing.
  double by_copies = 0;
  /// A point near the centre of the largest connected lost part, world units
  std::array<double, 3> where{};
};

/// Whether a sample of the map represents a vertex of the high poly; one value per vertex.
enum class VertexCoverage : std::uint8_t {
  not_rated,    ///< The vertex is not rated: it is hidden, too steep, or too far from the low poly
  represented,  ///< A sample of the map represents the vertex
  lost,         ///< No sample of the map represents the vertex
};

/// Encoding of values as pictures.
struct EncodingOptions {
  NormalMapSpace space = NormalMapSpace::tangent;  ///< Space of the vectors in maps of unit vectors
  /// How the bitangent is computed in NormalMapSpace::tangent
  Bitangent bitangent = Bitangent::pixel;
  bool flip_y = false;  ///< True: green points down (DirectX); false: up (OpenGL)
  /// Leave out the third component (0): z = sqrt(1 - x^2 - y^2). A normal below the surface loses its sign
  /// and is counted ("below-surface").
  bool two_component = false;
  bool raw = false;  ///< Components in [-1, 1] instead of n/2 + 1/2
  /// Values that integer formats store as 0 and 1, for some of the maps; each map at most once. Other maps use
  /// the rule of BakedMap::ranges, which is the same for all maps that are baked from one high poly with the same
  /// options.
  std::vector<MapRange> ranges = {};
  /// Origin of the map `position` and of positions in user-defined maps, world units. None given: 0; for a high poly
  /// farther from 0 than 16 of its diagonals, the centre of its bounding box, rounded to multiples of a power of two
  /// above the diagonal. So all maps of one high poly agree; maps of several high polys agree if an origin is given.
  /// The result is in BakedMap::origin.
  std::optional<std::array<double, 3>> origin = {};
  MissPolicy miss = MissPolicy::keep;  ///< Value of samples without a point, after all fallbacks
  /// Width of the padding, 0 to 4096 texels; -1: fill the whole map (push-pull)
  std::int32_t gutter = kPaddingTexels;
  /// Also make mip-maps, filtered within charts: texels of one chart, and of its padding, never mix
  /// with another chart (Wang et al., section 6). Mip-maps that are made from the image alone mix
  /// them.
  bool mips = false;
};

/// Measurements and by-products of a bake, in addition to its maps.
struct ReportOptions {
  /// Compare each map at up to 2,000 texels with a finer evaluation (BakeReport::errors).
  bool errors = false;
  /// Number of test points for HighCoverageReport, 0 (off) to 2^20. Only for matches that search
  /// the high poly's BVH (for which obeys(match, "report.recall") is true), not for saved matches,
  /// and not in sessions. The standard error of a share p is sqrt(p (1 - p) / recall): 0.1% for a
  /// share of 1% and 8192 test points.
  std::uint32_t recall = 8192;
  /// Also store for each vertex of the high poly whether a sample represents it, in
  /// BakeResult::recalled
  bool vertex_coverage = false;
  bool keep_match = false;  ///< Return the correspondences in BakeResult::match
};

/// Options of a bake: maps, match, encoding and report.
struct BakeOptions {
  std::uint32_t width = 2048;   ///< 1 to 16384 texels
  std::uint32_t height = 2048;  ///< 1 to 16384 texels
  std::uint32_t samples = 1;    ///< N x N samples a texel, 1 to 16
  /// Maps to bake: at least one, each at most once.
  std::vector<MapKind> maps = std::vector<MapKind>(1, MapKind::normal);
  /// One map per transfer, after `maps`. Names must be unique, and not the name of a map of maps()
  std::vector<Transfer> transfers = {};
  /// One map per entry, after the maps of the transfers; the rules for names are those for
  /// transfers
  std::vector<OwnMap> own_maps = {};
  /// One map per variant, after the caller's own maps; the rules for names are those for transfers.
  /// The settings below apply to all maps, unless a variant overrides them.
  std::vector<MapVariant> variants = {};
  /// Time limit for a user-defined map, 1 to 86400 seconds: for its compilation, and for every 65,536 samples. Neither
  /// can be interrupted. After the limit the bake throws Error(input), and this process no longer uses any device.
  double own_map_seconds = 60;
  OcclusionOptions occlusion = {};  ///< For the maps ao, bent_normal and thickness
  /// Curvature is the mean over the high poly's surface within this distance of the point. Above 0. None given: 0.5% of
  /// the diagonal, but at least three times the size of a facet of the high poly's smooth surfaces.
  /// BakedMap::curvature_radius holds the result.
  std::optional<Length> curvature_radius = {};
  ShadowLight light = {};   ///< For the map shadow
  IdBy id_by = IdBy::part;  ///< For the map id
  /// For the map color: the high poly's own textures, sRGB. None given: its vertex colours.
  std::optional<Texture> color = {};
  /// For the map opacity, one channel. None given: the vertex colours' alpha.
  std::optional<Texture> opacity = {};
  /// When the high poly's pictures are averaged, leave out the background around their charts
  bool fill_high = true;
  MatchOptions match = {};        ///< How the matched points of the high poly are found
  EncodingOptions encoding = {};  ///< Encoding of the maps
  ReportOptions report = {};      ///< What is measured in addition to the maps
  /// Called about ten times a second; may cancel. See Progress for what it may do
  Progress progress = {};
};

/// Change of the map from texel to texel at the borders between match methods, compared with all
/// other texels.
struct TransitionReport {
  /// Number of pairs of adjacent texels of one chart whose matches come from different methods, or of which one
  /// texel was missed
  std::uint64_t sides = 0;
  double mean_degrees = 0;  ///< Mean angle between the map's unit vectors in the pairs of `sides`
  /// Mean angle between the map's unit vectors of all other pairs of adjacent texels
  double elsewhere_degrees = 0;
};

/// Report of a bake: counts, measures, seconds and warnings.
struct BakeReport {
  std::uint64_t texels = 0;   ///< Number of texels that the low poly covers
  std::uint64_t samples = 0;  ///< Samples that the low poly covers
  std::uint64_t outward = 0;  ///< Samples whose point was found by a ray outward
  std::uint64_t inward = 0;   ///< Samples whose point was found by a ray inward
  std::uint64_t cage = 0;     ///< Samples whose point was found by a ray from the cage
  std::uint64_t viewed = 0;   ///< Samples whose point was found in a depth view
  std::uint64_t closest = 0;  ///< Samples whose point is the nearest point
  std::uint64_t by_uv = 0;    ///< Samples whose point has the sample's UV
  /// Samples whose outward ray hit a nearer face first, and that use a face beyond it
  /// (RayRule::outermost)
  std::uint64_t passed_over = 0;
  /// Triangles of the low poly that are not baked, since they share the texels of other triangles
  /// (UvCopies)
  std::uint64_t uv_copies = 0;
  /// Share of the UV copies' area, 0 to 1, where the match finds another surface than on the triangles that
  /// are baked for them; no texel holds that surface. Estimated at 4096 points; 0 with saved
  /// matches, with MatchMethod::uv and in sessions.
  double uv_copies_differ = 0;
  /// Triangles of charts that contain no sample's centre; they are assigned the nearest free
  /// texels.
  std::uint64_t small_triangles = 0;
  /// Triangles of charts that contain no sample's centre, and have no free texel within 8 texels;
  /// they are not baked
  std::uint64_t small_triangles_without_texel = 0;
  std::uint64_t missed = 0;         ///< Samples without a matched point
  std::uint64_t gutter_texels = 0;  ///< Texels that padding filled
  double max_distance = 0;          ///< Search distance in effect, world units
  double mean_abs_distance = 0;     ///< Mean |distance| of the samples that hit, world units
  /// Report of the views; set if samples were matched by views
  std::optional<ViewReport> views = {};
  std::optional<TransitionReport> transitions =
      {};  ///< Transitions before blending; set if a fallback was requested
  std::optional<TransitionReport> transitions_blended =
      {};  ///< Transitions after blending with the fallback; set if blending was requested
  /// Texels matched by MatchOptions::method into whose normals those of the fallback were blended
  std::uint64_t blended_texels = 0;
  /// Report of visibility; set if samples were matched by visibility
  std::optional<VisibilityReport> visibility = {};
  /// Report of matching by UVs; set if samples were matched by UVs
  std::optional<UvReport> uv = {};
  /// Report of blending ray directions at hard edges; its `edges` is 0 if none are blended
  EdgeReport edges = {};
  /// Distances of the cage mesh; set if rays start from one
  std::optional<CageReport> cage_mesh = {};
  /// Detail that the map lacks; set if `recall` was requested and the match supports it
  std::optional<HighCoverageReport> recall = {};
  double curvature_radius = 0;    ///< Radius in effect, world units; 0 if curvature was not baked
  std::vector<IdEntry> ids = {};  ///< Legend of the map `id`, if that was baked
  /// Report of ambient occlusion; set if ao or bent_normal was baked. For variants see BakedMap
  std::optional<OcclusionReport> occlusion = {};
  double seconds_recall = 0;  ///< Duration of computing `recall`
  double seconds_build =
      0;  ///< Duration of building structures of the source that no earlier bake had needed
  double seconds_texels = 0;  ///< Duration of rasterising the low poly's samples
  double seconds_match = 0;   ///< Duration of matching, fallbacks included
  double seconds_detail = 0;  ///< Duration of computing the maps' values at the matched points
  double seconds_image = 0;   ///< Duration of padding and encoding
  /// Duration of making, padding and encoding mip levels, and of finding charts
  double seconds_mips = 0;
  std::vector<MapError> errors = {};  ///< Errors of the maps; set if ReportOptions::errors is true
  double seconds_errors = 0;          ///< Duration of the finer evaluation
  std::uint64_t peak_device_bytes = 0;  ///< Largest amount of device memory at once
  std::vector<Warning> warnings = {};   ///< Warnings of all steps
};

/// The maps of a bake, and its report.
struct BakeResult {
  std::vector<BakedMap> maps = {};  ///< In the order of BakeOptions::maps, then by cluster
  /// State of each texel, rows from the top: values of TexelState
  std::vector<std::uint8_t> coverage = {};
  std::optional<Match> match = {};  ///< The match; set if ReportOptions::keep_match is true
  /// For each vertex of the high poly, whether a sample represents it; filled if
  /// ReportOptions::vertex_coverage is true
  std::vector<VertexCoverage> recalled = {};
  /// Clusters of directions; set if more than one cluster was requested
  std::optional<VisibilityClusters> clusters = {};
  /// With several clusters: the report of the first cluster, except for values that are common to
  /// all clusters
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
  Match match = {};        ///< Empty if the match was cancelled
  BakeReport report = {};  ///< Report of the match; members about maps keep their defaults
  bool cancelled = false;  ///< The progress callback cancelled
};

/// Matches without baking: the first half of bake(). From the match any number of maps can be baked, or
/// values of the caller's own (bake_attribute()). Uses the size, samples, match options and progress
/// callback of `options`. Lifetimes, threads, callback and welding are those of bake(); no tangents are
/// needed.
/// \throws as bake(); Error(usage) if the options hold a saved match, or request several clusters or
///         blending, which only concern maps
MatchResult match(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// Bakes from a match: the second half of bake(). The maps equal those of bake() with the options that
/// made the match, to the bit. Counts and distances in the report are those of the match. Lifetimes,
/// threads, callback, tangents and welding are those of the other bake(); several threads may bake
/// from one match.
/// \param match    from match(), BakeResult::match, load_match() or the caller's own; checked by
///                 validate()
/// \param options  width, height and samples as the match was made with; no `match` and no fallback;
///                 other options of the match are ignored
/// \throws as bake(); Error(input) for a match that does not fit: `match-size`, `match-source`,
///         `match-low`, or the errors of validate()
BakeResult bake(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options = {});

}  // namespace kiln
