#include "measure/normal_probe.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "detail/normal.h"
#include "match/uv_points.h"
#include "measure/probe_parts.h"

namespace kiln {
namespace {

constexpr std::size_t kPlacesPerTask = 1 << 12;
constexpr double kMaxAngle = 180;

/// Bilinear lookup of three channels in a map, clamped to its edges.
Vec3d bilinear_texel(const Image& map, double u, double v) {
  const double x = u * map.width - 0.5;
  const double y = (1 - v) * map.height - 0.5;
  const auto clamped = [](double position, std::uint32_t count) {
    // NaN is treated as 0.
    return position > 0 ? static_cast<std::uint32_t>(std::min(position, count - 1.0)) : 0U;
  };
  const std::uint32_t x0 = clamped(std::floor(x), map.width);
  const std::uint32_t y0 = clamped(std::floor(y), map.height);
  const std::uint32_t x1 = clamped(std::floor(x) + 1, map.width);
  const std::uint32_t y1 = clamped(std::floor(y) + 1, map.height);
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const auto read = [&](std::uint32_t column, std::uint32_t row) {
    const float* p =
        &map.pixels[(std::size_t{row} * map.width + column) * std::size_t{map.channels}];
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
      return Vec3d(0.5, 0.5, 1);
    }
    return Vec3d(std::clamp(p[0], 0.0F, 1.0F), std::clamp(p[1], 0.0F, 1.0F),
                 std::clamp(p[2], 0.0F, 1.0F));
  };
  return (read(x0, y0) * (1 - fx) + read(x1, y0) * fx) * (1 - fy) +
         (read(x0, y1) * (1 - fx) + read(x1, y1) * fx) * fy;
}

/// Copies a range of pixels from an image that has a single row.
Image part_of_row(const Image& row, std::uint32_t begin, std::uint32_t end) {
  const auto row_texel = [&](std::uint32_t x) {
    return row.pixels.begin() + std::ptrdiff_t{x} * row.channels;
  };
  return {end - begin, 1, row.channels, std::vector<float>(row_texel(begin), row_texel(end))};
}

}  // namespace

NormalError NormalProbe::compare(const Image& shown_normals) const {
  const Image pixels =
      points_per_pixel_ > 1 ? pixel_means(shown_normals, points_per_pixel_) : shown_normals;
  NormalComparison comparison;
  for (std::size_t i = 1; i < picture_begins_.size(); ++i) {
    const std::uint32_t begin = picture_begins_[i - 1], end = picture_begins_[i];
    if (begin < end)
      comparison.add(part_of_row(high_poly_normals_, begin, end), part_of_row(pixels, begin, end));
  }
  NormalError error = comparison.error();
  error.one_sided += pixels_on_one_mesh_only_;
  const std::uint64_t point_count = points_on_one_mesh_ + points_on_both_meshes_;
  if (point_count > 0)
    error.one_sided_share =
        static_cast<double>(points_on_one_mesh_) / static_cast<double>(point_count);
  if (is_error_max_if_no_places_ && places_.empty()) error.mean_degrees = kMaxAngle;
  return error;
}

NormalError NormalProbe::without_map() const {
  std::vector<float> normals(3 * places_.size());
  parallel_for(places_.size(), kPlacesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      const Vec3 n = to_float(interpolate_corners(a.normal, b.normal, c.normal, place.u, place.v));
      normals[3 * i] = n.x;
      normals[3 * i + 1] = n.y;
      normals[3 * i + 2] = n.z;
    }
  });
  return error_with_normals(normals);
}

NormalError NormalProbe::error_with_normals(const std::vector<float>& normals) const {
  Image shown_normals{static_cast<std::uint32_t>(places_.size()), 1, 3,
                      std::vector<float>(normals.size())};
  parallel_for(places_.size(), kPlacesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float* n = &normals[3 * i];
      encode_normal(Vec3d(n[0], n[1], n[2]) * (places_[i].seen_from_behind ? -1.0 : 1.0),
                    &shown_normals.pixels[3 * i]);
    }
  });
  return compare(shown_normals);
}

NormalError NormalProbe::with_map(const Image& map, const BakeOptions& baked) const {
  const NormalMapSpace normal_space = baked.encoding.space;
  std::vector<float> normals(3 * places_.size());
  parallel_for(places_.size(), kPlacesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& corners = surface_.triangles[place.triangle];
      const double w = 1.0 - place.u - place.v;
      const auto& [a, b, c] = corners;
      Vec3d value = bilinear_texel(map, a.uv.x * w + b.uv.x * place.u + c.uv.x * place.v,
                                   a.uv.y * w + b.uv.y * place.u + c.uv.y * place.v) *
                        2.0 +
                    Vec3d(-1, -1, -1);
      if (baked.encoding.flip_y) value.y = -value.y;
      const kiln_low_shading& low = shading_[place.triangle];
      const Vec3d face = vector_at(low.face_normal);
      Vec3d normal = value;
      if (normal_space != NormalMapSpace::object) {
        Vec3d n = face, t = vector_at(low.face_tangent);
        double sign = 1;
        if (normal_space == NormalMapSpace::tangent) {
          n = interpolate_corners(a.normal, b.normal, c.normal, place.u, place.v);
          t = interpolate_corners(a.tangent, b.tangent, c.tangent, place.u, place.v);
          sign = low.sign;
        }
        Vec3d shaded_normal_space = cross(n, t);
        if (normal_space == NormalMapSpace::tangent &&
            baked.encoding.bitangent == Bitangent::vertex) {
          const auto uv_of = [](const LowSurface::Corner& corner) {
            return to_float(cross(to_double(corner.normal), to_double(corner.tangent)));
          };
          shaded_normal_space = interpolate_corners(uv_of(a), uv_of(b), uv_of(c), place.u, place.v);
        }
        normal = t * value.x + shaded_normal_space * (sign * value.y) + n * value.z;
      }
      if (!(length(normal) > 0)) normal = face;
      const Vec3 result = to_float(normal);
      normals[3 * i] = result.x;
      normals[3 * i + 1] = result.y;
      normals[3 * i + 2] = result.z;
    }
  });
  return error_with_normals(normals);
}

void NormalProbe::match_places(const BakeOptions& options,
                               std::shared_ptr<const VisibilityField>& field,
                               DeviceCorrespondence& match) const {
  BakeReport report;
  Clusters clusters{0, field};
  const SampleDirections directions = make_sample_directions(options, source_, surface_);
  const std::unique_ptr<Matcher> matcher =
      make_matcher(source_, surface_, options, report, clusters, BakeProgress(options.progress),
                   directions.blends_directions());
  field = clusters.field;
  const SheetDistances sheets = sheet_distances(options, surface_);
  if (!directions.blends_directions() && !(sheets.max_search_distance() > 0) &&
      !cage_.has_cage_mesh()) {
    matcher->run(band_, match);
    return;
  }
  TexelBand directed_band = copy_band();
  directions.set_directions(context_of(source_.device), directed_band);
  sheets.write_search_distances(context_of(source_.device), directed_band);
  cage_.write_sample_reach(context_of(source_.device), directed_band);
  matcher->run(directed_band, match);
}

/// Matching by UVs is computed here, not by its matcher, which needs samples at texel centres; places may lie anywhere.
void NormalProbe::match_by_uv(const BakeOptions& options,
                              std::shared_ptr<const VisibilityField>& field,
                              DeviceCorrespondence& match) const {
  const std::size_t count = places_.size();
  std::vector<Vec2> uvs(count);
  parallel_for(count, kPlacesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      const double w = 1.0 - place.u - place.v;
      uvs[i] = {static_cast<float>(a.uv.x * w + b.uv.x * place.u + c.uv.x * place.v),
                static_cast<float>(a.uv.y * w + b.uv.y * place.u + c.uv.y * place.v)};
    }
  });
  UvPoints found = match_row(options.match.method).find_at_uvs(source_, uvs);
  std::vector<std::uint8_t> status(count, KILN_STATUS_UV);
  bool is_any_missed = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (found.triangle[i] != KILN_NO_TRIANGLE) continue;
    status[i] = KILN_STATUS_MISS;
    is_any_missed = true;
  }
  cl::Context& context = context_of(source_.device);
  context.fill(match.distance, 0.0F);
  if (is_any_missed && !options.match.fallback.empty()) {
    BakeOptions fallback_options = options;
    fallback_options.match.method = options.match.fallback.front();
    fallback_options.match.fallback.erase(fallback_options.match.fallback.begin());
    fallback_options.match.fallback_blend = 0;
    match_places(fallback_options, field, match);
    const std::vector<std::uint32_t> triangle = match.triangle.download(context);
    const std::vector<float> barycentric = match.barycentric.download(context);
    const std::vector<std::uint8_t> fallback_status = match.status.download(context);
    for (std::size_t i = 0; i < count; ++i) {
      if (status[i] != KILN_STATUS_MISS) continue;
      status[i] = fallback_status[i];
      found.triangle[i] = triangle[i];
      found.barycentric[i] = barycentric[i];
      found.barycentric[i + count] = barycentric[i + count];
    }
  }
  match.triangle.write(context, std::span<const std::uint32_t>(found.triangle));
  match.barycentric.write(context, std::span<const float>(found.barycentric));
  match.status.write(context, std::span<const std::uint8_t>(status));
}

NormalProbe::InfiniteMap NormalProbe::infinite_map(
    const BakeOptions& options, std::shared_ptr<const VisibilityField>& field) const {
  InfiniteMap result;
  if (places() == 0) {
    result.error = error_with_normals({});
    return result;
  }
  cl::Context& context = context_of(source_.device);
  BakeOptions space_options = options;
  space_options.encoding.space = NormalMapSpace::object;
  space_options.encoding.flip_y = space_options.encoding.two_component = false;
  space_options.encoding.miss = MissPolicy::keep;
  DeviceCorrespondence match(context, band_.capacity);
  match.count = band_.sample_count;
  if (match_row(options.match.method).find_at_uvs != nullptr) {
    match_by_uv(space_options, field, match);
  } else {
    match_places(space_options, field, match);
  }
  NormalDetail normal_detail(context, surface_, source_.attributes, space_options);
  cl::Array<float> image(context, std::size_t{3} * places());
  cl::Array<std::uint8_t> coverage(context, places());
  context.fill(image, 0.0F);
  context.fill(coverage, std::uint8_t{0});
  normal_detail.run(band_, match, image, coverage);
  result.normals = image.download(context);
  result.error = error_with_normals(result.normals);
  const std::vector<std::uint8_t> status = match.status.download(context);
  result.missed = static_cast<double>(std::count(status.begin(), status.begin() + places(),
                                                 std::uint8_t{KILN_STATUS_MISS})) /
                  places();
  return result;
}

}  // namespace kiln
