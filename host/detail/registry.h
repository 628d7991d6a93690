// The registry of maps: each map is a file of this folder and a row here.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "detail/band_reads.h"
#include "detail/value_ranges.h"
#include "kiln/bake.h"
#include "kiln/map.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// A band's texels on the host, row by row: [rows * width * channels] values and [rows * width]
/// coverage.
struct BandPixels {
  std::span<float> values;
  /// 1 for baked texels, 2 for missed ones; texels that are not covered stay unchanged
  std::span<std::uint8_t> coverage;
};

/// What a map is made from; the same for all bands of a bake.
struct MapRequest {
  const Source::Impl& source;
  const LowSurface& surface;
  const BakeOptions& options;
  SharedWorks& shared;  ///< Results that several maps of the bake use
  /// Divisor of the size of a sample's footprint, for maps that read the surface at points: the
  /// footprint is a square whose side is (texel side / samples per side) / `footprint_divisor`.
  std::uint32_t footprint_divisor = 1;
  /// True if the map only serves to check another one of the same kind: it uses an independent
  /// method, if there is one.
  bool is_reference = false;

  /// Downloads of device arrays, shared by the makers of all maps.
  std::shared_ptr<BandReads> reads() const {
    return shared.of<BandReads>(std::ref(context_of(source.device)));
  }
};

/// Computes one map from the correspondences of bands.
class MapMaker {
 public:
  MapMaker() = default;
  MapMaker(const MapMaker&) = delete;
  MapMaker& operator=(const MapMaker&) = delete;
  virtual ~MapMaker() = default;

  /// Computes the texels of a band. Texels that are not covered stay unchanged.
  virtual void run(const TexelBand& band, const DeviceCorrespondence& match,
                   const BandPixels& out) = 0;

  /// Computes the texels of a band from two correspondences, whose values are blended.
  /// \param other   second correspondence; it has a triangle for the samples that are blended, and
  ///   none for the rest
  /// \param shares  [samples] weight of `match`, 0 to 1
  virtual void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                           const DeviceCorrespondence& other, const cl::Array<float>& shares,
                           const BandPixels& out) = 0;

  /// Called after the last band to add the map's statistics and warnings.
  virtual void report(BakedMap& map, std::vector<Warning>& warnings) const {
    static_cast<void>(map), static_cast<void>(warnings);
  }
};

/// A map of the registry.
struct MapRow {
  MapInfo info;
  /// True if renderers shade the low poly with this map: it holds unit normals in
  /// EncodingOptions::space. Plans measure the error of these normals.
  bool is_shading_normal = false;
  /// True if this map's values, in [0, 1], are the weights in the mip chains of maps that have
  /// `weighted` set. An example is opacity.
  bool weights = false;
  /// True if this map's mip chain is weighted by the map that has `weights` set, so that
  /// transparent texels do not contribute.
  bool weighted = false;
  /// True if the map reads positions or distances, so that it changes wherever vertices of the high
  /// poly move.
  bool follows_positions = false;
  /// True if the map reads more of the high poly than the matched points, so that any change of the
  /// mesh may change any texel.
  bool reads_around = false;
  /// True if the map reads nothing of the high poly but the matched triangles, or casts rays at all
  /// of it (Source::Impl::occluder_search()), so that the high poly may be larger than memory.
  bool supports_streaming = false;
  /// Unit of the values, such as "world units", if MapInfo does not give it.
  std::string_view unit = {};
  /// Range of a channel's values in integer formats; if unset, MapInfo::low and high apply to all
  /// channels.
  std::function<ValueRange(const RangeRequest& request, std::uint32_t channel)> range = {};
  /// Number of leading channels whose differences count as errors; 0: all channels. The remaining
  /// channels repeat these.
  std::uint32_t compared_channels = 0;
  /// True if the values depend on the size of texels, so that a larger map is not a better
  /// approximation of the same values.
  bool depends_on_texel_size = false;
  std::function<std::unique_ptr<MapMaker>(const MapRequest& request)> make;
};

std::span<const MapRow> map_rows();

/// \throws Error(usage) if no row has this name
const MapRow& map_row(MapKind kind);

/// Rows of the bake's maps that are not in the registry: transfers, variants and custom maps, in
/// the order of the options. Their names live as long as the program.
/// \throws Error(usage) for a name that is invalid or in use
std::vector<MapRow> own_rows(const BakeOptions& options);

/// Number of all requested maps: those of the registry, transfers, variants and custom maps.
inline std::size_t map_count(const BakeOptions& options) {
  return options.maps.size() + options.transfers.size() + options.own_maps.size() +
         options.variants.size();
}

/// Kinds of the requested maps, without transfers and custom maps. A variant counts as the map that
/// it is a variant of.
inline std::vector<MapKind> kinds_of(const BakeOptions& options) {
  std::vector<MapKind> kinds = options.maps;
  for (const MapVariant& map : options.variants) kinds.push_back(map.kind);
  return kinds;
}

/// The variant with a name; null if there is none.
template <typename Options>
auto find_variant(Options& options, std::string_view name) {
  for (auto& map : options.variants) {
    if (map.name == name) return &map;
  }
  return static_cast<decltype(options.variants.data())>(nullptr);
}

/// Requests these maps and no others.
inline void request_only(BakeOptions& options, std::vector<MapKind> maps) {
  options.maps = std::move(maps);
  options.transfers.clear();
  options.own_maps.clear();
  options.variants.clear();
}

/// Applies a change to the occlusion options of the bake and of each variant.
template <typename Change>
void change_occlusion(BakeOptions& options, const Change& change) {
  change(options.occlusion);
  for (MapVariant& variant : options.variants) {
    if (variant.occlusion) change(*variant.occlusion);
  }
}

/// The options of the bake after a variant has replaced some of them.
BakeOptions options_of(const MapVariant& variant, BakeOptions options);

/// The error bounds of occlusion (OcclusionOptions::max_error, if above 0) of the bake's maps and variants that obey
/// them.
std::vector<double> occlusion_error_bounds(const BakeOptions& options);

/// True if samples that missed do not contribute to their texel; the texel's other samples or its
/// neighbours replace them.
inline bool leaves_out_misses(const MapInfo& map, MissPolicy policy) {
  return map.missed == MissedTexels::neighbours ||
         (map.missed == MissedTexels::low_poly && policy != MissPolicy::keep);
}

/// Range of each channel: the caller's (EncodingOptions::ranges) if given, otherwise the default of the map's row.
std::vector<ValueRange> ranges_of(const MapRow& row, const RangeRequest& request);

/// The first of a bake's maps with which renderers shade (MapRow::is_shading_normal); null if there is none.
std::optional<MapKind> shading_map(const BakeOptions& options);

/// Space of a map's directions.
NormalMapSpace space_of(const MapInfo& map, const BakeOptions& options);

/// Origin of the map `position`: EncodingOptions::origin, or its default.
std::array<double, 3> map_origin(const BakeOptions& options, const Frame& frame);

/// Value of texels outside of charts and padding.
/// \returns as many numbers as the map has channels
std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options);

/// Converts a texel's value to the value that the map stores; the last step of a bake.
/// \param coverage  coverage of the texel
void encode_texel(const MapInfo& map, const BakeOptions& options, std::uint8_t coverage,
                  float* pixel);

// The rows of the registry. The file of each map defines its row.
MapRow normal_map();
MapRow normal_object_map();
MapRow normal_face_map();
MapRow color_map();
MapRow vertex_color_map();
MapRow opacity_map();
MapRow ao_map();
MapRow bent_normal_map();
MapRow thickness_map();
MapRow shadow_map();
MapRow mask_map();
MapRow height_map();
MapRow position_map();
MapRow id_map();
MapRow slope_map();
MapRow curvature_map();
MapRow convexity_map();
MapRow displacement_map();
MapRow distance_map();
MapRow provenance_map();
MapRow uv_map();
MapRow wireframe_map();
MapRow visibility_map();
MapRow deviation_map();

}  // namespace kiln
