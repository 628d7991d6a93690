#include "measure/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "bake/map_units.h"
#include "bake/pipeline.h"
#include "base/formatted.h"
#include "detail/registry.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr double kSamplePoints = 2000;
// Bounds on the side of the sampling grid, in texels.
constexpr double kMinGridSide = 47, kMaxGridSide = 1021;
constexpr std::uint32_t kReferenceRays = 4096, kMaxMapSize = 16384;
// Share of a bound on the error of ambient occlusion that is left to the noise of its rays.
constexpr double kRayNoiseShare = 0.5;

/// Registry rows of all requested maps, including transfers, variants and custom maps.
struct RequestedMapRows {
  explicit RequestedMapRows(const BakeOptions& bake)
      : custom_rows(own_rows(bake)), requested_maps(bake.maps) {}
  /// Registry row of a map; null if the map is not baked.
  const MapRow* find(MapKind kind) const {
    for (const MapRow& row : custom_rows) {
      if (row.info.kind == kind) return &row;
    }
    return std::find(requested_maps.begin(), requested_maps.end(), kind) != requested_maps.end()
               ? &map_row(kind)
               : nullptr;
  }
  std::vector<MapRow> custom_rows;
  std::vector<MapKind> requested_maps;
};

bool has_errors(const MapRow& row) {
  return row.info.type != MapType::id && row.info.type != MapType::coverage &&
         !row.depends_on_texel_size;
}

double value_scale(const MapRow& row) { return unit_of(row).name == "1/255" ? 255 : 1; }

/// Side of a sampling grid with about `kSamplePoints` covered texels. It is odd, so that its texel centres do not coincide
/// with those of the map.
std::uint32_t grid_side(const Mesh& low) {
  double area = 0;
  for (const Triangle& t : low.uv_triangles) {
    const Vec2 &a = low.uvs[t[0]], &b = low.uvs[t[1]], &c = low.uvs[t[2]];
    const double doubled_area =
        (double{b.x} - a.x) * (double{c.y} - a.y) - (double{c.x} - a.x) * (double{b.y} - a.y);
    if (std::isfinite(doubled_area)) area += std::abs(doubled_area) / 2;
  }
  const double side = std::sqrt(kSamplePoints / std::clamp(area, 1e-6, 1.0));
  return static_cast<std::uint32_t>(std::clamp(side, kMinGridSide, kMaxGridSide)) | 1U;
}

/// Options for a reference bake that evaluates single points of the surface, in the maps that have bounds.
BakeOptions point_options(const BakeOptions& bake, std::span<const MapBound> bounds,
                          const BakeResult& result, std::uint32_t side) {
  BakeOptions options = bake;
  const auto has_bound = [&](std::string_view name) {
    return std::any_of(bounds.begin(), bounds.end(),
                       [&](const MapBound& bound) { return bound.kind.name == name; });
  };
  std::erase_if(options.maps, [&](MapKind kind) { return !has_bound(kind.name); });
  std::erase_if(options.transfers, [&](const Transfer& map) { return !has_bound(map.name); });
  std::erase_if(options.own_maps, [&](const OwnMap& map) { return !has_bound(map.name); });
  std::erase_if(options.variants, [&](const MapVariant& map) { return !has_bound(map.name); });
  // Depth views get the same resolution as they had in the bake of the map.
  if (result.report.views) options.match.views.size = result.report.views->size;
  options.width = options.height = side;
  options.samples = 1;
  change_occlusion(options, [](OcclusionOptions& occlusion) {
    occlusion.rays = kReferenceRays;
    occlusion.by = OcclusionBy::rays;
    occlusion.max_error = 0;
  });
  options.encoding.raw = true;
  options.encoding.two_component = options.encoding.mips = options.report.errors =
      options.report.keep_match = false;
  options.report.recall = options.match.fallback_blend = 0;
  options.report.vertex_coverage = false;
  options.encoding.gutter = 0;
  options.progress = {};
  return options;
}

/// Bilinear lookup of a map, with directions decoded.
std::array<float, 4> sample_bilinear(const MapRow& row, const BakeOptions& bake, const Image& image,
                                     double u, double v) {
  const double x = std::clamp(u * image.width - 0.5, 0.0, image.width - 1.0);
  const double y = std::clamp(v * image.height - 0.5, 0.0, image.height - 1.0);
  const auto left = static_cast<std::uint32_t>(x), top = static_cast<std::uint32_t>(y);
  const std::uint32_t right = std::min(left + 1, image.width - 1);
  const std::uint32_t below = std::min(top + 1, image.height - 1);
  const double x_share = x - left, y_share = y - top;
  const auto texel = [&](std::uint32_t column, std::uint32_t line, std::uint32_t c) {
    return double{image.pixels[(std::size_t{line} * image.width + column) * image.channels + c]};
  };
  std::array<float, 4> value{};
  for (std::uint32_t c = 0; c < image.channels; ++c) {
    const double upper = texel(left, top, c) * (1 - x_share) + texel(right, top, c) * x_share;
    const double lower = texel(left, below, c) * (1 - x_share) + texel(right, below, c) * x_share;
    value[c] = static_cast<float>(upper * (1 - y_share) + lower * y_share);
  }
  if (row.info.type != MapType::unit_vector) return value;
  for (std::size_t c = 0; c < 3 && !bake.encoding.raw; ++c) value[c] = 2 * value[c] - 1;
  if (bake.encoding.two_component) {
    value[2] = std::sqrt(std::max(0.0F, 1 - value[0] * value[0] - value[1] * value[1]));
  }
  return value;
}

}  // namespace

void check_bounds(const BakeOptions& bake, std::span<const MapBound> bounds) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (bounds.empty()) return;
  const RequestedMapRows rows(bake);
  for (const MapBound& bound : bounds) {
    const std::string name(bound.kind.name);
    const bool is_shading_map = std::any_of(
        map_rows().begin(), map_rows().end(),
        [&](const MapRow& row) { return row.info.kind == bound.kind && row.is_shading_normal; });
    if (is_shading_map) {
      fail("bounds has the map " + name +
           ", whose error is also bounded by max_error: leave one of them out.");
    }
    const MapRow* row = rows.find(bound.kind);
    if (row == nullptr)
      fail("The error of the map " + name + " is bounded, but it is not baked: add it.");
    if (!has_errors(*row)) {
      fail("The error of the map " + name + " cannot be measured: leave its bound out.");
    }
    if (!std::isfinite(bound.max_error) || !(bound.max_error > 0)) {
      fail("The bound on the error of the map " + name + " is " + decimal(bound.max_error) +
           ": it must be finite and above 0.");
    }
    if (std::count_if(bounds.begin(), bounds.end(),
                      [&](const MapBound& other) { return other.kind == bound.kind; }) > 1) {
      fail("The map " + name + " has two bounds: leave one of them out.");
    }
  }
}

void reserve_bound_for_rays(std::span<const MapBound> bounds, BakeOptions& bake) {
  const RequestedMapRows rows(bake);
  const OcclusionOptions given_occlusion = bake.occlusion;
  const auto reserve_half = [](double error, const OcclusionOptions& given,
                               OcclusionOptions& occlusion) {
    if (given.max_error > 0 || given.by == OcclusionBy::views) return;
    occlusion.max_error = kRayNoiseShare * error;
  };
  for (const MapBound& bound : bounds) {
    if (!obeys(rows.find(bound.kind)->info, "occlusion.max_error") || bound.max_error > 1) continue;
    MapVariant* const variant = find_variant(bake, bound.kind.name);
    if (variant != nullptr && variant->occlusion) {
      reserve_half(bound.max_error, OcclusionOptions(*variant->occlusion), *variant->occlusion);
    } else {
      reserve_half(bound.max_error, given_occlusion, bake.occlusion);
    }
  }
}

std::vector<MapReached> reached_bounds(const Source::Impl& high, const Mesh& low,
                                       const BakeOptions& bake, std::span<const MapBound> bounds,
                                       const BakeResult& result) {
  std::vector<MapReached> reached_errors;
  if (bounds.empty()) return reached_errors;
  BakeProgress(bake.progress).at(0, "measuring errors");
  const std::uint32_t side = grid_side(low);
  const BakeOptions options = point_options(bake, bounds, result, side);
  Clusters clusters;
  const std::uint32_t size_factor = std::max(1U, kMaxMapSize / side);
  const BakeResult points =
      Pipeline({high, low, options, size_factor}, BandStorage::reused).run(clusters);
  const RequestedMapRows rows(bake);
  for (const MapBound& bound : bounds) {
    const MapRow& row = *rows.find(bound.kind);
    const Image& reference_image = points.map(bound.kind).image;
    const Image& baked = result.map(bound.kind).image;
    MapReached map;
    map.kind = row.info.kind;
    map.unit = unit_of(row).name;
    if (map.unit == "1/255") map.unit = "";
    map.wanted = bound.max_error;
    double squared_error_sum = 0;
    for (std::size_t i = 0; i < points.coverage.size(); ++i) {
      if (points.coverage[i] != kCoverageBaked) continue;
      const std::size_t y = i / side;
      const double u = (static_cast<double>(i % side) + 0.5) / side;
      const double v = (static_cast<double>(y) + 0.5) / side;
      const std::array<float, 4> value = sample_bilinear(row, bake, baked, u, v);
      const double error =
          map_difference(row, value.data(), &reference_image.pixels[i * reference_image.channels]) /
          value_scale(row);
      squared_error_sum += error * error;
      ++map.points;
    }
    if (map.points != 0) map.error = std::sqrt(squared_error_sum / map.points);
    reached_errors.push_back(map);
  }
  return reached_errors;
}

bool are_all_bounds_reached(std::span<const MapReached> bounds) {
  return std::all_of(bounds.begin(), bounds.end(),
                     [](const MapReached& map) { return map.reached(); });
}

}  // namespace kiln
