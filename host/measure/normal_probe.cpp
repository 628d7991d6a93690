#include "measure/normal_probe.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "detail/normal.h"
#include "match/uv_points.h"
#include "mesh/low_shading.h"
#include "mesh/vector.h"
#include "render/camera.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTile = 8;
constexpr std::size_t kGrain = 1 << 12;

/// A box around the dense mesh: frames the same pictures for both meshes.
Mesh box_of(const Source::Impl& source) {
  Vec3d low{1e300, 1e300, 1e300};
  Vec3d high{-1e300, -1e300, -1e300};
  for (const Triangle& triangle : source.triangles) {
    for (const std::uint32_t i : triangle) {
      const Vec3& p = source.positions[i];
      if (!is_finite(p)) continue;
      low = {std::min(low.x, double{p.x}), std::min(low.y, double{p.y}),
             std::min(low.z, double{p.z})};
      high = {std::max(high.x, double{p.x}), std::max(high.y, double{p.y}),
              std::max(high.z, double{p.z})};
    }
  }
  Mesh box;
  box.name = "box";
  box.origin = source.frame.center;
  for (int i = 0; i < 8; ++i) {
    const Vec3d corner = {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                          (i & 4) != 0 ? high.z : low.z};
    box.positions.push_back(to_float(corner * (1 / source.frame.scale)));
  }
  // Corners are what counts.
  box.triangles = {{0, 1, 2}, {3, 4, 5}, {5, 6, 7}};
  return box;
}

/// A camera in the dense mesh's frame.
struct Picture {
  Vec3d right, up, toward;
  Vec3d middle;
  double half_side = 0;
  std::uint32_t pixels = 0;

  Picture(const Camera& camera, const Frame& frame, std::uint32_t size)
      : right(camera.right),
        up(camera.up),
        toward(camera.toward),
        middle(Vec3d(camera.center[0] - frame.center[0], camera.center[1] - frame.center[1],
                     camera.center[2] - frame.center[2]) *
               frame.scale),
        half_side(camera.half_side * frame.scale),
        pixels(size) {}

  /// The middle of a pixel, in the plane through `middle`. Pixels follow each other by tiles, so that rays
  /// that are neighbours in memory are neighbours in the picture.
  Vec3d point(std::uint32_t index) const {
    const std::uint32_t tile = index / (kTile * kTile), within = index % (kTile * kTile);
    const std::uint32_t x = tile % (pixels / kTile) * kTile + within % kTile;
    const std::uint32_t y = tile / (pixels / kTile) * kTile + within / kTile;
    const double step = 2 * half_side / pixels;
    return middle + right * ((x + 0.5) * step - half_side) + up * (half_side - (y + 0.5) * step);
  }

  kiln_view view(std::uint32_t first) const {
    kiln_view to{};
    const auto store = [](const Vec3d& from, kiln_float(&vector)[3]) {
      const Vec3 v = to_float(from);
      vector[0] = v.x;
      vector[1] = v.y;
      vector[2] = v.z;
    };
    store(right, to.right);
    store(up, to.up);
    store(toward, to.toward);
    const double scale = pixels / (2 * half_side);
    to.scale = static_cast<float>(scale);
    to.left = static_cast<float>(pixels / 2.0 - dot(middle, right) * scale);
    to.top = static_cast<float>(pixels / 2.0 + dot(middle, up) * scale);
    to.width = to.height = pixels;
    to.first = first;
    return to;
  }
};

struct Hits {
  std::vector<std::uint32_t> triangle;
  std::vector<float> barycentric;  ///< 2 planes
};

/// The nearest of a mesh's triangles in every pixel.
Hits by_rays(cl::Context& context, const RayCaster& rays, const std::vector<Picture>& pictures,
             double start) {
  const std::uint32_t each = pictures[0].pixels * pictures[0].pixels;
  const auto count = static_cast<std::uint32_t>(each * pictures.size());
  std::vector<float> points(std::size_t{7} * count, 0.0F);
  parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Picture& picture = pictures[i / each];
      const Vec3d at = picture.point(static_cast<std::uint32_t>(i % each));
      const Vec3 p = to_float(at + picture.toward * (start - dot(at, picture.toward)));
      const Vec3 d = to_float(picture.toward * -1.0);
      const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
      for (std::size_t c = 0; c < 6; ++c) points[c * count + i] = values[c];
    }
  });
  const cl::Array<float> device_points(context, std::span<const float>(points));
  Correspondence match(context, count);
  RayQuery query;
  query.t_max = static_cast<float>(2 * start);
  query.two_sided = true;
  rays.intersect(device_points, count, count, query, match);
  Hits hits{std::vector<std::uint32_t>(count), std::vector<float>(std::size_t{2} * count)};
  match.triangle.read(context, hits.triangle);
  match.barycentric.read(context, hits.barycentric);
  return hits;
}

/// The same of the dense mesh, drawn. No weights: they follow from the pixel.
/// \param needed  which pictures; the others stay empty
Hits by_raster(const Source::Impl& source, const std::vector<Picture>& pictures,
               const std::vector<bool>& needed) {
  cl::Context& context = source.device.context();
  const std::uint32_t pixels = pictures[0].pixels;
  const auto keys_each = static_cast<std::uint32_t>(DepthKeys::count(pixels, pixels));
  std::vector<kiln_view> views;
  std::vector<std::size_t> picture_of_view;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!needed[i]) continue;
    views.push_back(pictures[i].view(static_cast<std::uint32_t>(views.size()) * keys_each));
    picture_of_view.push_back(i);
  }
  Hits hits;
  const std::size_t each = std::size_t{pixels} * pixels;
  hits.triangle.assign(each * pictures.size(), KILN_NO_TRIANGLE);
  if (views.empty()) return hits;
  const DepthKeys keys(context, std::uint64_t{keys_each} * views.size());
  source.raster().draw(views, keys);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::vector<std::uint64_t> rows = keys.picture(context, views[v]);
    for (std::uint32_t i = 0; i < each; ++i) {
      const std::uint32_t tile = i / (kTile * kTile), within = i % (kTile * kTile);
      const std::uint32_t x = tile % (pixels / kTile) * kTile + within % kTile;
      const std::uint32_t y = tile / (pixels / kTile) * kTile + within / kTile;
      const std::uint64_t key = rows[std::size_t{y} * pixels + x];
      if (key == KILN_RASTER_EMPTY) continue;
      hits.triangle[each * picture_of_view[v] + i] = static_cast<std::uint32_t>(key);
    }
  }
  return hits;
}

/// The dense mesh's shading normal where a pixel's ray meets a triangle, turned to the viewer.
Vec3d dense_normal(const Source::Impl& source, const std::vector<std::uint32_t>& normal_indices,
                   const std::vector<float>& normals, const Picture& picture, const Vec3d& pixel,
                   std::uint32_t triangle) {
  std::array<Vec3d, 3> corners;
  std::array<std::array<double, 2>, 3> flat;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] = Vec3d(source.positions[source.triangles[triangle][k]]) - pixel;
    flat[k] = {dot(corners[k], picture.right), dot(corners[k], picture.up)};
  }
  const auto area = [&](std::size_t a, std::size_t b) {
    return flat[a][0] * flat[b][1] - flat[b][0] * flat[a][1];
  };
  const double weights[3] = {area(1, 2), area(2, 0), area(0, 1)};
  const double whole = weights[0] + weights[1] + weights[2];
  const Vec3d face = cross(corners[1] - corners[0], corners[2] - corners[0]);
  Vec3d sum;
  for (std::size_t k = 0; k < 3; ++k) {
    const float* n = &normals[3 * std::size_t{normal_indices[3 * std::size_t{triangle} + k]}];
    sum += Vec3d(n[0], n[1], n[2]) * (weights[k] / whole);
  }
  double size = length(sum);
  if (!(size > 0)) {
    sum = face;
    size = length(face);
  }
  return sum * ((dot(face, picture.toward) < 0 ? -1 : 1) / size);
}

void encode(const Vec3d& normal, float* pixel) {
  const double size = length(normal);
  const Vec3 n = to_float(size > 0 ? normal * (0.5 / size) : normal);
  pixel[0] = n.x + 0.5F;
  pixel[1] = n.y + 0.5F;
  pixel[2] = n.z + 0.5F;
}

template <typename T>
Vec3d blend(const T& a, const T& b, const T& c, float u, float v) {
  return Vec3d(a) * (1.0 - u - v) + Vec3d(b) * u + Vec3d(c) * v;
}

Vec3d vector_at(const kiln_float* values) { return {values[0], values[1], values[2]}; }

/// Three channels at a place of a map: bilinear between the centres of texels, clamped to its edges.
Vec3d texel_at(const Image& map, double u, double v) {
  const double x = u * map.width - 0.5;
  const double y = (1 - v) * map.height - 0.5;
  const auto clamped = [](double at, std::uint32_t count) {
    // Also for what is not a number, which counts as 0.
    return at > 0 ? static_cast<std::uint32_t>(std::min(at, count - 1.0)) : 0U;
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

}  // namespace

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
                         const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster)
    : source_(source),
      reads_(source.device.context()),
      light_(source.device.context(), source.frame.to_frame(low), low.triangles, source.traversal),
      surface_(LowSurface::of(low, source.frame, cage)),
      shading_(low_shading(surface_)) {
  cl::Context& context = source.device.context();
  const Mesh box = box_of(source);
  const CameraTarget target = CameraTarget::of(box);
  std::vector<Picture> pictures;
  for (const ViewAngles& view : views) {
    RenderOptions options;
    options.azimuth_degrees = view.azimuth_degrees;
    options.elevation_degrees = view.elevation_degrees;
    pictures.emplace_back(Camera::fit(target, options), source.frame, pixels);
    toward_.push_back(pictures.back().toward);
  }

  double radius = 1;
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    if (surface_.usable[t] == 0) continue;
    for (const LowSurface::Corner& corner : surface_.triangles[t]) {
      radius = std::max(radius, length(Vec3d(corner.position)));
    }
  }
  start_ = 1.5 * radius;
  const Hits shown = by_rays(context, light_, pictures, start_);
  const std::size_t count = shown.triangle.size();
  const std::uint32_t each = pixels * pixels;
  const auto from_behind = [&](std::size_t at) {
    const auto& [a, b, c] = surface_.triangles[shown.triangle[at]];
    const Vec3d origin(a.position);
    return dot(cross(Vec3d(b.position) - origin, Vec3d(c.position) - origin),
               pictures[at / each].toward) < 0;
  };
  // Drawing shows no backs. Of an open mesh from below it would show what little faces down.
  const auto unseen = [&](std::size_t at) {
    return raster && shown.triangle[at] != KILN_NO_TRIANGLE && from_behind(at);
  };
  std::vector<bool> needed(pictures.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (shown.triangle[i] != KILN_NO_TRIANGLE && !unseen(i)) needed[i / each] = true;
  }
  const Hits dense = raster ? by_raster(source, pictures, needed)
                            : by_rays(context, source.rays(), pictures, start_);
  const std::vector<std::uint32_t>& normal_indices =
      reads_.read_source(source.attributes.normal_indices);
  const std::vector<float>& normals = reads_.read_source(source.attributes.normals);
  std::vector<std::uint32_t> both;
  for (std::size_t i = 0; i < count; ++i) {
    if (unseen(i)) continue;
    const bool light_hit = shown.triangle[i] != KILN_NO_TRIANGLE;
    const bool dense_hit = dense.triangle[i] != KILN_NO_TRIANGLE;
    if (light_hit != dense_hit) ++one_sided_;
    if (light_hit && dense_hit) both.push_back(static_cast<std::uint32_t>(i));
  }
  places_.resize(both.size());
  reference_ = {static_cast<std::uint32_t>(both.size()), 1, 3,
                std::vector<float>(std::size_t{3} * both.size())};
  parallel_for(both.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t at = both[i];
      const Picture& picture = pictures[at / each];
      encode(dense_normal(source, normal_indices, normals, picture, picture.point(at % each),
                          dense.triangle[at]),
             &reference_.pixels[3 * i]);
      Place& place = places_[i];
      place.triangle = shown.triangle[at];
      place.u = shown.barycentric[at];
      place.v = shown.barycentric[at + count];
      place.back = from_behind(at);
    }
  });
  band_ = band_of(places_);
}

TexelBand NormalProbe::band_of(const std::vector<Place>& places) const {
  const std::size_t count = places.size();
  std::vector<std::uint32_t> index(count + 1), triangle(count);
  std::iota(index.begin(), index.end(), 0U);
  std::vector<float> barycentric(2 * count), points(7 * count);
  parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      triangle[i] = place.triangle;
      barycentric[i] = place.u;
      barycentric[i + count] = place.v;
      const Vec3 p = to_float(blend(a.position, b.position, c.position, place.u, place.v));
      Vec3d direction = blend(a.direction, b.direction, c.direction, place.u, place.v);
      double reach = length(direction);
      if (reach < 1e-15) {
        reach = 0;
        direction = vector_at(shading_[place.triangle].face_normal);
      } else {
        direction = direction * (1 / reach);
      }
      const Vec3 d = to_float(direction);
      const float values[7] = {p.x, p.y, p.z, d.x, d.y, d.z, static_cast<float>(reach)};
      for (std::size_t k = 0; k < 7; ++k) points[k * count + i] = values[k];
    }
  });
  TexelBand band;
  band.row_count = 1;
  band.texel_count = band.sample_count = band.capacity = static_cast<std::uint32_t>(count);
  if (count == 0) return band;
  cl::Context& context = source_.device.context();
  band.texel_index =
      cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(index).first(count));
  band.texel_first = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(index));
  const std::vector<std::uint32_t> zeros(count, 0);
  band.sample_slot = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(zeros));
  band.triangle = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(triangle));
  band.barycentric = cl::Array<float>(context, std::span<const float>(barycentric));
  band.points = cl::Array<float>(context, std::span<const float>(points));
  return band;
}

NormalError NormalProbe::compare(const Image& shown) const {
  NormalError error = compare_normals(reference_, shown);
  error.one_sided += one_sided_;
  return error;
}

NormalError NormalProbe::without_map() const {
  std::vector<float> normals(3 * places_.size());
  parallel_for(places_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      const Vec3 n = to_float(blend(a.normal, b.normal, c.normal, place.u, place.v));
      normals[3 * i] = n.x;
      normals[3 * i + 1] = n.y;
      normals[3 * i + 2] = n.z;
    }
  });
  return with_normals(normals);
}

NormalError NormalProbe::with_normals(const std::vector<float>& normals) const {
  Image shown{reference_.width, 1, 3, std::vector<float>(normals.size())};
  parallel_for(places_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float* n = &normals[3 * i];
      encode(Vec3d(n[0], n[1], n[2]) * (places_[i].back ? -1.0 : 1.0), &shown.pixels[3 * i]);
    }
  });
  return compare(shown);
}

NormalError NormalProbe::with_map(const Image& map, NormalMapSpace space, bool flip_y) const {
  std::vector<float> normals(3 * places_.size());
  parallel_for(places_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& corners = surface_.triangles[place.triangle];
      const double w = 1.0 - place.u - place.v;
      const auto& [a, b, c] = corners;
      Vec3d value = texel_at(map, a.uv.x * w + b.uv.x * place.u + c.uv.x * place.v,
                             a.uv.y * w + b.uv.y * place.u + c.uv.y * place.v) *
                        2 +
                    Vec3d(-1, -1, -1);
      if (flip_y) value.y = -value.y;
      const kiln_low_shading& low = shading_[place.triangle];
      const Vec3d face = vector_at(low.face_normal);
      Vec3d normal = value;
      if (space != NormalMapSpace::object) {
        Vec3d n = face, t = vector_at(low.face_tangent);
        double sign = 1;
        if (space == NormalMapSpace::tangent) {
          n = blend(a.normal, b.normal, c.normal, place.u, place.v);
          t = blend(a.tangent, b.tangent, c.tangent, place.u, place.v);
          sign = low.sign;
        }
        normal = t * value.x + cross(n, t) * (sign * value.y) + n * value.z;
      }
      if (!(length(normal) > 0)) normal = face;
      const Vec3 result = to_float(normal);
      normals[3 * i] = result.x;
      normals[3 * i + 1] = result.y;
      normals[3 * i + 2] = result.z;
    }
  });
  return with_normals(normals);
}

void NormalProbe::match_places(const BakeOptions& options,
                               std::shared_ptr<const VisibilityField>& field,
                               Correspondence& match) const {
  BakeReport report;
  Clusters clusters{0, field};
  const EdgeTurn turn = edge_turn(options, source_, surface_);
  const std::unique_ptr<Matcher> matcher = make_matcher(
      source_, surface_, options, report, clusters, BakeProgress(options.progress), turn.turns());
  field = clusters.field;
  const SheetReach sheets = sheet_reach(options, surface_);
  if (!turn.turns() && !(sheets.farthest() > 0)) {
    matcher->run(band_, match);
    return;
  }
  TexelBand turned = band_of(places_);
  turn.apply(source_.device.context(), turned);
  sheets.apply(source_.device.context(), turned);
  matcher->run(turned, match);
}

/// The matcher by UVs finds points for the samples of a map, but the places lie between those.
void NormalProbe::match_by_uv(const BakeOptions& options,
                              std::shared_ptr<const VisibilityField>& field,
                              Correspondence& match) const {
  const std::size_t count = places_.size();
  std::vector<Vec2> uvs(count);
  parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places_[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      const double w = 1.0 - place.u - place.v;
      uvs[i] = {static_cast<float>(a.uv.x * w + b.uv.x * place.u + c.uv.x * place.v),
                static_cast<float>(a.uv.y * w + b.uv.y * place.u + c.uv.y * place.v)};
    }
  });
  UvPoints found = find_uv_points(source_, uvs);
  std::vector<std::uint8_t> status(count, KILN_STATUS_UV);
  bool missed = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (found.triangle[i] != KILN_NO_TRIANGLE) continue;
    status[i] = KILN_STATUS_MISS;
    missed = true;
  }
  cl::Context& context = source_.device.context();
  context.fill(match.distance, 0.0F);
  if (missed && !options.fallback.empty()) {
    BakeOptions rest = options;
    rest.method = options.fallback.front();
    rest.fallback.erase(rest.fallback.begin());
    rest.fallback_blend = 0;
    match_places(rest, field, match);
    const std::vector<std::uint32_t> triangle = match.triangle.download(context);
    const std::vector<float> barycentric = match.barycentric.download(context);
    const std::vector<std::uint8_t> rest_status = match.status.download(context);
    for (std::size_t i = 0; i < count; ++i) {
      if (status[i] != KILN_STATUS_MISS) continue;
      status[i] = rest_status[i];
      found.triangle[i] = triangle[i];
      found.barycentric[i] = barycentric[i];
      found.barycentric[i + count] = barycentric[i + count];
    }
  }
  match.triangle.write(context, std::span<const std::uint32_t>(found.triangle));
  match.barycentric.write(context, std::span<const float>(found.barycentric));
  match.status.write(context, std::span<const std::uint8_t>(status));
}

NormalProbe::Limit NormalProbe::limit(const BakeOptions& options,
                                      std::shared_ptr<const VisibilityField>& field) const {
  Limit result;
  if (places() == 0) return result;
  cl::Context& context = source_.device.context();
  BakeOptions in_space = options;
  in_space.space = NormalMapSpace::object;
  in_space.flip_y = in_space.two_component = false;
  in_space.miss = MissPolicy::keep;
  Correspondence match(context, band_.capacity);
  match.count = band_.sample_count;
  if (options.method == MatchMethod::uv) {
    match_by_uv(in_space, field, match);
  } else {
    match_places(in_space, field, match);
  }
  NormalDetail detail(context, surface_, source_.attributes, in_space);
  cl::Array<float> image(context, std::size_t{3} * places());
  cl::Array<std::uint8_t> coverage(context, places());
  context.fill(image, 0.0F);
  context.fill(coverage, std::uint8_t{0});
  detail.run(band_, match, image, coverage);
  result.normals = image.download(context);
  result.error = with_normals(result.normals);
  const std::vector<std::uint8_t> status = match.status.download(context);
  result.missed = static_cast<double>(std::count(status.begin(), status.begin() + places(),
                                                 std::uint8_t{KILN_STATUS_MISS})) /
                  places();
  return result;
}

double NormalProbe::least_share(const Limit& limit) const {
  constexpr std::size_t kPlaces = 2048;
  constexpr double kLeastCosine = 0.05;
  if (places() == 0) return 1;
  const std::size_t step = (places_.size() + kPlaces - 1) / kPlaces;
  struct Look {
    std::size_t place = 0;
    double cosine = 0;
    Vec3d toward, at;
    double distance = 0;  // from where the ray starts to the place
  };
  std::vector<Look> looks;
  for (const Vec3d& toward : toward_) {
    for (std::size_t i = 0; i < places_.size(); i += step) {
      const Place& place = places_[i];
      const auto& [a, b, c] = surface_.triangles[place.triangle];
      const Vec3d normal = vector_at(shading_[place.triangle].face_normal);
      const double cosine = dot(normal, toward) * (place.back ? -1 : 1);
      if (cosine < kLeastCosine) continue;
      const Vec3d at = blend(a.position, b.position, c.position, place.u, place.v);
      looks.push_back({i / step, cosine, toward, at, start_ - dot(at, toward)});
    }
  }
  const auto count = static_cast<std::uint32_t>(looks.size());
  if (count == 0) return 1;
  std::vector<float> points(std::size_t{7} * count, 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = to_float(looks[i].at + looks[i].toward * looks[i].distance);
    const Vec3 d = to_float(looks[i].toward * -1.0);
    const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
    for (std::size_t c = 0; c < 6; ++c) points[c * count + i] = values[c];
  }
  cl::Context& context = source_.device.context();
  const cl::Array<float> device_points(context, std::span<const float>(points));
  Correspondence match(context, count);
  RayQuery query;
  query.t_max = static_cast<float>(2 * start_);
  query.two_sided = true;
  light_.intersect(device_points, count, count, query, match);
  std::vector<float> distance(count);
  match.distance.read(context, distance);
  source_.rays().intersect(device_points, count, count, query, match);
  const std::vector<std::uint32_t> triangle = match.triangle.download(context);
  const std::vector<float> barycentric = match.barycentric.download(context);
  const std::vector<std::uint32_t>& normal_indices =
      reads_.read_source(source_.attributes.normal_indices);
  const std::vector<float>& normals = reads_.read_source(source_.attributes.normals);

  std::vector<std::vector<std::pair<Vec3d, double>>> seen(kPlaces);
  for (std::size_t i = 0; i < count; ++i) {
    const Look& look = looks[i];
    // Hidden by another part of the light mesh?
    if (distance[i] < look.distance - 1e-4 * start_ || triangle[i] == KILN_NO_TRIANGLE) continue;
    const std::size_t t = triangle[i];
    std::array<Vec3d, 3> corner, shading;
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = Vec3d(source_.positions[source_.triangles[t][k]]);
      const float* n = &normals[3 * std::size_t{normal_indices[3 * t + k]}];
      shading[k] = Vec3d(n[0], n[1], n[2]);
    }
    const Vec3d face = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const float u = barycentric[i], v = barycentric[i + count];
    const Vec3d sum = shading[0] * (1.0 - u - v) + shading[1] * u + shading[2] * v;
    const double size = length(sum);
    if (!(size > 0)) continue;
    const double side = dot(face, look.toward) < 0 ? -1 : 1;
    seen[look.place].emplace_back(sum * (side / size), look.cosine);
  }
  const auto mean_angle = [](const Vec3d& normal, const auto& directions) {
    double sum = 0, weights = 0;
    for (const auto& [n, weight] : directions) {
      sum += weight * std::atan2(length(cross(normal, n)), dot(normal, n));
      weights += weight;
    }
    return sum / weights;
  };
  double least = 0, found = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const auto& directions = seen[i];
    if (directions.empty()) continue;
    const std::size_t place = i * step;
    const float* own = &limit.normals[3 * place];
    const double own_error =
        mean_angle(Vec3d(own[0], own[1], own[2]) * (places_[place].back ? -1.0 : 1.0), directions);
    // The direction of least mean angle: that of least squares, then by Weiszfeld's iteration.
    Vec3d best;
    for (const auto& [n, weight] : directions) best += n * weight;
    double error = own_error;
    for (int round = 0; round < 8 && length(best) > 0; ++round) {
      best = best * (1 / length(best));
      error = std::min(error, mean_angle(best, directions));
      Vec3d next;
      for (const auto& [n, weight] : directions) {
        const double angle = std::atan2(length(cross(best, n)), dot(best, n));
        next += n * (weight / std::max(angle, 1e-4));
      }
      best = next;
    }
    least += error;
    found += own_error;
  }
  return found > 0 ? least / found : 1;
}

}  // namespace kiln
