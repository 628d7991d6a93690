#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// A map of the caller's own: a function of the high poly's point in OpenCL C 1.2, run once a sample.
///
/// It is a program with the caller's rights: native code within this process, which may write anywhere in its memory and
/// crash it. No mesh or material names one; it is the caller's to trust.
///
/// The source defines `float4 kiln_map(const kiln_point* point)`; kernels/detail/own.clh documents the point and
/// the ray caster. It may define further functions, and includes nothing. What it returns is averaged over a
/// texel's samples, number by number. Where nothing was found it is not called: those texels are filled from
/// their neighbours, or marked. Its places are measured from BakedMap::origin. Strings are copied; one OwnMap may serve bakes on several threads.
struct OwnMap {
  std::string name = "own";    ///< Name of the map: a letter, then letters, digits and _
  std::string source = {};     ///< OpenCL C
  std::string file = {};       ///< The source's name in the messages of its build
  std::uint32_t channels = 3;  ///< 1, 3 or 4 of the numbers returned are kept
};

/// Which detail a map holds: the name of a map, so that maps can be added without a change here.
struct MapKind {
  std::string_view name = {};  ///< As in `--maps` and file names; lives as long as the program
  constexpr MapKind() = default;
  /// The map of a name, such as {"ao"}. It is copied, once a name, and kept as long as the program.
  constexpr MapKind(const char* text)
      : name(std::is_constant_evaluated() ? std::string_view(text)
                                          : MapKind(std::string_view(text)).name) {}
  explicit MapKind(std::string_view text);  ///< The same
  friend constexpr bool operator==(MapKind, MapKind) = default;

  static const MapKind normal;  ///< Unit normal of the high poly, in `EncodingOptions::space`
  static const MapKind mask;    ///< 1 channel: 1 where a texel was baked, 0 elsewhere
};
inline constexpr MapKind MapKind::normal{"normal"};
inline constexpr MapKind MapKind::mask{"mask"};

/// Axes of a normal's components: the low poly's tangent frame (MikkTSpace, or Mesh::tangents), the axes of object
/// space, or a frame of the low poly's face.
enum class NormalMapSpace { tangent, object, face };

/// Place where the third axis of tangent space is computed: the same as in the shader that shows the map.
enum class Bitangent {
  pixel,  ///< From the interpolated normal and tangent: MikkTSpace's own way, Blender, Unreal Engine
  vertex,  ///< At the corners, and interpolated: Unity's way, and shaders with a bitangent a vertex
};

/// Ways to gather light around the high poly's points.
enum class OcclusionBy {
  rays,   ///< Rays over the hemisphere of each sample
  views,  ///< Depth views of all that occludes, from all around; each sample looks into every one. For the maps
  ///< ao and bent_normal, without a distance or falloff, and with faces that occlude from both sides
  automatic,  ///< Two views a ray, where views serve and are expected to take less time; else rays. Beyond 64 rays
              ///< views come less near than rays do
};

/// Weight of a ray's first hit in darkening, by x = d / D: its distance d from the point over
/// OcclusionOptions::distance D. A hit at D or beyond darkens nothing.
enum class OcclusionFalloff {
  none,    ///< 1: all alike
  linear,  ///< 1 - x
  smooth,  ///< 1 - x^2 (3 - 2 x): without a crease at the contact and at D
};

/// Light over the hemisphere of the high poly's points, for the maps ao, bent_normal and thickness.
struct OcclusionOptions {
  OcclusionBy by = OcclusionBy::
      rays;  ///< Way to gather; OcclusionBy::automatic takes what is expected to be quicker
  std::uint32_t views = 512;  ///< Directions of OcclusionBy::views, all around: 16 to 4096
  std::uint32_t rays = 64;    ///< A sample, 1 to 4096; spread by the cosine to the normal
  /// Distance within which something occludes; for thickness, the one that is white. Above 0. None given: for ao and
  /// bent_normal all that is there, for thickness a tenth of the diagonal.
  std::optional<Length> distance = {};
  /// For ao and bent_normal: what is near darkens more. Without a distance, D is the high poly's
  /// diagonal. A sample's rays differ in length: a hit at d is within reach of the share of rays that
  /// it darkens by. By rays alone: OcclusionBy::views is refused, OcclusionBy::automatic takes rays.
  OcclusionFalloff falloff = OcclusionFalloff::none;
  bool back_faces = true;  ///< Faces that look away from the point occlude, too
  // Occluders, for ao, bent_normal and shadow; at least one of them.
  bool by_high = true;  ///< The high poly
  bool by_low = false;  ///< The low poly
  /// Other meshes in the high poly's space, such as a ground or parts beside it; they outlive the bake.
  std::vector<const Mesh*> by_others = {};
  /// With MatchOptions::parts: of the high and low poly, a sample's own part alone occludes it. Other meshes do
  /// as without.
  bool own_part = false;
  /// Error bound of ambient occlusion, 0 to 1: the root mean square of the map's error. All texels begin with a quarter of
  /// `rays`. Noise is smoothed over the surface, across seams, as far as that loses nothing that the rays show;
  /// and where the error is still too large, more are cast, up to 4096 a sample. What was reached is measured
  /// against 4096 rays (BakeReport::errors) if below 1. 0: `rays` everywhere, nothing is smoothed.
  double max_error = 0;
};

/// The light of the map shadow: a disc at infinity.
struct ShadowLight {
  Vec3 direction = {0, 1, 0};  ///< Towards the light, object space; any length but 0
  double angle_degrees = 0;  ///< The disc's diameter as seen, 0 (a point) to 90; the sun's is 0.53
};

/// Pieces that the map id tells apart.
enum class IdBy {
  part,      ///< Connected parts of the high poly
  material,  ///< Mesh::materials
  group,     ///< Mesh::groups
  object,    ///< Mesh::objects
  color,     ///< Mesh::colors: at each point that of the nearest corner, as it is
};

/// Another map of a kind, with settings of its own: a second ao of what is near beside the first. What is not given is
/// as BakeOptions says for all maps.
struct MapVariant {
  std::string name = {};  ///< Name of this map alone: a letter, then letters, digits and _
  MapKind kind = {};      ///< One of maps(), whose values it holds
  std::optional<OcclusionOptions> occlusion =
      {};                                       ///< In place of BakeOptions::occlusion, all of it
  std::optional<Length> curvature_radius = {};  ///< In place of BakeOptions::curvature_radius
  std::optional<ShadowLight> light = {};        ///< In place of BakeOptions::light
  std::optional<IdBy> id_by = {};               ///< In place of BakeOptions::id_by
};

/// One colour of the map id.
struct IdEntry {
  std::string name = {};         ///< Name of the material, group or object; "part 0" and so on
  std::array<float, 3> color{};  ///< As the map holds it
  std::uint64_t triangles = 0;   ///< Triangles of the high poly
};

/// Report of the way light was gathered.
struct OcclusionReport {
  OcclusionBy by = OcclusionBy::rays;  ///< Way that was taken; never OcclusionBy::automatic
  std::uint32_t views = 0;             ///< Directions; 0: rays
  std::uint32_t view_size = 0;         ///< Pixels a side of each; 0: rays
};

/// The largest error that a map may have.
struct MapBound {
  MapKind kind = {};  ///< A map that is baked, but not of names, of coverage or of single texels
  /// Root mean square, in the map's unit. Unit vectors: degrees; colours: CIE 1976 differences;
  /// places and distances: world units; all else: shares of 1. Above 0.
  double max_error = 0;
};

/// Error that a map of a plan has reached: at some 2,000 points spread over the UVs. There a renderer
/// reads the map (bilinear); the high poly's own value has 4096 rays and the finest footprint.
struct MapReached {
  MapKind kind = {};                                ///< The map
  std::string_view unit = {};                       ///< Unit of both errors: "degrees", "ΔE"...
  double wanted = 0;                                ///< MapBound::max_error
  double error = 0;                                 ///< Root mean square
  std::uint32_t points = 0;                         ///< Compared
  bool reached() const { return error <= wanted; }  ///< It is within what was asked for
};

/// Error of a map against an independent, finer evaluation at some of its texels (ReportOptions::errors).
struct MapError {
  MapKind kind = MapKind::normal;  ///< The map
  std::string_view unit = {};  ///< Unit of the figures: "degrees", "world units", "1/255", "ΔE"...
  double rms = 0;              ///< Root of the mean square
  double mean = 0;             ///< Mean of the magnitudes
  double p95 = 0;              ///< 95% of the texels are not above
  double max = 0;              ///< The greatest
  std::uint32_t texels = 0;    ///< Compared, spread evenly over the baked texels
  std::string_view against = {};  ///< The finer evaluation, in words
};

/// Value of a sample for which no point of the high poly was found.
enum class MissPolicy {
  keep,  ///< The low poly's own interpolated normal (Wang et al., section 2)
  fill,  ///< Filled from neighbouring texels of the map, like the gutter
  mark,  ///< Magenta (1, 0, 1), to be seen
};

/// States of a texel in BakeResult::coverage.
enum class TexelState : std::uint8_t {
  empty = 0,    ///< Nothing: the map's background
  baked = 1,    ///< A point of the high poly was found for it
  missed = 2,   ///< The low poly covers it, but no point was found
  padding = 3,  ///< Filled from baked texels nearby
};

/// Meaning of a map's values, by which they are averaged, padded and encoded.
enum class MapType {
  unit_vector,    ///< Averaged as a direction; encoded as n/2 + 1/2 unless EncodingOptions::raw
  signed_scalar,  ///< One number of either sign
  scalar,         ///< One number of 0 or more
  vector,         ///< Numbers of either sign, each by itself
  color,          ///< Linear light: integer formats hold it sRGB-encoded (to_srgb())
  id,             ///< A colour that names something: never averaged, no mip chain
  coverage,       ///< About texels, not the high poly: no padding, no mip chain
};

/// Content of a map's texels where no point of the high poly was found.
enum class MissedTexels {
  low_poly,  ///< By MissPolicy: the low poly's own value, where that is kept
  neighbours,  ///< By MissPolicy; but the low poly has no such value, and neighbouring texels fill them
  zero,        ///< 0, whatever MissPolicy says: there is nothing there
};

/// A map that bake() can make.
struct MapInfo {
  MapKind kind = {};                    ///< Its name, for BakeOptions::maps and for file names
  std::uint32_t channels = 3;           ///< 1 to 4
  MapType type = MapType::unit_vector;  ///< Meaning of its values
  std::string_view holds = {};          ///< In words, with the unit
  /// Value that integer formats put at 0. Both 0: they depend on the high poly and the options; see
  /// BakedMap::ranges.
  float low = 0;
  float high = 1;  ///< Value that integer formats put at 1
  /// Options that it obeys and not every map does: their paths in BakeOptions, separated by blanks. "occlusion" stands for
  /// all that begin with "occlusion."; "match.visibility" is of maps that hold what such a match went by.
  std::string_view options = {};
  MissedTexels missed = MissedTexels::low_poly;  ///< Content of texels where nothing was found
  /// Normals of this space whatever EncodingOptions::space says, so that one bake has several. None: of that one.
  std::optional<NormalMapSpace> space = {};
  /// Names that other programs have for it, separated by blanks: messages answer to these names.
  std::string_view other_names = {};
};

/// Values of a channel that an integer format puts at 0 and at 1.
struct ValueRange {
  float low = 0;   ///< Value at 0
  float high = 1;  ///< Value at 1
};

/// A range of the caller's own, for all channels of a map.
struct MapRange {
  MapKind kind = {};      ///< A map that is baked, but not of unit vectors, names or coverage
  ValueRange range = {};  ///< Finite, low below high
};

/// One map of a bake.
struct BakedMap {
  MapKind kind = MapKind::normal;  ///< Kind of the map
  Image image = {};                ///< The map, padded and encoded
  /// With EncodingOptions::mips: levels 1 and on, down to 1 x 1; sides halve, rounded down. A texel
  /// holds the mean over the covered texels of level 0 under it, made unit. Of `color` beside `opacity` they count by
  /// their opacity. Only the chart that
  /// covers most of it counts. Encoded like the image. The gutter has the image's width in UV
  /// units, but 2 texels at least (none where it has none).
  std::vector<Image> mips = {};
  std::uint32_t cluster = 0;  ///< Which one of VisibilityOptions::clusters
  MapInfo info = {};          ///< Facts of the map, also where it is not one of maps()
  /// Maps of places, which obey EncodingOptions::origin: they are measured from here. See EncodingOptions::origin.
  std::array<double, 3> origin{};
  /// Range of each channel that integer formats hold: EncodingOptions::ranges, or the map's rule, which
  /// takes nothing of the picture. MapInfo::low and high; position: the bounding box of the high poly's used
  /// vertices; height, displacement, distance: how far the match looks (matches that do not: the high poly's
  /// diagonal); curvature and convexity: one over `curvature_radius`. Rounded outward.
  std::vector<ValueRange> ranges = {};
  std::vector<IdEntry> ids = {};  ///< The legend, of maps that obey BakeOptions::id_by
  std::optional<OcclusionReport> occlusion =
      {};                       ///< Way that light was gathered, for ao and bent_normal
  double curvature_radius = 0;  ///< As used, world units; 0 for maps that obey none
  /// Unit of its values, such as "world units"; empty for shares, colours and unit vectors. As long-lived as the program.
  std::string_view unit = {};
};

/// All maps, in the order that they are listed to people. Constant, and as long-lived as the program: any
/// thread may read them.
std::span<const MapInfo> maps();

/// One of maps(), by its name.
/// \throws Error(usage) for a name that no map has; the message lists those there are
const MapInfo& find_map(std::string_view name);

/// True if the values of a map depend on an option, such as "occlusion.rays", or on one of a group, such as "occlusion":
/// paths in BakeOptions. False for what all maps obey, such as "samples". Any thread may call it.
bool obeys(const MapInfo& map, std::string_view option);

/// Baked texels whose values lie beyond a map's range, which integer formats clamp.
struct RangeExcess {
  std::uint64_t texels = 0;  ///< Number of such texels
  float value = 0;           ///< The value that is farthest beyond
  float by = 0;              ///< Its distance from the range
  std::uint32_t x = 0;       ///< Column of its texel
  std::uint32_t y = 0;       ///< Row of its texel, from the top
};

/// Counts them. Unit vectors have none. Any thread may call it; nothing is kept.
/// \param coverage  BakeResult::coverage
RangeExcess beyond_range(const BakedMap& map, std::span<const std::uint8_t> coverage);

}  // namespace kiln
