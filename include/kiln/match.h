#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

struct SimplifyReport;

/// How the point of a sample of a Match was found, or that none was.
enum class SampleStatus : std::uint8_t {
  empty = 0,      ///< The low poly does not cover the sample
  outward = 1,    ///< Hit of a ray outward, along the sample's direction
  inward = 2,     ///< Hit of a ray inward, against the sample's direction
  cage = 3,       ///< Hit of a ray from the cage inward
  missed = 4,     ///< No point within the search distance
  view = 5,       ///< Point that a depth view shows
  closest = 6,    ///< Nearest point of the high poly
  uv = 7,         ///< Point of the high poly with the sample's UV
  outermost = 8,  ///< Hit of a ray outward beyond a nearer face
};

/// The correspondences of a bake in host memory: for each sample of the map its matched point.
/// Any map can be baked from them later. Arrays have width * height elements (of the supersampled map),
/// rows from the top. validate() (kiln/validate.h) lists the invariants.
struct Match {
  std::uint32_t width = 0;    ///< Width of the map times `samples`
  std::uint32_t height = 0;   ///< Height of the map times `samples`
  std::uint32_t samples = 1;  ///< N x N samples a texel
  /// Number of triangles of the high poly; a mesh that is baked with a saved match must have this
  /// number
  std::uint64_t source_triangles = 0;
  std::uint64_t source_hash = 0;  ///< Hash of the high poly's triangles and positions; 0: unknown
  std::uint64_t low_hash = 0;     ///< Hash of the low poly's triangles, positions and UVs
  std::vector<std::uint32_t> triangle = {};  ///< Triangle of the high poly; 0xFFFFFFFF: none
  std::vector<float> u = {};                 ///< Weight of the triangle's corner 1
  std::vector<float> v = {};                 ///< Weight of the triangle's corner 2
  /// Distance from the sample to its point, world units; outward is positive
  std::vector<float> distance = {};
  std::vector<std::uint8_t> status = {};  ///< Values of SampleStatus

  /// The status of a sample;
  /// \param i  below width * height.
  SampleStatus status_of(std::size_t i) const { return static_cast<SampleStatus>(status[i]); }
};

/// Writes a Match as a float EXR with channels `triangle` (unsigned int), `u`, `v`, `distance` (float),
/// `status` (unsigned int). The file appears whole or not at all. Several threads may save and load at once.
/// \throws Error(output); Error(input) for an invalid match
void save_match(const Match& match, const std::filesystem::path& path);
/// Reads a file of save_match(). \throws Error(input) that names the file and the field
Match load_match(const std::filesystem::path& path);

/// Rule that selects the hit of a ray.
enum class RayRule {
  /// The outermost front face of the high poly, but no farther out than where the ray hits the low poly
  /// again: faces beyond that point belong to another part or fold of the low poly. A sample inside
  /// another part of the low poly takes the nearest face.
  outermost,
  nearest,  ///< The nearest hit outward, else the nearest hit inward (Tarini et al., section 3.2)
};

/// Directions of rays that leave the low poly.
enum class RayDirection {
  /// Along the low poly's shading normal; near hard edges blended towards the averaged normal, which both
  /// sides of an edge share. So details are not skewed, and edges have no gaps. For a low poly without
  /// hard edges, the same as averaged.
  automatic,
  averaged,  ///< Along the average of all normals at a vertex, interpolated
  face,      ///< Along the shading normal everywhere, which leaves gaps at hard edges
  /// Blended by the low poly's vertex colours (Mesh::colors): red 255 is the shading normal, 0 the
  /// averaged normal. Without colours: Error(input).
  painted,
};

/// Direction of rays, and selection of their hits.
struct RayOptions {
  /// Rule that selects a ray's hit. Not used by rays from a cage, which take their first hit
  RayRule rule = RayRule::outermost;
  /// Direction of rays, also of rays from a cage, except for CageKind::offsets
  RayDirection direction = RayDirection::automatic;
  /// For RayDirection::automatic: distance from a hard edge beyond which rays follow the shading normal. Above
  /// 0. None given: estimated on the high poly for each edge, as the larger of two lengths: 2/5 of its bevel's
  /// width, and twice the height of the high poly above the low poly beside it; limited to 0.05% to 4% of the
  /// diagonal. Edges without an estimate use the median of the others, or 1% of the diagonal.
  std::optional<Length> edge_width = {};
};

/// Forms of a cage mesh (MatchOptions::cage_mesh), distinguished by its triangles.
enum class CageKind {
  /// The low poly's triangles, displaced: rays start there and run towards the low poly, regardless of
  /// RayOptions::direction.
  offsets,
  /// The low poly's triangles twice, an outer shell and an inner one: rays start on the triangle's plane in the
  /// outer shell and end on its plane in the inner one. Their direction follows RayOptions::direction, where the
  /// averaged direction is the one to the outer shell's vertices. The outer shell comes first, unless the first
  /// half's group is "inner".
  shells,
  /// Any other mesh: a closed hull around the low poly with the same winding. Rays start where their
  /// directions leave the hull; Error(input) if a direction does not leave it.
  hull,
};

/// Distances of a cage mesh from the low poly, world units, at the low poly's corners; for a hull also
/// at points spread over the low poly's faces.
struct CageReport {
  CageKind kind = CageKind::offsets;  ///< Detected form of the cage mesh
  double min_outward = 0;     ///< Smallest distance outside of the low poly at which rays start
  double median_outward = 0;  ///< Median of the distances outside of the low poly
  double max_outward = 0;     ///< Largest distance outside of the low poly
  /// Smallest distance from the low poly at which rays end, inward; 0 for cages without an inner shell
  /// (all but CageKind::shells)
  double min_inward = 0;
  double median_inward = 0;  ///< Median of the distances inside of the low poly
  double max_inward = 0;     ///< Largest distance inside of the low poly
};

/// Widths around the low poly's hard edges within which ray directions are blended. World units.
struct EdgeReport {
  std::uint64_t edges = 0;  ///< Number of hard edges
  /// Number of edges whose width was estimated on the high poly; 0 if RayOptions::edge_width was given
  std::uint64_t found = 0;
  double min_width = 0;     ///< Smallest width
  double median_width = 0;  ///< Median width
  double max_width = 0;     ///< Largest width
};

/// Names of triangles by which parts are paired.
enum class PartsBy {
  /// Groups (Mesh::groups; objects if there are no groups), paired by patterns of their names
  name,
  group,     ///< Groups with the same name
  object,    ///< Objects (Mesh::objects) with the same name
  material,  ///< Materials with the same name
  list,      ///< Groups; a list states which low group belongs to which high groups
};

/// A pair in a list of parts. Names are patterns, in which `*` matches any text.
struct PartPair {
  std::string low = {};  ///< Pattern of names of the low poly's groups
  /// Patterns of names of the high poly's groups; a group belongs to the pair if it matches any of
  /// them
  std::vector<std::string> high = {};
};

/// Rules that pair the parts of two meshes by their names. In a pattern `*` matches any text, including
/// none. The text that the first `*` matches is the part's name, and must not be empty. The rest of the
/// name is compared without case. If no pattern matches, a number that Blender appends to copies
/// (`.001`) is ignored.
struct PartNames {
  /// For PartsBy::name: patterns of the low poly's names
  std::vector<std::string> low = {"*_low", "*_lp", "*_lo", "*_lowpoly"};
  /// For PartsBy::name: patterns of the high poly's names
  std::vector<std::string> high = {"*_high", "*_high_*", "*_hp",       "*_hp_*",
                                   "*_hi",   "*_hi_*",   "*_highpoly", "*_highpoly_*"};
  PartsBy by = PartsBy::name;  ///< Kind of names by which parts are paired
  /// For PartsBy::list: the pairs, of which the first that matches is used
  std::vector<PartPair> list = {};
};

/// Pairs of parts: samples on a part of the low poly match only the corresponding part of the high
/// poly.
struct Parts {
  std::uint32_t count = 0;  ///< Number of parts; their indices are 0 to count - 1
  /// Name of each part; if the last name is "", that part holds all triangles without a pair
  std::vector<std::string> names = {};
  std::vector<std::uint32_t> low = {};   ///< Index of the part of each triangle of the low poly
  std::vector<std::uint32_t> high = {};  ///< Index of the part of each triangle of the high poly
  /// "unmatched-parts" names groups without a pair and the most similar name; with PartsBy::name also the
  /// patterns that would pair most of them
  std::vector<Warning> warnings = {};
};

/// Pairs the parts of two meshes. By PartsBy::name `X_low` is paired with `X_high`, `X_high.001` and `X_high_...`, or
/// as the patterns say; a name that matches no pattern is itself the part's name, so `X` is paired with `X`, too. All
/// triangles without a pair form one part. Time: linear in names and triangles; a pattern of a list is only tried if
/// the name starts with the pattern's text before `*`. Only names are compared, so nothing is welded. The result is the
/// caller's own and fits these two meshes as long as their triangles are unchanged. Thread safety: may be called from
/// several threads.
/// \throws Error(input) if a mesh has no such names, or none of them has a pair
/// \throws Error(usage) for a pattern without `*`, or an empty list
Parts pair_parts(const Mesh& high, const Mesh& low, const PartNames& names = {});

/// A method that finds the point of the high poly for each sample, identified by its name, so that
/// matches can be added without a change here.
struct MatchMethod {
  std::string_view name = {};  ///< Name as in `--match`; has static lifetime
  constexpr MatchMethod() = default;
  /// The match with a name, such as {"ray"}. The name is copied once and kept for the program's
  /// lifetime.
  constexpr MatchMethod(const char* text)
      : name(std::is_constant_evaluated() ? std::string_view(text)
                                          : MatchMethod(std::string_view(text)).name) {}
  explicit MatchMethod(std::string_view text);  ///< Like the constructor above, for any text
  friend constexpr bool operator==(MatchMethod, MatchMethod) = default;

  static const MatchMethod ray;  ///< Rays along the low poly's normals (Tarini et al., section 3.2)
  /// Depth views from all around (Wang et al., section 2): no BVH, but samples that no view sees
  /// are missed
  static const MatchMethod views;
  /// The nearest point on the faces that are not turned away from the sample (Tarini et al., section
  /// 3.1). It finds a point wherever the mesh is near, but the points crowd on ridges and leave out
  /// creases
  static const MatchMethod closest;
  /// Rays along each sample's visibility direction (Tarini et al., section 3.3)
  static const MatchMethod visibility;
  /// Rays along a direction between visibility direction and normal (Tarini et al., section 3.4)
  static const MatchMethod hybrid;
  /// The point of the high poly with the sample's UV (Gumbau, Gonzalez, Chover 2006): no search; the UVs of both
  /// meshes must coincide
  static const MatchMethod uv;
  /// Rays along one axis in both directions; the axis is ViewOptions::directions[0]
  static const MatchMethod axis;
};
inline constexpr MatchMethod MatchMethod::ray{"ray"};
inline constexpr MatchMethod MatchMethod::views{"views"};
inline constexpr MatchMethod MatchMethod::closest{"closest"};
inline constexpr MatchMethod MatchMethod::visibility{"visibility"};
inline constexpr MatchMethod MatchMethod::hybrid{"hybrid"};
inline constexpr MatchMethod MatchMethod::uv{"uv"};
inline constexpr MatchMethod MatchMethod::axis{"axis"};

/// Rule that selects among the views that show a sample within the search distance.
enum class ViewCriterion {
  /// The view with the smallest difference between the sample's depth and the pixel's depth (Wang
  /// et al., section 2)
  depth,
  distance,  ///< The view whose point at the sample's pixel is nearest to the sample in space
  angle,  ///< The view with the smallest angle to the sample's direction (Wang et al., section 6)
};

/// Depth views of MatchMethod::views, and the rule that selects among them.
struct ViewOptions {
  /// Number of directions spread over the sphere, up to 512. None given: 12, or 1 if both meshes are
  /// height fields. 0 requires `directions`.
  std::optional<std::uint32_t> count = {};
  /// Choose up to `count` directions (none given: 64), in the order of the area that they add,
  /// until another view would add too little.
  bool automatic = false;
  /// Additional directions: from the mesh to the viewer, of any length above 0.
  std::vector<Vec3> directions = {};
  /// Pixels a side of a depth view, up to 8192. 0: chosen by the size of the high poly's triangles,
  /// at most two pixels per sample of the map.
  std::uint32_t size = 0;
  ViewCriterion criterion = ViewCriterion::angle;  ///< Rule that selects a view for each sample
  /// Move each point to the intersection of the surface with the line along the sample's direction, if the view
  /// shows that intersection. If false, points stay on the line along the view's direction, as in the paper.
  bool refine = true;
};

/// Elements at which visibility directions are gathered.
enum class VisibilityAt {
  face,  ///< On faces; a vertex averages the directions of its faces, weighted by angle
  /// At vertices; a vertex averages the directions of points on its faces, weighted by its barycentric coordinate there
  vertex,
  texel,  ///< At texels, smoothed over neighbours on the surface, even across seams
};

/// Test of whether a point is visible from a direction.
enum class VisibilityTest {
  automatic,  ///< The same as `views`
  views,      ///< Depth pictures of the low poly, as in the paper: accurate to a pixel
  rays,       ///< Rays from texels, or from 16 places per face: exact, but slower
};

/// Likelihood of directions from which the low poly will be viewed. +Y is up.
enum class ViewLikelihood {
  all,  ///< All directions are equally likely
  /// Views from the side are likelier: the weight is the squared cosine of the angle to the horizon
  horizon,
  /// Views from above are likelier: the weight is 1 straight above, and falls linearly with height to 0
  /// straight below
  up,
  list,  ///< The directions and weights of VisibilityOptions::likelihoods
};

/// For MatchMethod::visibility and hybrid. A point's direction is the weighted mean of those
/// directions, out of an evenly spread set, from which the low poly itself does not hide the point.
/// A direction's weight is its cosine to the face (in proportion to the pixels that a picture would
/// show), times the likelihood of a view from there.
struct VisibilityOptions {
  VisibilityAt at = VisibilityAt::texel;            ///< Elements at which directions are gathered
  VisibilityTest test = VisibilityTest::automatic;  ///< Visibility test
  std::uint32_t directions = 512;                   ///< Number of directions, 1 to 4096
  std::uint32_t view_size = 256;                    ///< Pixels a side of a picture, 16 to 2048
  /// Number of smoothing passes over texels' directions, each over 3 x 3 texels, 0 to 256; the result
  /// reaches about the square root of this number of texels.
  std::uint32_t smoothing = 4;
  ViewLikelihood likelihood = ViewLikelihood::all;  ///< How likely views from the directions are
  /// Likelihood of the views from one direction.
  struct Likelihood {
    Vec3 direction = {};  ///< Direction from the mesh to the viewer, of any length above 0
    double weight = 1;    ///< Weight, 0 or more
  };
  /// Number of clusters, 1 to 4; above 1 only with MatchMethod::visibility at texels. Where the
  /// directions that see a texel scatter, they are split into this number of clusters, and each has
  /// a map (Tarini et al., section 6). Elsewhere the maps are equal.
  std::uint32_t clusters = 1;
  /// Standard deviation above which a texel's directions are split, 0 to 1. An unoccluded plane has
  /// 0.745.
  double cluster_deviation = 0.8;
  /// For ViewLikelihood::list: each of the spread directions has the weight of the nearest of these. Only
  /// ratios of weights count.
  std::vector<Likelihood> likelihoods = {};
};

/// Limits of layouts for MatchMethod::uv. Shares, 0 or more; infinity: unlimited.
struct UvOptions {
  /// Warns if several triangles of the high poly cover more than this share of the samples that the
  /// high poly covers
  double warn_overlap = 0;
  /// The bake throws Error(input) if several triangles of the high poly cover more than this share
  double max_overlap = 0.05;
  /// Warns if the 95th percentile of the distances between the surfaces exceeds this share of the diagonal
  double warn_distance = 0.01;
  /// The bake throws Error(input) if the 95th percentile of the distances between the surfaces exceeds this share of
  /// the diagonal
  double max_distance = 0.05;
};

/// Settings of the match, which finds points of the high poly.
struct MatchOptions {
  MatchMethod method = MatchMethod::ray;  ///< Method of the match
  /// Settings of MatchMethod::views; directions[0] also for MatchMethod::axis
  ViewOptions views = {};
  VisibilityOptions visibility = {};  ///< Settings of MatchMethod::visibility and hybrid
  UvOptions uv = {};                  ///< Settings of MatchMethod::uv
  RayOptions ray = {};                ///< Settings of MatchMethod::ray
  /// Methods that are tried in this order for samples without a point: neither `method` itself, nor
  /// the same method twice, nor MatchMethod::uv. Empty: such samples are misses.
  std::vector<MatchMethod> fallback = {};
  /// Distance over the surface, 0 to 256 texels, along which the method's normals are blended into
  /// the fallback's. The map then has no step there, except where the fallback finds nothing. Takes
  /// up to twice the match's time.
  std::uint32_t fallback_blend = 0;

  /// Search distance, outward and inward along rays; for nearest points in all directions. MatchMethod::uv does not
  /// search. With a cage: length of rays from the cage inward. Above 0. None given: kSearchDistance; with a cage,
  /// twice the cage's distance (of a cage mesh, twice its longest one). Without a distance and a cage, rays that
  /// miss on an open sheet of the low poly (a leaf card) are cast again with half the sheet's diagonal.
  std::optional<Length> max_distance = {};
  /// MatchMethod::ray without a cage: search within this distance first, and up to max_distance only if there is no
  /// hit. Above 0. None given: off. Useful for low polys that lie close to the high poly everywhere, and close to
  /// other surfaces.
  std::optional<Length> near_distance = {};
  /// Cage distance: rays start at this distance outside of the low poly, run inward, and take their
  /// first hit
  std::optional<Length> cage = {};
  /// Cage mesh, on which rays start instead of at a distance; see CageKind for its three forms. find_cage()
  /// (kiln/cage.h) makes one. Read during the call; a session reads it at its construction.
  const Mesh* cage_mesh = nullptr;
  /// Pairs of parts: samples match only the part that is paired with theirs. Parts::low and Parts::high have one entry
  /// per triangle. For matches that search from samples: ray, closest, axis, and these as fallbacks. Other parts still
  /// occlude, unless OcclusionOptions::own_part is set. Read during the call; must outlive a session.
  const Parts* parts = nullptr;
  UvCopies uv_copies = UvCopies::plain;  ///< Which of several triangles with the same UVs are baked
  /// Also hit back faces of the high poly; normals that point away from the low poly are flipped
  bool two_sided = false;
  /// Saved match to use instead of a search. No fallback may be given, and all other members are ignored. Read
  /// during the call.
  const Match* saved = nullptr;
};

/// Sets the search distances for a low poly that simplify() made, near_distance and max_distance, according
/// to the deviation that it measured. Distances that are already set in `match` are kept.
/// \param made  report of simplify(); valid even if the low poly was unwrapped afterwards
void set_search_distances(const SimplifyReport& made, MatchOptions& match);

/// For each texel, the directions for which each of several maps was baked. The field of texels has the
/// map's size, but at most 2048 a side.
struct VisibilityClusters {
  std::uint32_t width = 0;   ///< Side of the field, texels
  std::uint32_t height = 0;  ///< Side of the field, texels
  std::uint32_t count = 0;   ///< Number of maps
  /// Number of clusters of each texel. 0: the texel is not covered; 1: all maps are equal there
  std::vector<std::uint8_t> number = {};
  /// [width * height * count] unit directions of each texel's clusters, from the mesh to the viewer;
  /// surplus entries repeat the texel's first one
  std::vector<Vec3> directions = {};
};

/// Writes a float EXR with channels `count` (unsigned int: the number) and, for each map k from 0,
/// `direction<k>.X`, `.Y` and `.Z`. May be called from several threads, for files of different names.
/// \throws Error(output)
void save_clusters(const VisibilityClusters& clusters, const std::filesystem::path& path);

/// Report of a match by depth views.
struct ViewReport {
  /// Directions of the views, in the order in which they were rendered
  std::vector<Vec3> directions = {};
  /// For automatically chosen views: for each view, the share of the probed samples that it and the
  /// views before it see
  std::vector<double> coverage = {};
  std::uint32_t size = 0;   ///< Pixels a side of each view
  double pixel = 0;         ///< Side of a pixel, world units
  double undersampled = 0;  ///< Share of the high poly whose triangles are smaller than a pixel
  /// True if both meshes are height fields, so that a single view shows all of them
  bool height_field = false;
};

/// Report of gathering visibility directions, at texels of the field or at vertices.
struct VisibilityReport {
  std::uint32_t directions = 0;  ///< Number of directions with a weight above 0
  bool by_rays = false;          ///< True: visibility was tested by rays; false: by pictures
  std::uint32_t width = 0;       ///< Side of the field of texels
  std::uint32_t height = 0;      ///< Side of the field of texels
  std::uint64_t places = 0;      ///< Number of elements at which directions were gathered
  /// Elements that no direction sees, counted after smoothing; their directions come from their
  /// neighbours
  std::uint64_t unseen = 0;
  /// Unseen elements whose neighbours are not seen, either: their direction is the normal
  std::uint64_t without = 0;
  std::uint64_t clustered = 0;  ///< Elements whose directions were split into clusters
  /// Mean over all elements of the standard deviation of the directions that see an element
  double mean_deviation = 0;
  double seconds = 0;  ///< Duration, included in seconds_match
};

/// Report of matching by UVs: the high poly's layout must not overlap, and both layouts must agree.
struct UvReport {
  std::uint64_t covered = 0;  ///< Samples of the map that the high poly's UV triangles cover
  /// Covered samples that several triangles cover; the triangle with the lowest index is used
  std::uint64_t overlapping = 0;
  /// Two triangles of the high poly that cover one texel.
  struct Overlap {
    std::uint32_t lower = 0;   ///< The triangle with the lower index
    std::uint32_t upper = 0;   ///< The triangle with the higher index
    std::uint32_t column = 0;  ///< Column of the texel
    std::uint32_t row = 0;     ///< Row of the texel, from the top
  };
  /// An example if `overlapping` is above 0: the first one in the order of rows, then columns
  Overlap overlap = {};
  std::uint64_t outside = 0;  ///< Triangles of the high poly that extend beyond the unit square
  /// Triangles without area in UV space, or not finite: they cover nothing
  std::uint64_t without_area = 0;
  /// Mean distance between the two surfaces at the same UV, world units
  double mean_distance = 0;
  double p95_distance = 0;  ///< 95th percentile of the distance, rounded up by at most 1/512
};

/// A match method that bake() knows.
struct MatchInfo {
  MatchMethod method = {};         ///< Name of the match, for MatchOptions::method
  std::string_view searches = {};  ///< How the match finds points
  /// Options that affect this match but not all matches: their paths in BakeOptions, separated by blanks.
  /// "match.ray" stands for all that begin with "match.ray.". Those of "match.uv" need UVs of the high poly.
  std::string_view options = {};
  /// Names of the match in other programs, separated by blanks, for hints in messages.
  std::string_view other_names = {};
};

/// All methods, in the order in which users see them. Constant, with static lifetime: any thread may read
/// them.
std::span<const MatchInfo> matches();

/// Finds a match by its name.
/// \throws Error(usage) for an unknown name; the message lists the known ones
const MatchInfo& find_match(std::string_view name);

/// True if the search of a match depends on an option, such as "match.ray.rule", or on any option of a group, such as
/// "match.ray". Options are named by their paths in BakeOptions. Saved matches depend on none. Any thread may call
/// it.
bool obeys(const MatchInfo& match, std::string_view option);
/// True if a match requires exactly one direction in MatchOptions::views, so that the default
/// options are refused.
inline bool needs_direction(const MatchInfo& match) {
  return obeys(match, "match.views.directions") && !obeys(match, "match.views.count");
}

}  // namespace kiln
