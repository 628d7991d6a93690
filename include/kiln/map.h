#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// A user-defined map: a function of the matched point in OpenCL C 1.2, run once per sample.
///
/// It is a program with the caller's rights: native code within this process, which may write anywhere in its memory
/// and crash it. Files of meshes and materials cannot specify one, so the caller decides which source to trust.
///
/// The source defines `float4 kiln_map(const kiln_point* point)`; kernels/detail/own.clh documents the point and the
/// ray caster. It may define further functions, but has no includes. Its results are averaged over a texel's samples,
/// component by component. It is not called for misses: those texels are filled from their neighbours, or marked. Its
/// positions are relative to BakedMap::origin. Strings are copied; several threads may bake with one OwnMap.
struct OwnMap {
  std::string name = "own";    ///< Name of the map: a letter, then letters, digits and _
  std::string source = {};     ///< OpenCL C
  std::string file = {};       ///< File name in messages of the OpenCL compiler
  std::uint32_t channels = 3;  ///< 1, 3 or 4: number of components of the result that are stored
};

/// A map, identified by its name, so that maps can be added without a change here.
struct MapKind {
  std::string_view name = {};  ///< Name as in `--maps` and file names; has static lifetime
  constexpr MapKind() = default;
  /// The map with a name, such as {"ao"}. The name is copied once and stored for the program's
  /// lifetime.
  constexpr MapKind(const char* text)
      : name(std::is_constant_evaluated() ? std::string_view(text)
                                          : MapKind(std::string_view(text)).name) {}
  explicit MapKind(std::string_view text);  ///< Like the constructor above, for any text
  friend constexpr bool operator==(MapKind, MapKind) = default;

  static const MapKind normal;  ///< Unit normal of the high poly, in `EncodingOptions::space`
  static const MapKind mask;    ///< 1 channel: 1 where a texel was baked, 0 elsewhere
};
inline constexpr MapKind MapKind::normal{"normal"};
inline constexpr MapKind MapKind::mask{"mask"};

/// Axes of a normal's components: the low poly's tangent frame (MikkTSpace, or Mesh::tangents), the axes of object
/// space, or a frame of the low poly's face.
enum class NormalMapSpace { tangent, object, face };

/// Where the third axis of tangent space is computed; must match the shader that uses the map.
enum class Bitangent {
  /// Computed per pixel from the interpolated normal and tangent, as in MikkTSpace, Blender and
  /// Unreal Engine
  pixel,
  /// Computed at the corners and interpolated, as in Unity and in shaders with a bitangent per
  /// vertex
  vertex,
};

/// Ways to gather ambient light at the high poly's points.
enum class OcclusionBy {
  rays,  ///< Rays over the hemisphere of each sample
  /// Depth views of the occluders from all around: each sample is tested against the depth in every view. Applicable to
  /// the maps ao and bent_normal if no distance or falloff is set and faces occlude from both sides
  views,
  /// Views (two per requested ray) if they are applicable and expected to be faster; else rays. Always rays if more
  /// than 64 are requested, since views would be less accurate
  automatic,
};

/// Weight of a ray's first hit in occlusion, as a function of x = d / D, where d is the hit's distance from the point
/// and D is OcclusionOptions::distance. Hits at D or beyond do not occlude.
enum class OcclusionFalloff {
  none,    ///< The weight is 1 at every distance below D
  linear,  ///< The weight is 1 - x
  smooth,  ///< The weight is 1 - x^2 (3 - 2 x), whose slope is 0 at distances 0 and D
};

/// Ambient light over the hemisphere at the high poly's points, for the maps ao, bent_normal and
/// thickness.
struct OcclusionOptions {
  /// Method of gathering; OcclusionBy::automatic chooses the faster one
  OcclusionBy by = OcclusionBy::rays;
  /// Number of directions of OcclusionBy::views, all around: 16 to 4096
  std::uint32_t views = 512;
  std::uint32_t rays = 64;  ///< Rays per sample, 1 to 4096; cosine-weighted around the normal
  /// Largest distance of occluders; for thickness, the distance that maps to white. Above 0. None given: unlimited
  /// for ao and bent_normal, 10% of the diagonal for thickness.
  std::optional<Length> distance = {};
  /// For ao and bent_normal: near occluders darken more. If no distance is given, D is the high poly's diagonal. The
  /// rays of a sample have different lengths, chosen so that the share of rays that reach a hit at distance d equals
  /// the hit's weight. Only for rays: OcclusionBy::views is refused, OcclusionBy::automatic chooses rays.
  OcclusionFalloff falloff = OcclusionFalloff::none;
  bool back_faces = true;  ///< Faces that point away from the point occlude, too
  // Occluders in the maps ao, bent_normal and shadow: the high poly, the low poly and other meshes;
  // at least one of them must be set.
  bool by_high = true;  ///< The high poly occludes
  bool by_low = false;  ///< True: the low poly occludes
  /// Other meshes that occlude, in the high poly's space, such as a ground or neighbouring parts;
  /// they must outlive the bake.
  std::vector<const Mesh*> by_others = {};
  /// With MatchOptions::parts: only the sample's own part of the high and low poly occludes the sample. Other
  /// meshes are not affected.
  bool own_part = false;
  /// Error bound of ambient occlusion, 0 to 1: the root mean square of the map's error. All texels start with a quarter
  /// of `rays`. Noise is smoothed over the surface, across seams, unless that would blur detail which the rays resolve;
  /// where the error is still too large, more rays are cast, up to 4096 per sample. If the bound is below 1, the result
  /// is measured against 4096 rays (BakeReport::errors). 0: `rays` everywhere, no smoothing.
  double max_error = 0;
};

/// The light of the map shadow: a disc at infinity.
struct ShadowLight {
  Vec3 direction = {0, 1, 0};  ///< Towards the light, object space; any length above 0
  double angle_degrees = 0;  ///< Angular diameter of the disc, 0 (a point) to 90; the sun's is 0.53
};

/// Pieces to which the map id assigns colours.
enum class IdBy {
  part,      ///< Colours identify connected parts of the high poly
  material,  ///< Colours identify materials (Mesh::materials)
  group,     ///< Colours identify groups (Mesh::groups)
  object,    ///< Colours identify objects (Mesh::objects)
  /// Colours of vertices (Mesh::colors): each point gets the colour of the nearest corner,
  /// unchanged
  color,
};

/// Another map of a kind with its own settings, such as a second ao of near occluders. Settings that are not given are
/// those of BakeOptions.
struct MapVariant {
  std::string name = {};  ///< Unique name of the map: a letter, then letters, digits and _
  MapKind kind = {};      ///< One of maps(): the kind of values
  std::optional<OcclusionOptions> occlusion = {};  ///< Replaces BakeOptions::occlusion as a whole
  std::optional<Length> curvature_radius = {};     ///< Replaces BakeOptions::curvature_radius
  std::optional<ShadowLight> light = {};           ///< Replaces BakeOptions::light
  std::optional<IdBy> id_by = {};                  ///< Replaces BakeOptions::id_by
};

/// One colour of the map id.
struct IdEntry {
  std::string name = {};         ///< Name of the material, group or object; "part 0" and so on
  std::array<float, 3> color{};  ///< Colour in the map id, in [0, 1]
  std::uint64_t triangles = 0;   ///< Number of triangles of the high poly
};

/// Report of how ambient light was gathered.
struct OcclusionReport {
  OcclusionBy by = OcclusionBy::rays;  ///< The method in use, never OcclusionBy::automatic
  std::uint32_t views = 0;             ///< Number of depth views; 0 with rays
  std::uint32_t view_size = 0;         ///< Pixels a side of each view; 0 with rays
};

/// Bound of a map's error.
struct MapBound {
  MapKind kind =
      {};  ///< A baked map whose values are not labels, coverage or lines (id, mask, wireframe)
  /// Bound of the root mean square error, above 0, in the map's unit: degrees for unit vectors, CIE
  /// 1976 differences for colours, world units for positions and distances, shares of 1 for all
  /// others.
  double max_error = 0;
};

/// Error of a planned map, at about 2,000 points spread over the UVs: the map as a renderer reads it
/// (bilinear) against the high poly's own value, computed with 4096 rays and the finest footprint.
struct MapReached {
  MapKind kind = {};           ///< The map
  std::string_view unit = {};  ///< Unit of both errors: "degrees", "ΔE"...
  double wanted = 0;           ///< Error bound: MapBound::max_error
  double error = 0;            ///< Root mean square of the error
  std::uint32_t points = 0;    ///< Number of points at which map and high poly were compared
  bool reached() const { return error <= wanted; }  ///< True if the error is within the bound
};

/// Error of a map against an independent, finer evaluation at some of its texels (ReportOptions::errors).
struct MapError {
  MapKind kind = MapKind::normal;  ///< The map
  std::string_view unit = {};  ///< Unit of the errors: "degrees", "world units", "1/255", "ΔE"...
  double rms = 0;              ///< Root mean square of the error
  double mean = 0;             ///< Mean magnitude of the error
  double p95 = 0;              ///< Error that 95% of the texels do not exceed
  double max = 0;              ///< Largest error
  std::uint32_t texels = 0;    ///< Number of compared texels, spread evenly over the baked ones
  std::string_view reference = {};  ///< Description of the reference evaluation
};

/// Value of a missed sample.
enum class MissPolicy {
  keep,  ///< The low poly's own interpolated normal (Wang et al., section 2)
  fill,  ///< Filled from neighbouring texels of the map, like the padding
  mark,  ///< Magenta (1, 0, 1), to be visible
};

/// States of a texel in BakeResult::coverage.
enum class TexelState : std::uint8_t {
  empty = 0,    ///< The texel shows the background
  baked = 1,    ///< A point of the high poly was found
  missed = 2,   ///< The low poly covers the texel, but no point of the high poly was found
  padding = 3,  ///< The texel is filled from nearby baked texels
};

/// Meaning of a map's values, which decides how they are averaged, padded and encoded.
enum class MapType {
  /// A direction: averages are normalised; encoded as n/2 + 1/2 unless EncodingOptions::raw is set
  unit_vector,
  signed_scalar,  ///< A signed number
  scalar,         ///< A number of 0 or more
  vector,         ///< A vector of independent signed components
  color,          ///< A colour in linear light; integer formats store it sRGB-encoded (to_srgb())
  id,             ///< A colour that identifies an element: never averaged, without a mip chain
  /// Values describe texels of the map, not the high poly, so the map gets no padding and no mip chain
  coverage,
};

/// Content of a map at missed texels.
enum class MissedTexels {
  low_poly,  ///< MissPolicy decides; with MissPolicy::keep the low poly's own value is stored
  /// MissPolicy decides; with MissPolicy::keep the value comes from neighbouring texels, since the
  /// low poly has no such value
  neighbours,
  zero,  ///< Missed texels are 0, regardless of MissPolicy
};

/// A map that bake() can make.
struct MapInfo {
  MapKind kind = {};           ///< Name of the map, for BakeOptions::maps and for file names
  std::uint32_t channels = 3;  ///< 1 to 4
  MapType type = MapType::unit_vector;  ///< Meaning of its values
  std::string_view description = {};    ///< What the values are, with their unit
  /// Value that integer formats store as 0. If low and high are both 0, the range depends on the
  /// high poly and the options; see BakedMap::ranges.
  float low = 0;
  float high = 1;  ///< Value that integer formats store as 1
  /// Options that affect this map but not all maps: their paths in BakeOptions, separated by blanks. "occlusion"
  /// stands for all that begin with "occlusion."; "match.visibility" is listed by maps that show
  /// the directions of a visibility match.
  std::string_view options = {};
  MissedTexels missed = MissedTexels::low_poly;  ///< What missed texels hold
  /// Space of the map's normals, regardless of EncodingOptions::space, so that one bake can make maps in
  /// several spaces. None: EncodingOptions::space.
  std::optional<NormalMapSpace> space = {};
  /// Names of the map in other programs, separated by blanks, for hints in messages.
  std::string_view other_names = {};
};

/// Values that an integer format stores as 0 and 1.
struct ValueRange {
  float low = 0;   ///< Value stored as 0
  float high = 1;  ///< Value stored as 1
};

/// A user-defined range for all channels of a map.
struct MapRange {
  MapKind kind = {};      ///< A baked map whose values are not unit vectors, labels or coverage
  ValueRange range = {};  ///< The range: finite, low < high
};

/// One map of a bake.
struct BakedMap {
  MapKind kind = MapKind::normal;  ///< Kind of the map
  Image image = {};                ///< The map, padded and encoded
  /// With EncodingOptions::mips: levels 1 and on, down to 1 x 1; sides halve, rounded down. A texel is the mean of
  /// the covered texels of level 0 below it, normalised for unit vectors; only the chart that covers most of it
  /// contributes. If `opacity` is baked, texels of `color` are weighted by it. Encoded like the image. The padding
  /// has the image's width in UV units, at least 2 texels (none if the image has none).
  std::vector<Image> mips = {};
  std::uint32_t cluster = 0;  ///< Index of the visibility cluster, see VisibilityOptions::clusters
  MapInfo info = {};          ///< Properties of the map, also of maps that are not in maps()
  /// Origin of positions in the map; set for maps that depend on EncodingOptions::origin.
  std::array<double, 3> origin{};
  /// Range of each channel that integer formats store: that of EncodingOptions::ranges, or that of the map's
  /// rule, which does not depend on the baked values: MapInfo::low and high; for position the bounding box
  /// of the high poly's used vertices; for height, displacement and distance the search distance (for
  /// matches without one the high poly's diagonal); for curvature and convexity one over `curvature_radius`.
  /// Rounded outward.
  std::vector<ValueRange> ranges = {};
  std::vector<IdEntry> ids = {};  ///< The legend, for maps that depend on BakeOptions::id_by
  std::optional<OcclusionReport> occlusion =
      {};                       ///< How ambient light was gathered, for ao and bent_normal
  double curvature_radius = 0;  ///< Radius in effect, world units; 0 for maps without a radius
  /// Unit of its values, such as "world units"; empty for shares, colours and unit vectors. Static lifetime.
  std::string_view unit = {};
  /// True if the values are those that integer formats store, after to_stored(); false: as baked, colours in linear light
  bool stored = false;
};

enum class ImageFormat;

/// Converts a map and its mip-maps, in place, to the values that a format stores: colours are sRGB-encoded, and channels
/// with a range are scaled from BakedMap::ranges to [0, 1]. Formats of floats (exr_half, exr_float, tiff_float) store
/// values as they are. Sets BakedMap::stored, and has no effect on a map that has it set. Several threads may call it
/// for different maps.
void to_stored(BakedMap& map, ImageFormat format);

/// All maps, in the order in which users see them. Constant, with static lifetime: any thread may read
/// them.
std::span<const MapInfo> maps();

/// Finds a map by its name.
/// \throws Error(usage) for an unknown name; the message lists the known ones
const MapInfo& find_map(std::string_view name);

/// True if a map depends on an option, such as "occlusion.rays", or on any option of a group, such as "occlusion".
/// Options are named by their paths in BakeOptions. False for options that affect all maps, such as "samples". Any
/// thread may call it.
bool obeys(const MapInfo& map, std::string_view option);

/// Baked texels whose values exceed a map's range, so that integer formats clamp them.
struct RangeExcess {
  std::uint64_t texels = 0;  ///< Number of texels with a value out of the range
  float value = 0;           ///< The value that is farthest out of the range
  float distance = 0;        ///< Distance of `value` from the range
  std::uint32_t x = 0;       ///< Column of the texel with `value`
  std::uint32_t y = 0;       ///< Row of the texel with `value`, from the top
};

/// Counts texels out of range. Unit vectors have none. Any thread may call it; no argument is kept.
/// \param coverage  BakeResult::coverage
RangeExcess beyond_range(const BakedMap& map, std::span<const std::uint8_t> coverage);

}  // namespace kiln
