#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/render.h"

namespace kiln {

/// Which ray kernels run: explicit vectors for CPU devices, one ray a work-item for GPUs, or by the
/// device's type.
enum class RayTraversal { automatic, cpu, gpu };

/// A box that a mesh's positions lie in, in its own units (its origin left out).
struct Bounds {
  std::array<double, 3> low{}, high{};
  /// Of the finite vertices that triangles use. \throws Error(input) where there are none
  static Bounds of(const Mesh& mesh);
};

/// The dense mesh on the device: triangles, hierarchy, normals. Built once, baked from many times,
/// immutable. Cheap to copy (shared). Structures that only some matches need (the hierarchy, say, which
/// rays and nearest points walk) are made at their first use.
class Source {
 public:
  /// \param traversal  which ray kernels to use; all give the same answer to the bit
  /// \param bounds  the box that takes the place of the mesh's own: "the diagonal" is then its diagonal,
  ///                and meshes that move within it are rounded alike. About the mesh's own size
  /// \throws Error(input) where no triangle is usable, Error(usage) for a box without size, Error(device)
  ///         where memory runs out
  explicit Source(const Device& device, const Mesh& high,
                  RayTraversal traversal = RayTraversal::automatic,
                  const std::optional<Bounds>& bounds = std::nullopt);

  struct Stats {
    std::uint64_t triangles = 0;
    std::uint64_t skipped_triangles = 0;  ///< Non-finite or without area
    std::uint64_t device_bytes = 0;
    double build_seconds = 0;  ///< Hierarchy and other structures made so far
    double diagonal = 0;       ///< Of the bounding box, world units
  };
  Stats stats() const;
  const std::vector<Warning>& warnings() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Which detail a map holds: the name of a map, so that maps can be added without a change here.
struct MapKind {
  std::string_view name;
  friend constexpr bool operator==(MapKind, MapKind) = default;

  static const MapKind normal;  ///< Unit normal of the high poly, in `BakeOptions::space`
  static const MapKind mask;    ///< 1 channel: 1 where a texel was baked, 0 elsewhere
};
inline constexpr MapKind MapKind::normal{"normal"};
inline constexpr MapKind MapKind::mask{"mask"};

/// What a sample gets for which no point of the dense mesh was found.
enum class MissPolicy {
  keep,  ///< The light mesh's own interpolated normal (Wang et al., section 2)
  fill,  ///< Filled from neighbouring texels of the map, like the gutter
  mark,  ///< Magenta (1, 0, 1), to be seen
};

/// A length in world units, or as a share of the dense mesh's bounding-box diagonal.
struct Length {
  double value = 0;
  bool relative = true;
  static Length share(double of_diagonal) { return {of_diagonal, true}; }
  static Length absolute(double units) { return {units, false}; }
};

/// Called with the share done, in [0, 1], and what is being done; return false to cancel.
using Progress = std::function<bool(double done, std::string_view stage)>;

/// How the match finds the point of the high poly that a sample stands for: the name of a match, so that
/// matches can be added without a change here.
struct MatchMethod {
  std::string_view name;
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
};
inline constexpr MatchMethod MatchMethod::ray{"ray"};
inline constexpr MatchMethod MatchMethod::views{"views"};
inline constexpr MatchMethod MatchMethod::closest{"closest"};
inline constexpr MatchMethod MatchMethod::visibility{"visibility"};
inline constexpr MatchMethod MatchMethod::hybrid{"hybrid"};
inline constexpr MatchMethod MatchMethod::uv{"uv"};

/// What decides samples that the method leaves undecided.
enum class Fallback {
  low,      ///< Nothing: they are misses
  ray,      ///< Rays
  closest,  ///< The nearest point
  views,    ///< Depth views
};

/// Of the views that show a sample within the distance, which one decides it.
enum class ViewCriterion {
  depth,     ///< The least depth difference at the pixel (Wang et al., section 2)
  distance,  ///< The least true distance to the point under the sample
  angle,     ///< The one that looks most along the sample's direction (Wang et al., section 6)
};

struct ViewOptions {
  /// Directions spread over the sphere, up to 512. None given: 12, or 1 where both meshes are height
  /// fields. 0 only beside `directions`.
  std::optional<std::uint32_t> count;
  /// Choose directions by what they see, as many as are worth it, up to `count` (none given: 64).
  bool automatic = false;
  /// The caller's own, beside those: from the mesh to the viewer, of any length above 0.
  std::vector<Vec3> directions;
  /// Pixels a side of a depth view, up to 8192. 0: by the mesh's density, but no more than two pixels
  /// across a sample of the map.
  std::uint32_t size = 0;
  ViewCriterion criterion = ViewCriterion::angle;
  /// Move each point from the view's line to the sample's own direction where the view shows it there:
  /// what a ray would have found. Off: as in the paper.
  bool refine = true;
};

/// Where directions of visibility are gathered.
enum class VisibilityAt {
  face,    ///< On faces, then averaged at vertices by the faces' angles there
  vertex,  ///< At vertices
  texel,   ///< At texels, smoothed over neighbours on the surface, across seams too
};

/// How it is found out whether a place is seen from a direction.
enum class VisibilityTest {
  automatic,  ///< views, but for vertices rays
  views,      ///< Pictures of the light mesh: as fine as their pixels
  rays,       ///< Rays from the place: exact
};

/// From where the light mesh is likely to be looked at. +Y is up.
enum class ViewLikelihood {
  all,      ///< From all around alike
  horizon,  ///< From the side: the squared cosine of the angle to the horizon
  up,       ///< From above: 1 straight above, 0 straight below, by half the height
  list,     ///< As `VisibilityOptions::likelihoods` says
};

/// For MatchMethod::visibility and hybrid. The direction of a place is the mean of all directions, out of
/// many spread evenly, that see it past the light mesh itself, each weighted by the cosine at which it
/// sees the face (what counting pixels in pictures comes to) and by how likely a view from there is.
struct VisibilityOptions {
  VisibilityAt at = VisibilityAt::texel;
  VisibilityTest test = VisibilityTest::automatic;
  std::uint32_t directions = 512;  ///< 1 to 4096
  std::uint32_t view_size = 256;   ///< Pixels a side of a picture, 16 to 2048
  /// Rounds of smoothing of texels' directions, each over 3 x 3 texels, 0 to 256; the result reaches about
  /// the square root of this many texels.
  std::uint32_t smoothing = 4;
  ViewLikelihood likelihood = ViewLikelihood::all;
  struct Likelihood {
    Vec3 direction;  ///< From the mesh to the viewer, of any length above 0
    double weight = 1;
  };
  /// 1 to 4; above 1 only with MatchMethod::visibility at texels, for this many maps: where the directions
  /// that see a texel scatter, they are parted into so many clusters, each with a map of its own (Tarini et
  /// al., section 6). Elsewhere the maps are the same.
  std::uint32_t clusters = 1;
  /// Standard deviation above which a texel's directions are parted, 0 to 1. That of an open plane is 0.745.
  double cluster_deviation = 0.8;
  /// For ViewLikelihood::list: each of the spread directions takes the weight of the nearest of these. Only
  /// ratios of weights count.
  std::vector<Likelihood> likelihoods = {};
};

/// How far MatchMethod::uv trusts the layouts. Shares, 0 or more; infinity for no bound.
struct UvOptions {
  double warn_overlap = 0;    ///< Warns where more of the dense mesh's samples are covered twice,
  double max_overlap = 0.05;  ///< ... and refuses
  /// Warns where the 95th percentile of the distances between the surfaces exceeds this share of the diagonal,
  double warn_distance = 0.01;
  double max_distance = 0.05;  ///< ... and refuses
};

struct BakeOptions {
  std::uint32_t width = 2048;  ///< 1 to 16384 texels
  std::uint32_t height = 2048;
  std::uint32_t samples = 1;  ///< N x N samples a texel, 1 to 16
  std::vector<MapKind> maps = {MapKind::normal};

  MatchMethod method = MatchMethod::ray;
  ViewOptions views;                  ///< For MatchMethod::views and Fallback::views
  VisibilityOptions visibility;       ///< For MatchMethod::visibility and hybrid
  UvOptions uv;                       ///< For MatchMethod::uv
  Fallback fallback = Fallback::low;  ///< Another method than `method`
  /// 0 to 256 texels: this near to what the fallback decided, over the surface, the method's normals give
  /// way to the fallback's, so that the map has no step there; but where the fallback finds nothing. Takes
  /// up to twice the match's time.
  std::uint32_t fallback_blend = 0;

  /// How far the match looks each way (nearest points: all around; MatchMethod::uv does not look); with a
  /// cage, the ray's length from the cage inward. Above 0. None given: 2% of the diagonal; with a cage,
  /// twice its distance (twice the longest one of a cage mesh).
  std::optional<Length> max_distance;
  std::optional<Length> cage;       ///< Cast from this far outside, inward, first hit
  const Mesh* cage_mesh = nullptr;  ///< ... or from this mesh (the light mesh's topology)
  bool two_sided = false;           ///< Also hit back faces of the source; normals that point away
                                    ///< from the light surface are turned to it

  NormalMapSpace space = NormalMapSpace::tangent;
  bool flip_y = false;         ///< Green down (DirectX); default up (OpenGL)
  bool two_component = false;  ///< Third component left out (0): z = sqrt(1 - x^2 - y^2)
  bool raw = false;            ///< Components in [-1, 1] instead of n/2 + 1/2
  MissPolicy miss = MissPolicy::keep;
  std::int32_t gutter = 16;  ///< Texels; -1: infinite (push-pull)
  /// Also make mip-maps, filtered within charts: nothing of one chart, nor of the gutter, gets into
  /// another (Wang et al., section 6), as it does where mip-maps are made from the image alone.
  bool mips = false;

  bool keep_match = false;              ///< Return the correspondence in BakeResult::match
  const struct Match* match = nullptr;  ///< Reuse this one instead of matching
  Progress progress;
};

/// The correspondence of a bake, per sample of the map, kept on the host: everything else can be baked
/// from it again. Arrays have width * height elements (of the supersampled map), rows from the top.
struct Match {
  std::uint32_t width = 0;  ///< map width * samples
  std::uint32_t height = 0;
  std::uint32_t samples = 1;
  std::uint64_t source_triangles = 0;  ///< For checking against the mesh it is used with
  std::uint64_t source_hash = 0;  ///< Of the dense mesh's triangles and positions; 0: not known
  std::uint64_t low_hash = 0;     ///< Of the light mesh's triangles, positions and UVs
  std::vector<std::uint32_t> triangle;  ///< Source triangle, 0xFFFFFFFF: none
  std::vector<float> u, v;              ///< Weights of the triangle's corners 1 and 2
  std::vector<float> distance;          ///< World units, outward positive
  std::vector<std::uint8_t> status;     ///< 0 not covered, 1 outward, 2 inward, 3 cage, 4 miss,
                                        ///< 5 view, 6 nearest point, 7 UV
};

/// Writes and reads a Match as a float EXR with channels `triangle` (unsigned int), `u`, `v`, `distance`
/// (float), `status` (unsigned int).
/// \throws Error(output); Error(input)
void save_match(const Match& match, const std::filesystem::path& path);
Match load_match(const std::filesystem::path& path);

/// Which of several maps serves which views, by texels of the field of directions (the map's size; at most
/// 2048 a side).
struct VisibilityClusters {
  std::uint32_t width = 0, height = 0;
  std::uint32_t count = 0;  ///< Maps
  /// Of clusters of each texel; 0: not covered. 1: all maps are alike
  std::vector<std::uint8_t> number;
  /// [width * height * count] of each texel's clusters, unit, from the mesh to the viewer; those beyond its
  /// number are as the first
  std::vector<Vec3> directions;
};

/// Writes a float EXR with channels `count` (unsigned int: the number) and, for each map k from 0,
/// `direction<k>.X`, `.Y` and `.Z`.
/// \throws Error(output)
void save_clusters(const VisibilityClusters& clusters, const std::filesystem::path& path);

struct BakedMap {
  MapKind kind = MapKind::normal;
  Image image;
  /// With BakeOptions::mips: levels 1 and on, down to 1 x 1; sides halve, rounded down. A texel holds the
  /// mean over the covered texels of level 0 under it, made unit, of the one chart that covers most of
  /// it. Encoded like the image, with a gutter of its width in UV units, but 2 texels at least (none
  /// where it has none).
  std::vector<Image> mips;
  std::uint32_t cluster = 0;  ///< Which one of VisibilityOptions::clusters
};

/// What matching by depth views came to.
struct ViewReport {
  std::vector<Vec3> directions;  ///< Of the views, in order
  std::vector<double>
      coverage;             ///< Where chosen automatically: share of probed samples seen after each
  std::uint32_t size = 0;   ///< Pixels a side
  double pixel = 0;         ///< Side of a pixel, world units
  double undersampled = 0;  ///< Share of the dense surface with triangles smaller than a pixel
  bool height_field = false;  ///< Detected: one view
};

/// What gathering directions of visibility came to. Places are texels of the field, or vertices.
struct VisibilityReport {
  std::uint32_t directions = 0;         ///< With a weight above 0
  bool by_rays = false;                 ///< Else by pictures
  std::uint32_t width = 0, height = 0;  ///< Of the field of texels
  std::uint64_t places = 0;
  std::uint64_t unseen = 0;  ///< Places that no direction sees, after smoothing; filled from around
  std::uint64_t without = 0;    ///< Of these, with nothing around either: they keep the normal
  std::uint64_t clustered = 0;  ///< Places whose directions were parted
  /// Standard deviation of the directions that see a place, mean over places
  double mean_deviation = 0;
  double seconds = 0;  ///< Part of seconds_match
};

/// How much the map changes from texel to texel where the method changes, and where it does not.
struct SwitchReport {
  std::uint64_t sides = 0;  ///< Between texels of one chart that different methods decided, or none
  double mean_degrees = 0;  ///< Over these sides, between the map's unit vectors
  double elsewhere_degrees = 0;  ///< Over all others
};

/// Whether the layouts are fit for matching by UVs: the dense one must not overlap, and both must agree.
struct UvReport {
  std::uint64_t covered = 0;  ///< Samples of the map that the dense mesh's UV triangles cover
  std::uint64_t overlapping =
      0;  ///< ... more than one of them; the one with the lowest index counts
  struct Overlap {
    std::uint32_t lower = 0, upper = 0;  ///< Dense triangles
    std::uint32_t column = 0, row = 0;   ///< Texel
  };
  std::optional<Overlap> overlap;  ///< An example: the first by rows, then columns
  std::uint64_t outside = 0;       ///< Dense triangles that reach out of the unit square
  std::uint64_t without_area = 0;  ///< Without area in UV space, or not finite: they cover nothing
  /// Distance between the two surfaces at the same UV, world units. The percentile is rounded up, by
  /// at most one part in 512.
  double mean_distance = 0, p95_distance = 0;
};

struct BakeReport {
  std::uint64_t texels = 0;  ///< Covered by the light mesh
  std::uint64_t samples = 0;
  /// Samples by status
  std::uint64_t outward = 0, inward = 0, cage = 0, viewed = 0, closest = 0, missed = 0;
  std::uint64_t by_uv = 0;  ///< Samples by status, too
  std::uint64_t gutter_texels = 0;
  double max_distance = 0;               ///< As used, world units
  double mean_abs_distance = 0;          ///< Of the samples that hit, world units
  std::optional<ViewReport> views;       ///< Where matched by views
  std::optional<SwitchReport> switches;  ///< Where a fallback was asked for; before blending
  std::optional<SwitchReport> switches_blended;  ///< After, where blending was asked for
  std::uint64_t blended_texels = 0;            ///< Of the method, that took some of the fallback's
  std::optional<VisibilityReport> visibility;  ///< Where matched by visibility
  std::optional<UvReport> uv;                  ///< Where matched by UVs
  double seconds_build = 0;                    ///< Structures of the source, made for this bake
  double seconds_texels = 0, seconds_match = 0, seconds_detail = 0, seconds_image = 0;
  double seconds_mips = 0;  ///< Charts, levels, their gutters and encoding
  std::uint64_t peak_device_bytes = 0;
  std::vector<Warning> warnings;
};

struct BakeResult {
  std::vector<BakedMap> maps;
  std::vector<std::uint8_t> coverage;  ///< Per texel: 0 empty, 1 baked, 2 missed, 3 gutter
  std::optional<Match> match;
  std::optional<VisibilityClusters> clusters;  ///< Where more than one was asked for
  BakeReport report;  ///< With several clusters of the first one, but for what all have in common
  bool cancelled = false;  ///< The progress callback said stop: there are no maps.
};

/// Bakes maps of the dense mesh for the light one.
///
/// The same input gives the same bytes on every run, number of threads and conforming device. Memory is
/// bounded by the map and the meshes: work is cut into bands of rows.
/// \param low  needs UVs
/// \throws Error(usage) for a parameter out of range, Error(input) for a mesh without UVs,
///         Error(device). Nothing is left behind.
BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// Matching by depth views one view at a time, as in an interactive session (Wang et al., section 2): each
/// view improves the correspondence that is there, and none is drawn twice. After any views the match is,
/// to the bit, what bake() finds with the same directions in the same order.
class ViewSession {
 public:
  /// \param options  size, samples, max_distance, two_sided and of the views size (0: by the mesh's
  ///                 density), criterion and refine count; maps, methods, fallback and directions do not
  /// \throws Error as bake()
  ViewSession(const Source& source, const Mesh& low, const BakeOptions& options = {});
  ~ViewSession();
  ViewSession(ViewSession&&) noexcept;
  ViewSession& operator=(ViewSession&&) noexcept;

  struct Step {
    std::uint64_t samples = 0;  ///< Of the light mesh
    std::uint64_t decided = 0;  ///< By any view so far
    std::uint64_t changed = 0;  ///< That this view newly decided, or decided better
  };
  /// Adds a view. \param toward  from the mesh to the viewer, of any length above 0
  Step add(const Vec3& toward);

  /// The correspondence so far, for BakeOptions::match, save_match() or measuring.
  Match match() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
