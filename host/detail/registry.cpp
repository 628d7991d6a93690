#include "detail/registry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>

#include "base/intern.h"
#include "base/option_list.h"
#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
std::span<const MapRow> map_rows() {
  static const std::vector<MapRow> rows = {normal_map(),       ao_map(),
                                           bent_normal_map(),  thickness_map(),
                                           mask_map(),         height_map(),
                                           curvature_map(),    displacement_map(),
                                           distance_map(),     provenance_map(),
                                           uv_map(),           wireframe_map(),
                                           visibility_map(),   deviation_map(),
                                           position_map(),     id_map(),
                                           slope_map(),        color_map(),
                                           vertex_color_map(), opacity_map(),
                                           shadow_map(),       normal_object_map(),
                                           normal_face_map(),  convexity_map()};
  return rows;
}

const MapRow& map_row(MapKind kind) {
  std::string known_names;
  for (const MapRow& row : map_rows()) {
    if (row.info.kind == kind) return row;
    known_names += (known_names.empty() ? "" : ", ") + std::string(row.info.kind.name);
  }
  throw Error(ErrorCode::usage, "There is no map '" + std::string(kind.name) + "'. The maps are " +
                                    known_names + ".");
}

std::span<const MapInfo> maps() {
  static const std::vector<MapInfo> map_infos = [] {
    std::vector<MapInfo> list;
    for (const MapRow& row : map_rows()) list.push_back(row.info);
    return list;
  }();
  return map_infos;
}

MapKind::MapKind(std::string_view text) : name(intern(text)) {}

const MapInfo& find_map(std::string_view name) {
  MapKind kind;
  kind.name = name;  // The name of an unknown map may be temporary, so it is not kept
  return map_row(kind).info;
}

bool obeys(const MapInfo& map, std::string_view option) {
  if (map.type == MapType::unit_vector &&
      contains_option("encoding.space encoding.bitangent encoding.flip_y encoding.two_component "
                      "encoding.raw",
                      option)) {
    return true;
  }
  if (option == "encoding.gutter") return map.type != MapType::coverage;
  if (option == "encoding.mips") return map.type != MapType::coverage && map.type != MapType::id;
  return contains_option(map.options, option);
}

std::optional<MapKind> shading_map(const BakeOptions& options) {
  for (const MapKind map : options.maps) {
    if (map_row(map).is_shading_normal) return map;
  }
  return std::nullopt;
}

NormalMapSpace space_of(const MapInfo& map, const BakeOptions& options) {
  return map.space.value_or(options.encoding.space);
}

std::array<double, 3> map_origin(const BakeOptions& options, const Frame& frame) {
  return options.encoding.origin ? *options.encoding.origin
                                 : local_origin(frame.center, frame.diagonal);
}

std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options) {
  // In tangent space and in face space, the normal of a surface without detail is (0, 0, 1).
  const bool up =
      map.type == MapType::unit_vector && space_of(map, options) != NormalMapSpace::object;
  return {0, 0, up ? 1.0F : 0.0F, 0};
}

void encode_texel(const MapInfo& map, const BakeOptions& options, std::uint8_t coverage,
                  float* pixel) {
  const bool is_marked_miss =
      options.encoding.miss == MissPolicy::mark && coverage == kCoverageMissed;
  if ((map.type == MapType::id || (map.type == MapType::color && map.channels == 3)) &&
      is_marked_miss) {
    pixel[0] = pixel[2] = 1;
    pixel[1] = 0;
  }
  if (map.type != MapType::unit_vector) return;
  if (is_marked_miss) {
    pixel[0] = pixel[2] = 1;
    pixel[1] = -1;
  }
  if (options.encoding.two_component && !is_marked_miss)
    pixel[2] = options.encoding.raw ? 0.0F : -1.0F;
  if (options.encoding.raw) return;
  for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] * 0.5F + 0.5F;
}

std::vector<ValueRange> ranges_of(const MapRow& row, const RangeRequest& request) {
  std::vector<ValueRange> channel_ranges;
  for (std::uint32_t c = 0; c < row.info.channels; ++c) {
    channel_ranges.push_back(row.range ? row.range(request, c)
                                       : ValueRange{row.info.low, row.info.high});
  }
  for (const MapRange& range_option : request.options.encoding.ranges) {
    if (range_option.kind == row.info.kind)
      channel_ranges.assign(row.info.channels, range_option.range);
  }
  return channel_ranges;
}

RangeExcess beyond_range(const BakedMap& map, std::span<const std::uint8_t> coverage) {
  RangeExcess excess;
  const std::size_t channels = map.image.channels;
  if (map.info.type == MapType::unit_vector || map.ranges.size() != channels) return excess;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    if (coverage[i] != kCoverageBaked) continue;
    bool is_in_range = true;
    for (std::size_t c = 0; c < channels; ++c) {
      const float value = map.image.pixels[i * channels + c];
      const auto [low, high] = map.ranges[c];
      // Values this close to a bound count as the bound, since every integer format rounds them to
      // it.
      const float slack = (high - low) * 1e-5F;
      if (value >= low - slack && value <= high + slack) continue;
      is_in_range = false;
      if (std::max(value - high, low - value) <= excess.distance) continue;
      excess.distance = std::max(value - high, low - value);
      excess.value = value;
      excess.x = static_cast<std::uint32_t>(i % map.image.width);
      excess.y = static_cast<std::uint32_t>(i / map.image.width);
    }
    excess.texels += is_in_range ? 0 : 1;
  }
  return excess;
}

}  // namespace kiln
