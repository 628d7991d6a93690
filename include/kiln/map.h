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
/// The source defines `float4 kiln_map(const kiln_point* point)`; kernels/detail/own.clh documents the point and
/// the ray caster. It may define further functions, and includes nothing. What it returns is averaged over a
/// texel's samples, number by number. Where nothing was found it is not called: those texels are filled from
/// their neighbours, or marked. Its places are measured from BakedMap::origin. Strings are copied; one OwnMap may serve bakes on several threads.
struct OwnMap {
  std::string name = "own";    ///< Of the map: a letter, then letters, digits and _
  std::string source = {};     ///< OpenCL C
  std::string file = {};       ///< The source's name in the messages of its build
  std::uint32_t channels = 3;  ///< 1, 3 or 4 of the numbers returned are kept
};

/// Which detail a map holds: the name of a map, so that maps can be added without a change here.
struct MapKind {
  std::string_view name;  ///< As in `--maps` and file names; lives as long as the program
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

/// What the components of a normal are along: the low poly's tangent frame (MikkTSpace, or Mesh::tangents), the axes of object
/// space, or a frame of the low poly's face.
enum class NormalMapSpace { tangent, object, face };

/// Where the third axis of tangent space is computed. It must be where the shader does that shows the map.
enum class Bitangent {
  pixel,  ///< From the interpolated normal and tangent: MikkTSpace's own way, Blender, Unreal Engine
  vertex,  ///< At the corners, and interpolated: Unity's way, and shaders with a bitangent a vertex
};

/// How light around the high poly's points is gathered.
enum class OcclusionBy {
  rays,   ///< Rays over the hemisphere of each sample
  views,  ///< Depth views of all that occludes, from all around; each sample looks into every one. For the maps
  ///< ao and bent_normal, without a distance or falloff, and with faces that occlude from both sides
  automatic,  ///< Two views a ray, where views serve and are expected to take less time; else rays. Beyond 64 rays
              ///< views come less near than rays do
};

/// How much a ray's first hit darkens, by x = d / D: its distance d from the point over
/// OcclusionOptions::distance D. A hit at D or beyond darkens nothing.
enum class OcclusionFalloff {
  none,    ///< 1: all alike
  linear,  ///< 1 - x
  smooth,  ///< 1 - x^2 (3 - 2 x): without a crease at the contact and at D
};

/// Light over the hemisphere of the high poly's points, for the maps ao, bent_normal and thickness.
struct OcclusionOptions {
  OcclusionBy by =
      OcclusionBy::rays;      ///< How; OcclusionBy::automatic takes what is expected to be quicker
  std::uint32_t views = 512;  ///< Directions of OcclusionBy::views, all around: 16 to 4096
  std::uint32_t rays = 64;    ///< A sample, 1 to 4096; spread by the cosine to the normal
  /// How far something occludes; for thickness what is as thick as white. Above 0. None given: for ao and
  /// bent_normal all that is there, for thickness a tenth of the diagonal.
  std::optional<Length> distance = {};
  /// For ao and bent_normal: what is near darkens more. Without a distance, D is the high poly's
  /// diagonal. A sample's rays differ in length: a hit at d is within reach of the share of rays that
  /// it darkens by. By rays alone: OcclusionBy::views is refused, OcclusionBy::automatic takes rays.
  OcclusionFalloff falloff = OcclusionFalloff::none;
  bool back_faces = true;  ///< Faces that look away from the point occlude, too
  // What occludes, for ao, bent_normal and shadow; at least one of them.
  bool by_high = true;  ///< The high poly
  bool by_low = false;  ///< The low poly
  /// Other meshes in the high poly's space, such as a ground or parts beside it; they outlive the bake.
  std::vector<const Mesh*> by_others = {};
  /// With MatchOptions::parts: of the high and low poly, a sample's own part alone occludes it. Other meshes do
  /// as without.
  bool own_part = false;
  /// Of ambient occlusion, 0 to 1: the root mean square of the map's error. All texels begin with a quarter of
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

/// What the map id tells apart.
enum class IdBy {
  part,      ///< Connected parts of the high poly
  material,  ///< Mesh::materials
  group,     ///< Mesh::groups
  object,    ///< Mesh::objects
};

/// Another map of a kind, with settings of its own: a second ao of what is near beside the first. What is not given is
/// as BakeOptions says for all maps.
struct MapVariant {
  std::string name;   ///< Of this map alone: a letter, then letters, digits and _
  MapKind kind = {};  ///< One of maps(), whose values it holds
  std::optional<OcclusionOptions> occlusion =
      {};                                       ///< In place of BakeOptions::occlusion, all of it
  std::optional<Length> curvature_radius = {};  ///< In place of BakeOptions::curvature_radius
  std::optional<ShadowLight> light = {};        ///< In place of BakeOptions::light
  std::optional<IdBy> id_by = {};               ///< In place of BakeOptions::id_by
};

/// One colour of the map id.
struct IdEntry {
  std::string name;              ///< Of the material, group or object; "part 0" and so on
  std::array<float, 3> color{};  ///< As the map holds it
  std::uint64_t triangles = 0;   ///< Of the high poly
};

/// What gathered the light (OcclusionBy).
struct OcclusionReport {
  OcclusionBy by = OcclusionBy::rays;  ///< What gathered it; never OcclusionBy::automatic
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

/// What a map that a plan bakes has reached: at some 2,000 points spread over the UVs. There a renderer
/// reads the map (bilinear); the high poly's own value has 4096 rays and the finest footprint.
struct MapReached {
  MapKind kind = {};                                ///< The map
  std::string_view unit;                            ///< Of both errors: "degrees", "ΔE"...
  double wanted = 0;                                ///< MapBound::max_error
  double error = 0;                                 ///< Root mean square
  std::uint32_t points = 0;                         ///< Compared
  bool reached() const { return error <= wanted; }  ///< It is within what was asked for
};

/// How far a map is from an independent, finer evaluation at some of its texels (ReportOptions::errors).
struct MapError {
  MapKind kind = MapKind::normal;  ///< The map
  std::string_view unit;           ///< Of the figures: "degrees", "world units", "1/255", "ΔE"...
  double rms = 0;                  ///< Root of the mean square
  double mean = 0;                 ///< Of the magnitudes
  double p95 = 0;                  ///< 95% of the texels are not above
  double max = 0;                  ///< The greatest
  std::uint32_t texels = 0;        ///< Compared, spread evenly over the baked texels
  std::string_view against;        ///< What they were compared with, in words
};

/// What a sample gets for which no point of the high poly was found.
enum class MissPolicy {
  keep,  ///< The low poly's own interpolated normal (Wang et al., section 2)
  fill,  ///< Filled from neighbouring texels of the map, like the gutter
  mark,  ///< Magenta (1, 0, 1), to be seen
};

/// What BakeResult::coverage says of a texel.
enum class TexelState : std::uint8_t {
  empty = 0,    ///< Nothing: the map's background
  baked = 1,    ///< A point of the high poly was found for it
  missed = 2,   ///< The low poly covers it, but no point was found
  padding = 3,  ///< Filled from baked texels nearby
};

/// What the values of a map are, and so how they are averaged, padded and encoded.
enum class MapType {
  unit_vector,    ///< Averaged as a direction; encoded as n/2 + 1/2 unless EncodingOptions::raw
  signed_scalar,  ///< One number of either sign
  scalar,         ///< One number of 0 or more
  vector,         ///< Numbers of either sign, each by itself
  id,             ///< A colour that names something: never averaged, no mip chain
  coverage,       ///< About texels, not the high poly: no padding, no mip chain
};

/// A map that bake() can make.
struct MapInfo {
  MapKind kind = {};                    ///< Its name, for BakeOptions::maps and for file names
  std::uint32_t channels = 3;           ///< 1 to 4
  MapType type = MapType::unit_vector;  ///< What its values are
  std::string_view holds;               ///< In words, with the unit
  /// Value that integer formats put at 0. Both 0: they depend on the high poly and the options; see
  /// BakedMap::ranges.
  float low = 0;
  float high = 1;  ///< Value that integer formats put at 1
  /// It holds what a match by visibility went by: MatchOptions::method must take VisibilityOptions.
  bool needs_visibility = false;
  bool takes_rays = false;       ///< It obeys OcclusionOptions, but for back_faces
  bool takes_max_error = false;  ///< It obeys OcclusionOptions::max_error
  bool takes_back_faces =
      false;  ///< It obeys OcclusionOptions::back_faces, by_high, by_low and by_others
  bool takes_views =
      false;  ///< It obeys OcclusionOptions::by and views; others of rays are of rays always
  bool takes_falloff = false;           ///< It obeys OcclusionOptions::falloff
  bool takes_curvature_radius = false;  ///< It obeys BakeOptions::curvature_radius
  bool takes_light = false;             ///< It obeys BakeOptions::light
  bool takes_id_by = false;             ///< It obeys BakeOptions::id_by
  bool takes_origin = false;            ///< Its values are places, measured from BakedMap::origin
  /// The low poly has no such value: where nothing was found, MissPolicy::keep fills from neighbouring texels.
  bool fills_misses = false;
  /// 0 is its value where nothing was found, whatever MissPolicy says: there is nothing there.
  bool misses_are_zero = false;
  /// Renderers shade the low poly by it: unit normals in EncodingOptions::space. Plans measure what it shows.
  bool shades = false;
  /// Its values are colours in linear light: integer formats hold them sRGB-encoded (to_srgb()).
  bool is_color = false;
  /// Normals of this space whatever EncodingOptions::space says, so that one bake has several. None: of that one.
  std::optional<NormalMapSpace> space = {};
  bool takes_color = false;    ///< It holds BakeOptions::color
  bool takes_opacity = false;  ///< It holds BakeOptions::opacity
  /// What other programs call it, separated by blanks: messages answer to these names.
  std::string_view other_names = {};
};

/// Values of a channel that an integer format puts at 0 and at 1.
struct ValueRange {
  float low = 0;   ///< Value at 0
  float high = 1;  ///< Value at 1
};

/// A range of the caller's own, for all channels of a map.
struct MapRange {
  MapKind kind = {};      ///< Of a map that is baked, but not of unit vectors, names or coverage
  ValueRange range = {};  ///< Finite, low below high
};

/// One map of a bake.
struct BakedMap {
  MapKind kind = MapKind::normal;  ///< What it holds
  Image image;                     ///< The map, padded and encoded
  /// With EncodingOptions::mips: levels 1 and on, down to 1 x 1; sides halve, rounded down. A texel
  /// holds the mean over the covered texels of level 0 under it, made unit. Only the chart that
  /// covers most of it counts. Encoded like the image. The gutter has the image's width in UV
  /// units, but 2 texels at least (none where it has none).
  std::vector<Image> mips;
  std::uint32_t cluster = 0;  ///< Which one of VisibilityOptions::clusters
  MapInfo info = {};          ///< What there is to say of it, also where it is not one of maps()
  /// Maps of places (MapInfo::takes_origin): they are measured from here. See EncodingOptions::origin.
  std::array<double, 3> origin{};
  /// Of each channel, where integer formats put its values: EncodingOptions::ranges, or the map's rule, which
  /// takes nothing of the picture. MapInfo::low and high; position: the bounding box of the high poly's used
  /// vertices; height, displacement, distance: how far the match looks (matches that do not: the high poly's
  /// diagonal); curvature and convexity: one over `curvature_radius`. Rounded outward.
  std::vector<ValueRange> ranges = {};
  std::vector<IdEntry> ids = {};  ///< The legend, of maps that obey BakeOptions::id_by
  std::optional<OcclusionReport> occlusion =
      {};                       ///< What gathered the light, of ao and bent_normal
  double curvature_radius = 0;  ///< As used, world units; 0 for maps that obey none
  /// Of its values, such as "world units"; empty for shares, colours and unit vectors. As long-lived as the program.
  std::string_view unit = {};
};

/// All maps, in the order that they are listed to people. Constant, and as long-lived as the program: any
/// thread may read them.
std::span<const MapInfo> maps();

/// One of maps(), by its name.
/// \throws Error(usage) for a name that no map has; the message lists those there are
const MapInfo& find_map(std::string_view name);

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
