#include "detail/registry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>

#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::size_t kTexelsAtOnce = std::size_t{1} << 16;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// Of the texels that are baked. \tparam kStep  from value to value where it is known, or 0 \param step  the same
template <std::size_t kStep>
ValueRange range_of(std::span<const std::uint8_t> coverage, const float* value, std::size_t step) {
  // Four bounds, so that none waits for the one before it; chosen, not branched to.
  constexpr std::size_t kBounds = 4;
  std::array<float, kBounds> low{}, high{};
  low.fill(kFar);
  high.fill(-kFar);
  const auto take = [&](std::size_t i, std::size_t bound) {
    const float at = value[i * (kStep != 0 ? kStep : step)];
    const bool baked = coverage[i] == kCoverageBaked;
    const float below = baked ? at : kFar, above = baked ? at : -kFar;
    low[bound] = below < low[bound] ? below : low[bound];
    high[bound] = above > high[bound] ? above : high[bound];
  };
  std::size_t i = 0;
  for (; i + kBounds <= coverage.size(); i += kBounds) {
    for (std::size_t bound = 0; bound < kBounds; ++bound) take(i + bound, bound);
  }
  for (; i < coverage.size(); ++i) take(i, 0);
  return {std::min({low[0], low[1], low[2], low[3]}),
          std::max({high[0], high[1], high[2], high[3]})};
}

}  // namespace

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

std::optional<MapKind> shading_map(const BakeOptions& options) {
  for (const MapKind map : options.maps) {
    if (map_row(map).info.shades) return map;
  }
  return std::nullopt;
}

NormalMapSpace space_of(const MapInfo& map, const BakeOptions& options) {
  return map.space.value_or(options.space);
}

std::array<double, 3> map_origin(const BakeOptions& options, const Frame& frame) {
  return options.origin ? *options.origin : local_origin(frame.center, frame.diagonal);
}

std::array<float, 4> map_background(const MapInfo& map, const BakeOptions& options) {
  // The direction that lights like the plain surface.
  const bool up =
      map.type == MapType::unit_vector && space_of(map, options) != NormalMapSpace::object;
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
  ValueRange range{kFar, -kFar};
  std::mutex mutex;
  parallel_for(coverage.size(), kTexelsAtOnce, [&](std::size_t begin, std::size_t end) {
    const float* first = &map.image.pixels[begin * map.image.channels + channel];
    const auto texels = coverage.subspan(begin, end - begin);
    const ValueRange part = map.image.channels == 1
                                ? range_of<1>(texels, first, 1)
                                : range_of<0>(texels, first, map.image.channels);
    const std::lock_guard lock(mutex);
    range = {std::min(range.low, part.low), std::max(range.high, part.high)};
  });
  // Nothing baked: 0. And -0 is no bound, since which of the zeros came first depends on the threads.
  range =
      range.low > range.high ? ValueRange{0, 0} : ValueRange{range.low + 0.0F, range.high + 0.0F};
  if (info.type == MapType::signed_scalar) {
    range.high = std::max(std::abs(range.low), std::abs(range.high));
    range.low = -range.high;
  }
  return range;
}

}  // namespace kiln
