#include "detail/registry.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "image/gutter.h"

namespace kiln {

std::span<const MapRow> map_rows() {
  static const std::vector<MapRow> rows = {
      normal_map(), ao_map(),        bent_normal_map(),  thickness_map(),    mask_map(),
      height_map(), curvature_map(), displacement_map(), distance_map(),     provenance_map(),
      uv_map(),     wireframe_map(), visibility_map(),   deviation_map(),    position_map(),
      id_map(),     slope_map(),     color_map(),        vertex_color_map(), opacity_map(),
      shadow_map()};
  return rows;
}

const MapRow& map_row(MapKind kind) {
  std::string known;
  for (const MapRow& row : map_rows()) {
    if (row.info.kind == kind) return row;
    known += (known.empty() ? "" : ", ") + std::string(row.info.kind.name);
  }
  throw Error(ErrorCode::usage,
              "There is no map '" + std::string(kind.name) + "': maps has any of " + known + ".");
}

std::span<const MapInfo> maps() {
  static const std::vector<MapInfo> infos = [] {
    std::vector<MapInfo> list;
    for (const MapRow& row : map_rows()) list.push_back(row.info);
    return list;
  }();
  return infos;
}

const MapInfo& find_map(std::string_view name) { return map_row(MapKind{name}).info; }

std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options) {
  // The direction that lights like the plain surface.
  const bool up = map.type == MapType::unit_vector && options.space != NormalMapSpace::object;
  return {0, 0, up ? 1.0F : 0.0F, 0};
}

void encode_texel(const MapInfo& map, const BakeOptions& options, std::uint8_t coverage,
                  float* pixel) {
  const bool marked = options.miss == MissPolicy::mark && coverage == kCoverageMissed;
  if ((map.type == MapType::id || (map.is_color && map.channels == 3)) && marked) {
    pixel[0] = pixel[2] = 1;
    pixel[1] = 0;
  }
  if (map.type != MapType::unit_vector) return;
  if (marked) {
    pixel[0] = pixel[2] = 1;
    pixel[1] = -1;
  }
  if (options.two_component && !marked) pixel[2] = options.raw ? 0.0F : -1.0F;
  if (options.raw) return;
  for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] * 0.5F + 0.5F;
}

ValueRange value_range(const BakedMap& map, std::span<const std::uint8_t> coverage,
                       std::uint32_t channel) {
  const MapInfo& info = map.info.kind.name.empty() ? find_map(map.kind.name) : map.info;
  if (info.low != 0 || info.high != 0) return {info.low, info.high};
  ValueRange range{0, 0};
  bool any = false;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    if (coverage[i] != kCoverageBaked) continue;
    const float value = map.image.pixels[i * map.image.channels + channel];
    range.low = any ? std::min(range.low, value) : value;
    range.high = any ? std::max(range.high, value) : value;
    any = true;
  }
  if (info.type == MapType::signed_scalar) {
    range.high = std::max(std::abs(range.low), std::abs(range.high));
    range.low = -range.high;
  }
  return range;
}

}  // namespace kiln
