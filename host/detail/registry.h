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

/// A band's texels on the host, row by row: [rows * width * channels] and [rows * width].
struct BandPixels {
  std::span<float> values;
  /// 1 for baked texels, 2 for missed ones; texels that are not covered stay unchanged
  std::span<std::uint8_t> coverage;
};

/// Input for making a map, once a bake.
struct MapRequest {
  const Source::Impl& source;
  const LowSurface& surface;
  const BakeOptions& options;
  SharedWorks& shared;  ///< Results that all maps of the bake share
  /// Divisor of a sample's footprint: for maps that read the surface at points, the side of a sample's square is its
  /// share of a texel divided by this.
  std::uint32_t finer = 1;
  /// True if the map is made to check another one of the same kind: it uses an independent method, if it has one.
  bool checks = false;

  /// Downloads of device arrays that all makers share.
  std::shared_ptr<BandReads> reads() const {
    return shared.of<BandReads>(std::ref(context_of(source.device)));
  }
};

/// Computes one map at the correspondences of bands.
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
  /// \param other   has triangles for the samples that are blended, and none for the rest
  /// \param shares  [samples] weight of `match`, 0 to 1
  virtual void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                           const DeviceCorrespondence& other, const cl::Array<float>& shares,
                           const BandPixels& out) = 0;

  /// Called after the last band: adds the map's statistics and warnings to the result.
  virtual void report(BakedMap& map, std::vector<Warning>& warnings) const {
    static_cast<void>(map), static_cast<void>(warnings);
  }
};

/// A map of the registry.
struct MapRow {
  MapInfo info;
  /// Renderers shade the low poly with this map: unit normals in EncodingOptions::space. Plans measure the error of
  /// these normals.
  bool shades = false;
  /// This map's values in [0, 1] are the weights in mip chains of the maps with `weighted`, as opacity's are.
  bool weights = false;
  /// Mip chains are weighted by the map with `weights`: transparent texels do not contribute.
  bool weighted = false;
  /// The map reads positions or distances, so it changes wherever vertices of the high poly move.
  bool follows_positions = false;
  /// The map reads more of the high poly than the matched points, so any change of the mesh may change any texel.
  bool reads_around = false;
  /// The map reads nothing of the high poly but its matched triangles, so the high poly may be larger than memory.
  bool streams = false;
  /// Unit of its values, such as "world units", if MapInfo has none.
  std::string_view unit = {};
  /// Range of each channel for integer formats; if unset, it is MapInfo::low and high for all channels.
  std::function<ValueRange(const RangeRequest& request, std::uint32_t channel)> range = {};
  /// Number of leading channels whose differences count as errors; 0: all. The remaining channels are redundant.
  std::uint32_t compared_channels = 0;
  /// The map's values depend on the size of texels, so a larger map is not closer to the surface.
  bool of_texels = false;
  std::function<std::unique_ptr<MapMaker>(const MapRequest& request)> make;
};

std::span<const MapRow> map_rows();

/// \throws Error(usage) for a name that no row has
const MapRow& map_row(MapKind kind);

/// Rows of the maps beside the registry's: transfers, variants and custom maps, in the options' order. Their
/// names live as long as the program.
/// \throws Error(usage) for a name that is invalid or in use
std::vector<MapRow> own_rows(const BakeOptions& options);

/// Number of all requested maps: the registry's, transfers, variants and custom maps.
inline std::size_t map_count(const BakeOptions& options) {
  return options.maps.size() + options.transfers.size() + options.own_maps.size() +
         options.variants.size();
}

/// Kinds of the requested maps that are in the registry; a variant counts as its kind.
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
inline void ask_for(BakeOptions& options, std::vector<MapKind> maps) {
  options.maps = std::move(maps);
  options.transfers.clear();
  options.own_maps.clear();
  options.variants.clear();
}

/// Changes the occlusion options of the bake and of each variant.
template <typename Change>
void change_occlusion(BakeOptions& options, const Change& change) {
  change(options.occlusion);
  for (MapVariant& variant : options.variants) {
    if (variant.occlusion) change(*variant.occlusion);
  }
}

/// The options of the bake, with the changes of a variant.
BakeOptions options_of(const MapVariant& variant, BakeOptions options);

/// True if samples without a point do not contribute to a texel: its other samples or its neighbours fill it.
inline bool leaves_out_misses(const MapInfo& map, MissPolicy policy) {
  return map.missed == MissedTexels::neighbours ||
         (map.missed == MissedTexels::low_poly && policy != MissPolicy::keep);
}

/// Range of each channel: the caller's (EncodingOptions::ranges), or by the row's rule.
std::vector<ValueRange> ranges_of(const MapRow& row, const RangeRequest& request);

/// The first of a bake's maps with MapRow::shades, if there is one.
std::optional<MapKind> shading_map(const BakeOptions& options);

/// Space that a map's directions are stored in.
NormalMapSpace space_of(const MapInfo& map, const BakeOptions& options);

/// Origin of position maps: EncodingOptions::origin.
std::array<double, 3> map_origin(const BakeOptions& options, const Frame& frame);

/// Value of texels outside of charts and padding. \returns as many numbers as there are channels
std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options);

/// Encodes a texel's value as the map stores it; the last step of a bake. \param coverage  of the texel
void encode_texel(const MapInfo& map, const BakeOptions& options, std::uint8_t coverage,
                  float* pixel);

// Rows of the registry; each is defined in the file of its map.
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
