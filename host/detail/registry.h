// The maps there are: each is a file of this folder and a row here.
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
  std::span<std::uint8_t>
      coverage;  ///< 1 baked, 2 missed; texels that are not covered keep what is there
};

/// Input of a map's maker, once a bake.
struct MapRequest {
  const Source::Impl& source;
  const LowSurface& surface;
  const BakeOptions& options;
  SharedWorks& shared;  ///< Shared by all maps of the bake
  /// Samples stand for so many times less than their share of a texel, a side: for maps that are read as points.
  std::uint32_t finer = 1;
  /// It is to check another one of the same map: works in another way, where the map has one.
  bool checks = false;

  /// Arrays of the device that all makers read.
  std::shared_ptr<BandReads> reads() const {
    return shared.of<BandReads>(std::ref(context_of(source.device)));
  }
};

/// Reads one map at the correspondences of bands.
class MapMaker {
 public:
  MapMaker() = default;
  MapMaker(const MapMaker&) = delete;
  MapMaker& operator=(const MapMaker&) = delete;
  virtual ~MapMaker() = default;

  /// Makes the texels of a band. Texels that are not covered keep what is there.
  virtual void run(const TexelBand& band, const DeviceCorrespondence& match,
                   const BandPixels& out) = 0;

  /// The same with two correspondences, whose values are mixed.
  /// \param other   with triangles for the samples that are mixed, and none for the rest
  /// \param shares  [samples] how much of `match` a sample takes, 0 to 1
  virtual void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                           const DeviceCorrespondence& other, const cl::Array<float>& shares,
                           const BandPixels& out) = 0;

  /// Adds facts of the map and warnings at the end, beside the texels.
  virtual void report(BakedMap& map, std::vector<Warning>& warnings) const {
    static_cast<void>(map), static_cast<void>(warnings);
  }
};

/// One map.
struct MapRow {
  MapInfo info;
  /// Renderers shade the low poly by it: unit normals in EncodingOptions::space. Plans measure what it shows.
  bool shades = false;
  /// Shares in [0, 1] that weight the maps with `weighted` in mip-maps: opacity.
  bool weights = false;
  /// Mip-maps are weighted by the map with `weights`: what is transparent does not show.
  bool weighted = false;
  /// It reads positions or distances, so it changes wherever vertices of the high poly move.
  bool follows_positions = false;
  /// It reads more of the high poly than the matched points. Any change of the mesh may show in any texel.
  bool reads_around = false;
  /// Unit of its values, where MapInfo does not tell: "world units".
  std::string_view unit = {};
  /// Range of each channel that integer formats hold; none: MapInfo::low and high, in all channels.
  std::function<ValueRange(const RangeRequest& request, std::uint32_t channel)> range = {};
  /// Channels whose differences are an error, from the first on; 0: all. The rest repeat what these say.
  std::uint32_t compared_channels = 0;
  /// Its values depend on the size of texels, so that a larger map is not nearer to the surface.
  bool of_texels = false;
  std::function<std::unique_ptr<MapMaker>(const MapRequest& request)> make;
};

std::span<const MapRow> map_rows();

/// \throws Error(usage) for a name that no row has
const MapRow& map_row(MapKind kind);

/// The rows of maps that a bake brings along, in their order. Their names stay for as long as the program runs.
/// \throws Error(usage) for a name that cannot be one, or is taken
std::vector<MapRow> own_rows(const BakeOptions& options);

/// Number of maps that are asked for, of all sorts.
inline std::size_t map_count(const BakeOptions& options) {
  return options.maps.size() + options.transfers.size() + options.own_maps.size() +
         options.variants.size();
}

/// The kinds of all of them that are maps of Kiln's own: what is asked of one kind counts for its variants.
inline std::vector<MapKind> kinds_of(const BakeOptions& options) {
  std::vector<MapKind> kinds = options.maps;
  for (const MapVariant& map : options.variants) kinds.push_back(map.kind);
  return kinds;
}

/// Null: no variant has that name.
template <typename Options>
auto find_variant(Options& options, std::string_view name) {
  for (auto& map : options.variants) {
    if (map.name == name) return &map;
  }
  return static_cast<decltype(options.variants.data())>(nullptr);
}

/// Leaves these maps alone of all that are asked for.
inline void ask_for(BakeOptions& options, std::vector<MapKind> maps) {
  options.maps = std::move(maps);
  options.transfers.clear();
  options.own_maps.clear();
  options.variants.clear();
}

/// Changes how light is gathered, for all maps and in each variant.
template <typename Change>
void change_occlusion(BakeOptions& options, const Change& change) {
  change(options.occlusion);
  for (MapVariant& variant : options.variants) {
    if (variant.occlusion) change(*variant.occlusion);
  }
}

/// The options as a variant has them.
BakeOptions options_of(const MapVariant& variant, BakeOptions options);

/// True if samples without a point give a texel nothing: its other samples make it, or its neighbours.
inline bool leaves_out_misses(const MapInfo& map, MissPolicy policy) {
  return map.missed == MissedTexels::neighbours ||
         (map.missed == MissedTexels::low_poly && policy != MissPolicy::keep);
}

/// The range of each channel: what the caller gave (EncodingOptions::ranges), or the row's rule.
std::vector<ValueRange> ranges_of(const MapRow& row, const RangeRequest& request);

/// The first of a bake's maps that shades (MapRow::shades); none: it has none.
std::optional<MapKind> shading_map(const BakeOptions& options);

/// Space of a map's directions.
NormalMapSpace space_of(const MapInfo& map, const BakeOptions& options);

/// Origin of maps of places: EncodingOptions::origin.
std::array<double, 3> map_origin(const BakeOptions& options, const Frame& frame);

/// Value of texels that no chart covers and padding does not reach. \returns as many as there are channels
std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options);

/// From a texel's value to what the map holds: the last step of a bake. \param coverage  of the texel
void encode_texel(const MapInfo& map, const BakeOptions& options, std::uint8_t coverage,
                  float* pixel);

// The rows, each in the file of its map.
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
