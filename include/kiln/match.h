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

/// Which way a sample of a Match was decided, or why it was not.
enum class SampleStatus : std::uint8_t {
  empty = 0,      ///< No sample here: the texel is not covered
  outward = 1,    ///< Ray along the sample's direction
  inward = 2,     ///< Ray against it
  cage = 3,       ///< Ray from the cage inward
  missed = 4,     ///< No point within the distance
  view = 5,       ///< Seen in a depth view
  closest = 6,    ///< The nearest point
  uv = 7,         ///< The point with the same UV
  outermost = 8,  ///< Ray along the direction, past a nearer face
};

/// The correspondence of a bake, per sample of the map, kept on the host: everything else can be baked
/// from it again. Arrays have width * height elements (of the supersampled map), rows from the top. What
/// must hold of them says validate() (kiln/validate.h).
struct Match {
  std::uint32_t width = 0;             ///< map width * samples
  std::uint32_t height = 0;            ///< map height * samples
  std::uint32_t samples = 1;           ///< N x N a texel
  std::uint64_t source_triangles = 0;  ///< For checking against the mesh it is used with
  std::uint64_t source_hash = 0;  ///< Hash of the high poly's triangles and positions; 0: not known
  std::uint64_t low_hash = 0;     ///< Hash of the low poly's triangles, positions and UVs
  std::vector<std::uint32_t> triangle = {};  ///< Source triangle, 0xFFFFFFFF: none
  std::vector<float> u = {};                 ///< Weight of the triangle's corner 1
  std::vector<float> v = {};                 ///< Weight of the triangle's corner 2
  std::vector<float> distance = {};          ///< World units, outward positive
  std::vector<std::uint8_t> status = {};     ///< Values of SampleStatus

  /// The status of a sample; \param i below width * height.
  SampleStatus status_of(std::size_t i) const { return static_cast<SampleStatus>(status[i]); }
};

/// Writes a Match as a float EXR with channels `triangle` (unsigned int), `u`, `v`, `distance` (float),
/// `status` (unsigned int). The file appears whole or not at all. Several threads may save and load at once.
/// \throws Error(output); Error(input) for a match that does not hold together
void save_match(const Match& match, const std::filesystem::path& path);
/// Reads what save_match() wrote. \throws Error(input) that names the file and the field
Match load_match(const std::filesystem::path& path);

/// Which of the faces that a ray meets counts.
enum class RayRule {
  /// The outermost one that faces the sample, but no farther out than where the ray meets the low poly
  /// again: what lies beyond belongs to that part or fold of it. A sample inside another part of the low
  /// poly takes the nearest one.
  outermost,
  nearest,  ///< The nearest outward, else the nearest inward (Tarini et al., section 3.2)
};

/// Directions of rays that leave the low poly.
enum class RayDirection {
  /// Along its own normal, as shaded; near hard edges turned towards the averaged one, which both sides of
  /// an edge share. So details stand straight and edges have no gaps. Without hard edges: as averaged.
  automatic,
  averaged,  ///< Along the average of all normals at a vertex, interpolated
  face,      ///< Along its own normal everywhere: the two sides of a hard edge part
  /// As the low poly's vertices are coloured (Mesh::colors): where red is 255 along its own normal, where
  /// it is 0 averaged, between them blended. Without colours: Error(input).
  painted,
};

/// Which face a ray takes, and where rays leave the low poly to.
struct RayOptions {
  RayRule rule = RayRule::outermost;  ///< Without a cage; from a cage the first face counts
  RayDirection direction =
      RayDirection::automatic;  ///< With a cage, too; not with one of CageKind::offsets
  /// For RayDirection::automatic: from this far off a hard edge rays follow the mesh's own normal. Above 0.
  /// None given: for each edge by what the high poly has there. Two lengths compete, and the larger counts: two
  /// fifths of its bevel's width, and twice how much farther out the high poly lies beside it; 0.05% to 4% of
  /// the diagonal. Edges that do not tell take the median of the others; 1% of the diagonal where none tells.
  std::optional<Length> edge_width = {};
};

/// Forms of a cage mesh (MatchOptions::cage_mesh), told apart by its triangles.
enum class CageKind {
  /// The low poly's triangles: rays start there and run towards the low poly, whatever RayOptions::direction.
  offsets,
  /// Twice these, an outer shell and an inner one: rays start on their triangle's plane in the outer shell and
  /// end on that in the inner one. Where to is RayOptions::direction, with the way to the outer shell's vertices
  /// as the averaged direction. The outer shell comes first, unless the first half's group is "inner".
  shells,
  /// Any other: a closed hull around the low poly, wound as that is. Rays start where their directions leave
  /// it. Error(input) where one does not.
  hull,
};

/// Distances of a cage mesh from the low poly. Lengths in world units, over the low poly's corners; of a
/// hull over places spread over its faces, too.
struct CageReport {
  CageKind kind = CageKind::offsets;  ///< Form that the cage mesh was taken for
  double outward_least = 0;           ///< Rays start so far out
  double outward_median = 0;          ///< The one in the middle
  double outward_most = 0;            ///< The farthest
  double inward_least =
      0;  ///< Rays end so far in; 0 where the cage does not say (not CageKind::shells)
  double inward_median = 0;  ///< The one in the middle
  double inward_most = 0;    ///< The deepest
};

/// Widths around the low poly's hard edges within which rays turn. World units.
struct EdgeReport {
  std::uint64_t edges = 0;  ///< Hard edges
  std::uint64_t found = 0;  ///< Whose width was found on the high poly; 0 where it was given
  double least = 0;         ///< The narrowest
  double median = 0;        ///< The one in the middle
  double most = 0;          ///< The widest
};

/// By which names of a mesh's triangles parts are told apart.
enum class PartsBy {
  name,      ///< Groups (Mesh::groups; without any, objects), by patterns of their names
  group,     ///< Groups of the same name
  object,    ///< Objects (Mesh::objects) of the same name
  material,  ///< Materials of the same name
  list,      ///< Groups, as a list of pairs says
};

/// A pair of a list. Names are patterns, in which `*` is any text.
struct PartPair {
  std::string low = {};  ///< Pattern of names of the low poly's groups
  std::vector<std::string> high =
      {};  ///< Patterns of names of the high poly's groups: any of these
};

/// Which parts of two meshes belong together, by their names. A pattern is text with `*` for any
/// text, also none; its first `*`, which must stand for some text, is the part's name. Of its other text
/// upper and lower case are the same. Where no pattern fits, a number at the end as Blender gives it to
/// copies (`.001`) is left out.
struct PartNames {
  /// For PartsBy::name: the low poly's
  std::vector<std::string> low = {"*_low", "*_lp", "*_lo", "*_lowpoly"};
  /// For PartsBy::name: the high poly's
  std::vector<std::string> high = {"*_high", "*_high_*", "*_hp",       "*_hp_*",
                                   "*_hi",   "*_hi_*",   "*_highpoly", "*_highpoly_*"};
  PartsBy by = PartsBy::name;       ///< Which names
  std::vector<PartPair> list = {};  ///< For PartsBy::list: the first that fits counts
};

/// Pairs of parts: samples on a part of the low poly find points of its part of the high poly alone.
struct Parts {
  std::uint32_t count = 0;  ///< Parts are 0 to count - 1
  std::vector<std::string> names =
      {};  ///< Name of each part; the last one may be "": all that has no pair
  std::vector<std::uint32_t> low = {};   ///< Part of each triangle of the low poly
  std::vector<std::uint32_t> high = {};  ///< Part of each triangle of the high poly
  /// unmatched-parts: groups without a pair, and the nearest name; by PartsBy::name also the patterns by which
  /// most would have one
  std::vector<Warning> warnings = {};
};

/// Pairs the parts of two meshes. By PartsBy::name `X_low` takes `X_high`, `X_high.001` and `X_high_...`, or
/// what patterns say; a name that fits no pattern is a part's name itself, so `X` takes `X`, too. All that
/// has no pair is one part of its own. Time: that of reading the names and triangles; of patterns of a
/// list, those are tried whose text before `*` a name begins with. Names alone count: nothing is welded. The result is the caller's own and
/// fits these two meshes as long as their triangles stay. Thread safety: may be called from several threads.
/// \throws Error(input) where a mesh has no such names, or none of them has a pair
/// \throws Error(usage) for a pattern without `*`, or an empty list
Parts pair_parts(const Mesh& high, const Mesh& low, const PartNames& names = {});

/// A match: a way to find the point of the high poly that a sample stands for. Its name alone, so that
/// matches can be added without a change here.
struct MatchMethod {
  std::string_view name = {};  ///< As in `--match`; lives as long as the program
  constexpr MatchMethod() = default;
  /// The match of a name, such as {"ray"}. It is copied, once a name, and kept as long as the program.
  constexpr MatchMethod(const char* text)
      : name(std::is_constant_evaluated() ? std::string_view(text)
                                          : MatchMethod(std::string_view(text)).name) {}
  explicit MatchMethod(std::string_view text);  ///< The same
  friend constexpr bool operator==(MatchMethod, MatchMethod) = default;

  static const MatchMethod ray;  ///< Rays along the low poly's normals (Tarini et al., section 3.2)
  /// Depth views from all around (Wang et al., section 2): no BVH, but blind where no view sees
  static const MatchMethod views;
  /// The nearest point of faces that do not look away from the sample (Tarini et al., section 3.1): finds
  /// something wherever the mesh is near, but bunches at ridges and skips creases
  static const MatchMethod closest;
  /// Rays along the direction that each place is seen from (Tarini et al., section 3.3)
  static const MatchMethod visibility;
  /// Rays between that direction and the normal (Tarini et al., section 3.4)
  static const MatchMethod hybrid;
  /// The point with the sample's own UV (Gumbau, Gonzalez, Chover 2006): no search, where the high poly
  /// has UVs that lie over the low poly's
  static const MatchMethod uv;
  static const MatchMethod axis;  ///< Rays along one axis both ways, ViewOptions::directions[0]
};
inline constexpr MatchMethod MatchMethod::ray{"ray"};
inline constexpr MatchMethod MatchMethod::views{"views"};
inline constexpr MatchMethod MatchMethod::closest{"closest"};
inline constexpr MatchMethod MatchMethod::visibility{"visibility"};
inline constexpr MatchMethod MatchMethod::hybrid{"hybrid"};
inline constexpr MatchMethod MatchMethod::uv{"uv"};
inline constexpr MatchMethod MatchMethod::axis{"axis"};

/// Choice among the views that show a sample within the distance.
enum class ViewCriterion {
  depth,     ///< The least depth difference at the pixel (Wang et al., section 2)
  distance,  ///< The least true distance to the point under the sample
  angle,     ///< The one that looks most along the sample's direction (Wang et al., section 6)
};

/// Which depth views MatchMethod::views draws, and which of them decides a sample.
struct ViewOptions {
  /// Directions spread over the sphere, up to 512. None given: 12, or 1 where both meshes are height
  /// fields. 0 only beside `directions`.
  std::optional<std::uint32_t> count = {};
  /// Choose directions by what they see, as many as are worth it, up to `count` (none given: 64).
  bool automatic = false;
  /// The caller's own, beside those: from the mesh to the viewer, of any length above 0.
  std::vector<Vec3> directions = {};
  /// Pixels a side of a depth view, up to 8192. 0: by the mesh's density, but no more than two pixels
  /// across a sample of the map.
  std::uint32_t size = 0;
  ViewCriterion criterion = ViewCriterion::angle;  ///< Which view decides
  /// Move each point from the view's line to the sample's own direction where the view shows it there:
  /// what a ray would have found. Off: as in the paper.
  bool refine = true;
};

/// Elements at which directions of visibility are gathered.
enum class VisibilityAt {
  face,    ///< On faces, then averaged at vertices by the faces' angles there
  vertex,  ///< At vertices: what sees places of their faces, each by its barycentric weight there
  texel,   ///< At texels, smoothed over neighbours on the surface, across seams too
};

/// Tests whether a place is seen from a direction.
enum class VisibilityTest {
  automatic,  ///< views
  views,      ///< Pictures of the low poly, as in the paper: as fine as their pixels
  rays,       ///< Rays from texels, or from 16 places of each face: no pixels, and slower
};

/// From where the low poly is likely to be looked at. +Y is up.
enum class ViewLikelihood {
  all,      ///< From all around alike
  horizon,  ///< From the side: the squared cosine of the angle to the horizon
  up,       ///< From above: 1 straight above, 0 straight below, by half the height
  list,     ///< As `VisibilityOptions::likelihoods` says
};

/// For MatchMethod::visibility and hybrid. Of many directions, spread evenly, some see a place
/// past the low poly itself. Their mean is the place's direction. Weights are the cosine at
/// which each sees the face (as pixels of pictures count) and how likely a view from there is.
struct VisibilityOptions {
  VisibilityAt at = VisibilityAt::texel;            ///< Elements at which directions are gathered
  VisibilityTest test = VisibilityTest::automatic;  ///< Test of what sees a place
  std::uint32_t directions = 512;                   ///< 1 to 4096
  std::uint32_t view_size = 256;                    ///< Pixels a side of a picture, 16 to 2048
  /// Rounds of smoothing of texels' directions, each over 3 x 3 texels, 0 to 256; the result reaches about
  /// the square root of this many texels.
  std::uint32_t smoothing = 4;
  ViewLikelihood likelihood = ViewLikelihood::all;  ///< Weights of directions
  /// Likelihood of the views from one direction.
  struct Likelihood {
    Vec3 direction = {};  ///< From the mesh to the viewer, of any length above 0
    double weight = 1;    ///< 0 or more
  };
  /// 1 to 4; above 1 only with MatchMethod::visibility at texels, for this many maps. Where the
  /// directions that see a texel scatter, they are parted into so many clusters. Each has a map of
  /// its own (Tarini et al., section 6). Elsewhere the maps are the same.
  std::uint32_t clusters = 1;
  /// Standard deviation above which a texel's directions are parted, 0 to 1. That of an open plane is 0.745.
  double cluster_deviation = 0.8;
  /// For ViewLikelihood::list: each of the spread directions takes the weight of the nearest of these. Only
  /// ratios of weights count.
  std::vector<Likelihood> likelihoods = {};
};

/// Bounds of layouts that MatchMethod::uv trusts. Shares, 0 or more; infinity for no bound.
struct UvOptions {
  double warn_overlap = 0;    ///< Warns where more of the high poly's samples are covered twice,
  double max_overlap = 0.05;  ///< ... and refuses
  /// Warns where the 95th percentile of the distances between the surfaces exceeds this share of the diagonal,
  double warn_distance = 0.01;
  double max_distance = 0.05;  ///< ... and refuses
};

/// Settings of the match, which finds points of the high poly.
struct MatchOptions {
  MatchMethod method = MatchMethod::ray;  ///< Way to find points of the high poly
  ViewOptions views = {};                 ///< For MatchMethod::views; its directions for axis
  VisibilityOptions visibility = {};      ///< For MatchMethod::visibility and hybrid
  UvOptions uv = {};                      ///< For MatchMethod::uv
  RayOptions ray = {};                    ///< For MatchMethod::ray
  /// Asked in order for the samples that the methods before leave undecided: none of them `method`, none
  /// twice, and none of "match.uv". None given: such samples are misses.
  std::vector<MatchMethod> fallback = {};
  /// 0 to 256 texels: the way over the surface on which the method's normals
  /// give way to the fallback's. The map then has no step there, but where
  /// the fallback finds nothing. Takes up to twice the match's time.
  std::uint32_t fallback_blend = 0;

  /// Distance that the match looks each way (nearest points: all around; MatchMethod::uv does not look);
  /// with a cage, the ray's length from the cage inward. Above 0. None given: kSearchDistance;
  /// with a cage, twice its distance (twice the longest one of a cage mesh). Without either, rays
  /// that miss on an open sheet of the low poly (a leaf card) look again: half the sheet's diagonal.
  std::optional<Length> max_distance = {};
  /// MatchMethod::ray without a cage: look so far first, and up to max_distance only where nothing is there. Above 0.
  /// None given: at once. For low polys that lie close to the high poly all over, and crowded with other surfaces.
  std::optional<Length> near_distance = {};
  std::optional<Length> cage = {};  ///< Cast from this far outside, inward, first hit
  /// ... or from this mesh: see CageKind for the three forms it may have. find_cage() (kiln/cage.h) makes one.
  /// Read during the call; a session reads it when made.
  const Mesh* cage_mesh = nullptr;
  /// Samples find points of their own part alone. Lists as long as the meshes have triangles. For matches
  /// that look from samples alone: ray, closest, axis, and these as fallbacks. Other parts still occlude, but with OcclusionOptions::own_part.
  /// Read during the call; must outlive a session.
  const Parts* parts = nullptr;
  UvCopies uv_copies = UvCopies::plain;  ///< Which of several triangles of the same UVs is baked
  bool two_sided = false;  ///< Also hit back faces of the source; normals that point away
                           ///< from the low poly are turned to it
  /// Take this match instead of looking: no fallback then, and all else here is not read. Read during the call.
  const Match* saved = nullptr;
};

/// Bakes onto a low poly that simplify() made look from near first (near_distance), and as far as it strays
/// (max_distance). What `match` says already stays.
/// \param made  of simplify(), also where the low poly was unwrapped since
void look_as_far(const SimplifyReport& made, MatchOptions& match);

/// Which of several maps serves which views, by texels of the field of directions (the map's size; at most
/// 2048 a side).
struct VisibilityClusters {
  std::uint32_t width = 0;   ///< Side of the field, texels
  std::uint32_t height = 0;  ///< Side of the field, texels
  std::uint32_t count = 0;   ///< Maps
  /// Number of clusters of each texel; 0: not covered. 1: all maps are alike
  std::vector<std::uint8_t> number = {};
  /// [width * height * count] of each texel's clusters, unit, from the mesh to the viewer; those beyond its
  /// number are as the first
  std::vector<Vec3> directions = {};
};

/// Writes a float EXR with channels `count` (unsigned int: the number) and, for each map k from 0,
/// `direction<k>.X`, `.Y` and `.Z`. May be called from several threads, for files of different names.
/// \throws Error(output)
void save_clusters(const VisibilityClusters& clusters, const std::filesystem::path& path);

/// Report of a match by depth views.
struct ViewReport {
  std::vector<Vec3> directions = {};  ///< Directions of the views, in order
  std::vector<double> coverage =
      {};  ///< For views chosen automatically: share of probed samples seen after each
  std::uint32_t size = 0;     ///< Pixels a side
  double pixel = 0;           ///< Side of a pixel, world units
  double undersampled = 0;    ///< Share of the high poly with triangles smaller than a pixel
  bool height_field = false;  ///< Detected: one view
};

/// Report of gathering directions of visibility. Places are texels of the field, or vertices.
struct VisibilityReport {
  std::uint32_t directions = 0;  ///< With a weight above 0
  bool by_rays = false;          ///< Else by pictures
  std::uint32_t width = 0;       ///< Side of the field of texels
  std::uint32_t height = 0;      ///< Side of the field of texels
  std::uint64_t places = 0;      ///< Number of elements at which directions were gathered
  std::uint64_t unseen = 0;  ///< Places that no direction sees, after smoothing; filled from around
  std::uint64_t without = 0;    ///< Unseen places with nothing around either: they keep the normal
  std::uint64_t clustered = 0;  ///< Places whose directions were parted
  /// Standard deviation of the directions that see a place, mean over places
  double mean_deviation = 0;
  double seconds = 0;  ///< Part of seconds_match
};

/// True if the layouts are fit for matching by UVs: the high poly's must not overlap, and both must agree.
struct UvReport {
  std::uint64_t covered = 0;  ///< Samples of the map that the high poly's UV triangles cover
  std::uint64_t overlapping =
      0;  ///< ... more than one of them; the one with the lowest index counts
  /// Two triangles of the high poly that cover one texel.
  struct Overlap {
    std::uint32_t lower = 0;   ///< The triangle with the lower index
    std::uint32_t upper = 0;   ///< The other one
    std::uint32_t column = 0;  ///< Column of the texel
    std::uint32_t row = 0;     ///< Row of the texel, from the top
  };
  Overlap overlap =
      {};  ///< An example, where `overlapping` is above 0: the first by rows, then columns
  std::uint64_t outside = 0;       ///< Triangles of the high poly that reach out of the unit square
  std::uint64_t without_area = 0;  ///< Without area in UV space, or not finite: they cover nothing
  double mean_distance = 0;        ///< Between the two surfaces at the same UV, world units
  double p95_distance = 0;         ///< 95th percentile of it, rounded up by at most one part in 512
};

/// A way to match that bake() knows.
struct MatchInfo {
  MatchMethod method = {};         ///< Its name, for MatchOptions::method
  std::string_view searches = {};  ///< Its search, in words
  /// Options that it obeys and not every match does: their paths in BakeOptions, separated by blanks. "match.ray" stands for
  /// all that begin with "match.ray.". Those of "match.uv" need UVs of the high poly.
  std::string_view options = {};
  /// Names that other programs have for it, separated by blanks: messages answer to these names.
  std::string_view other_names = {};
};

/// All of them, in the order that they are listed to people. Constant, and as long-lived as the program: any
/// thread may read them.
std::span<const MatchInfo> matches();

/// One of matches(), by its name.
/// \throws Error(usage) for a name that no match has; the message lists those there are
const MatchInfo& find_match(std::string_view name);

/// True if a match goes by an option when it looks for points, such as "match.ray.rule", or by one of a group, such as
/// "match.ray": paths in BakeOptions. A saved match obeys none of these. Any thread may call it.
bool obeys(const MatchInfo& match, std::string_view option);
/// True if a match needs exactly one of MatchOptions::views.directions: it cannot be tried without being told more.
inline bool needs_direction(const MatchInfo& match) {
  return obeys(match, "match.views.directions") && !obeys(match, "match.views.count");
}

}  // namespace kiln
