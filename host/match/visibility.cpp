#include "match/visibility.h"

#include <algorithm>
#include <cmath>

#include "accel/depth_views.h"
#include "accel/raster.h"
#include "accel/ray.h"
#include "base/parallel.h"
#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"

namespace kiln {
namespace {

// A batch of this size takes tenths of a second on two cores
constexpr std::uint32_t kViewsPerBatch = 32;
constexpr std::uint32_t kMaxDirections = 4096;
// Distance of ray starts from their point, in frame units: at the smallest visible cosine it exceeds the rounding
// error of the point's own face.
constexpr float kVisibilityRayOffset = 1.0F / 65536;
// Depth tolerance in pixels: a face hides a point only if it is nearer to the viewer by more than this, so that
// neighbouring faces in the same pixel do not hide it.
constexpr float kDepthBiasPixels = 0.5F;
constexpr const char* kStoreSeenDefine = "-DKILN_VISIBILITY_SEEN=1";

[[noreturn]] void throw_usage_error(const std::string& message) {
  throw Error(ErrorCode::usage, message);
}

Vec3d unit(const Vec3d& v) {
  const double size = length(v);
  return size > 0 ? v * (1 / size) : Vec3d{0, 0, 0};
}

Vec3d face_normal(const std::array<LowSurface::Corner, 3>& corners) {
  const Vec3d a = to_double(corners[0].position);
  return unit(cross(to_double(corners[1].position) - a, to_double(corners[2].position) - a));
}

}  // namespace

void check_visibility(const VisibilityOptions& options) {
  if (options.directions < 1 || options.directions > kMaxDirections) {
    throw_usage_error("The number of directions that are tested for visibility is " +
                      std::to_string(options.directions) + ": it must be 1 to " +
                      std::to_string(kMaxDirections) + ".");
  }
  if (options.view_size < 16 || options.view_size > 2048) {
    throw_usage_error("The size of the pictures that find visible directions is " +
                      std::to_string(options.view_size) + ": it must be 16 to 2048 pixels.");
  }
  if (options.smoothing > 256) {
    throw_usage_error("The number of smoothing passes is " + std::to_string(options.smoothing) +
                      ": it must be 0 to 256.");
  }
  if (options.clusters < 1 || options.clusters > 4) {
    throw_usage_error("The number of clusters is " + std::to_string(options.clusters) +
                      ": it must be 1 to 4.");
  }
  if (options.clusters > 1 && options.at != VisibilityAt::texel) {
    throw_usage_error(
        "Clusters of directions are for visibility at texels: choose that, or one cluster.");
  }
  if (!(options.cluster_deviation >= 0 && options.cluster_deviation <= 1)) {
    throw_usage_error(
        "The standard deviation above which a texel's directions are split into clusters is " +
        std::to_string(options.cluster_deviation) + ": it must be 0 to 1.");
  }
  if (options.likelihood != ViewLikelihood::list) return;
  if (options.likelihoods.empty()) {
    throw_usage_error("The list of likely views is empty: give at least one direction.");
  }
  for (const VisibilityOptions::Likelihood& entry : options.likelihoods) {
    const double size = length(to_double(entry.direction));
    if (!(size > 0) || !std::isfinite(size) || !(entry.weight >= 0) ||
        !std::isfinite(entry.weight)) {
      throw_usage_error(
          "A likely view needs a direction of finite length above 0, and a finite weight of 0 or "
          "more.");
    }
  }
}

std::vector<ProbeDirection> probe_directions(const VisibilityOptions& options) {
  std::vector<ProbeDirection> result;
  // largest weight of the list, by which all weights are divided so that sums do not overflow
  double max_weight = 0;
  for (const VisibilityOptions::Likelihood& entry : options.likelihoods) {
    max_weight = std::max(max_weight, entry.weight);
  }
  for (const Vec3d& toward : spread_directions(options.directions)) {
    double weight = 1;
    if (options.likelihood == ViewLikelihood::horizon) weight = 1 - toward.y * toward.y;
    if (options.likelihood == ViewLikelihood::up) weight = 0.5 + 0.5 * toward.y;
    if (options.likelihood == ViewLikelihood::list) {
      double best = -2;
      for (const VisibilityOptions::Likelihood& entry : options.likelihoods) {
        const double cosine = dot(unit(to_double(entry.direction)), toward);
        if (cosine > best) {
          best = cosine;
          weight = max_weight > 0 ? entry.weight / max_weight : 0;
        }
      }
    }
    if (weight > 1e-9) result.push_back({toward, static_cast<float>(weight)});
  }
  if (result.empty()) {
    throw_usage_error(
        "All views have the weight 0. Each probing direction takes the weight of the nearest "
        "listed "
        "direction: give at least one of these a weight above 0.");
  }
  return result;
}

struct VisibilityProbe::Impl {
  cl::Context& context;
  std::vector<ProbeDirection> directions;
  std::uint32_t view_size;
  Traversal traversal;
  // Scale that brings all points of the surface within a distance of 0.5 of the origin
  float scale = 1;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  cl::Array<float> normals;
  std::unique_ptr<Rasterizer> raster;
  std::unique_ptr<RayCaster> rays;
  // The views of one batch.
  std::vector<kiln_view> views;
  cl::Array<kiln_view> device_views;
  cl::Array<float> weights;
  DepthKeys keys;
  ShareCallback report_share;

  /// Reports the progress that is reached before the direction with this index.
  void poll(std::size_t next) const {
    if (!report_share) return;
    context.finish();
    const double completed = static_cast<double>(next) / static_cast<double>(directions.size());
    if (!report_share(completed)) throw Cancelled{};
  }

  Impl(cl::Context& opened, std::vector<ProbeDirection> probed, std::uint32_t size,
       Traversal requested)
      : context(opened),
        directions(std::move(probed)),
        view_size(size),
        traversal(choose_traversal(opened, requested)) {}

  kiln_visibility_params params(const ProbedPoints& probed) const {
    kiln_visibility_params params{};
    params.count = probed.count;
    params.capacity = probed.capacity;
    params.view_size = view_size;
    return params;
  }

  Rasterizer& rasterizer() {
    if (raster == nullptr) raster = std::make_unique<Rasterizer>(context, positions, triangles);
    return *raster;
  }

  /// Uploads the views of a batch that starts at direction `first`.
  void choose_views(std::size_t first, std::size_t count) {
    poll(first);
    const auto pixels = static_cast<std::uint32_t>(DepthKeys::count(view_size, view_size));
    views.clear();
    std::vector<float> likely_views;
    for (std::size_t k = first; k < std::min(directions.size(), first + count); ++k) {
      kiln_view view = make_view(directions[k].toward, rasterizer().radius(), view_size);
      view.first = pixels * static_cast<std::uint32_t>(k - first);
      view.flags = KILN_RASTER_TWO_SIDED;  // the back of an open mesh hides faces behind it
      views.push_back(view);
      likely_views.push_back(directions[k].weight);
    }
    context.finish();  // Waits for the kernels of the previous batch, which still read the arrays
    if (device_views.size() < views.size()) {
      device_views = cl::Array<kiln_view>(context, views.size());
      weights = cl::Array<float>(context, views.size());
    }
    device_views.write(context, views);
    weights.write(context, likely_views);
  }

  void draw() {
    const std::uint64_t count = DepthKeys::count(view_size, view_size) * views.size();
    if (keys.keys.size() < count) keys = DepthKeys(context, count);
    rasterizer().draw(views, keys);
  }

  std::size_t batch() const {
    return std::min(DepthViews::batch_size(context, view_size), kViewsPerBatch);
  }
};

VisibilityProbe::VisibilityProbe(cl::Context& context, const LowSurface& surface,
                                 std::vector<ProbeDirection> directions, std::uint32_t view_size,
                                 Traversal traversal)
    : impl_(std::make_unique<Impl>(context, std::move(directions), view_size, traversal)) {
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  impl_->positions.resize(topology.vertex_count);
  double radius = 0;
  std::vector<Vec3> normals(surface.triangles.size());
  impl_->triangles.resize(surface.triangles.size());
  for (const std::size_t t : surface.usable_triangles()) {
    normals[t] = to_float(face_normal(surface.triangles[t]));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& position = surface.triangles[t][k].position;
      impl_->triangles[t][k] = topology.vertices[t][k];
      impl_->positions[topology.vertices[t][k]] = position;
      radius = std::max(radius, length(to_double(position)));
    }
  }
  // The scale is a power of two, so that scaling is exact.
  if (radius > 0) {
    int scale_exponent = 0;
    std::frexp(radius, &scale_exponent);
    impl_->scale = static_cast<float>(std::ldexp(0.5, -scale_exponent));
  }
  for (Vec3& p : impl_->positions) {
    p = {p.x * impl_->scale, p.y * impl_->scale, p.z * impl_->scale};
  }
  impl_->normals =
      cl::Array<float>(context, std::span<const float>(&normals[0].x, normals.size() * 3));
}

VisibilityProbe::~VisibilityProbe() = default;
VisibilityProbe::VisibilityProbe(VisibilityProbe&&) noexcept = default;

void VisibilityProbe::set_progress(ShareCallback report_share) {
  impl_->report_share = std::move(report_share);
}

const std::vector<ProbeDirection>& VisibilityProbe::directions() const { return impl_->directions; }

void VisibilityProbe::allocate_seen(ProbedPoints& probed) const {
  if (probed.count == 0) return;
  const std::size_t words_per_point = (impl_->directions.size() + 31) / 32;
  probed.seen = cl::Array<std::int32_t>(impl_->context, words_per_point * probed.capacity);
  impl_->context.fill(probed.seen, std::int32_t{0});
}

const cl::Array<float>& VisibilityProbe::normals() const { return impl_->normals; }

VisibilityProbe::ProbedPoints VisibilityProbe::make_points(const TexelBand& band) const {
  cl::Context& context = impl_->context;
  ProbedPoints probed;
  probed.count = band.sample_count;
  probed.capacity = (band.sample_count + KILN_VISIBILITY_SAMPLES - 1) / KILN_VISIBILITY_SAMPLES *
                    KILN_VISIBILITY_SAMPLES;
  if (probed.count == 0) return probed;
  probed.points = cl::Array<float>(context, std::size_t{6} * probed.capacity);
  probed.sums = cl::Array<float>(context, std::size_t{4} * probed.capacity);
  context.fill(probed.points, 0.0F);
  context.fill(probed.sums, 0.0F);
  kiln_visibility_params params = impl_->params(probed);
  params.capacity = band.capacity;
  params.out_capacity = probed.capacity;
  params.scale = impl_->scale;
  context.launch(context.kernel("visibility", "kiln_visibility_prepare"), probed.count, kLocal,
                 params, band.triangle, impl_->normals, band.points, probed.points);
  return probed;
}

VisibilityProbe::ProbedPoints VisibilityProbe::make_points(std::span<const Vec3> positions,
                                                           std::span<const Vec3> normals) const {
  cl::Context& context = impl_->context;
  ProbedPoints probed;
  probed.count = static_cast<std::uint32_t>(positions.size());
  probed.capacity = (probed.count + KILN_VISIBILITY_SAMPLES - 1) / KILN_VISIBILITY_SAMPLES *
                    KILN_VISIBILITY_SAMPLES;
  if (probed.count == 0) return probed;
  std::vector<float> planes(std::size_t{6} * probed.capacity, 0.0F);
  const std::size_t plane = probed.capacity;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    planes[i] = positions[i].x * impl_->scale;
    planes[i + plane] = positions[i].y * impl_->scale;
    planes[i + 2 * plane] = positions[i].z * impl_->scale;
    planes[i + 3 * plane] = normals[i].x;
    planes[i + 4 * plane] = normals[i].y;
    planes[i + 5 * plane] = normals[i].z;
  }
  probed.points = cl::Array<float>(context, std::span<const float>(planes));
  probed.sums = cl::Array<float>(context, std::size_t{4} * probed.capacity);
  context.fill(probed.sums, 0.0F);
  return probed;
}

void VisibilityProbe::add_directions_by_views(ProbedPoints& probed) {
  if (probed.count == 0) return;
  cl::Context& context = impl_->context;
  const bool is_scalar = impl_->traversal == Traversal::gpu;
  std::string defines = is_scalar ? "-DKILN_VISIBILITY_SCALAR=1" : "";
  if (!probed.seen.empty()) defines += (is_scalar ? " " : "") + std::string(kStoreSeenDefine);
  const std::uint32_t pixels = impl_->view_size * impl_->view_size;
  cl::Array<float> depths;
  for (std::size_t first = 0; first < impl_->directions.size(); first += impl_->batch()) {
    impl_->choose_views(first, impl_->batch());
    impl_->draw();
    const auto count = static_cast<std::uint32_t>(impl_->views.size());
    if (depths.empty()) depths = cl::Array<float>(context, std::size_t{pixels} * count);
    kiln_visibility_params params = impl_->params(probed);
    params.count = pixels * count;
    context.launch(context.kernel("visibility", "kiln_visibility_unpack_depths"), params.count,
                   kLocal, params, impl_->device_views, impl_->keys.keys, impl_->keys.drawn,
                   depths);
    params.count = probed.count;
    params.view_count = count;
    params.bias = kDepthBiasPixels / impl_->views[0].scale;
    params.first_direction = static_cast<std::uint32_t>(first);
    const cl::Kernel add = context.kernel("visibility", "kiln_visibility_add_to_samples", defines);
    const std::size_t work_items =
        is_scalar ? probed.count : probed.capacity / KILN_VISIBILITY_SAMPLES;
    if (probed.seen.empty()) {
      context.launch(add, work_items, kLocal, params, impl_->device_views, impl_->weights, depths,
                     probed.points, probed.sums);
    } else {
      context.launch(add, work_items, kLocal, params, impl_->device_views, impl_->weights, depths,
                     probed.points, probed.sums, probed.seen);
    }
  }
  context.finish();
}

void VisibilityProbe::add_directions_by_rays(ProbedPoints& probed) {
  if (probed.count == 0) return;
  cl::Context& context = impl_->context;
  if (impl_->rays == nullptr) {
    impl_->rays =
        std::make_unique<RayCaster>(context, impl_->positions, impl_->triangles, impl_->traversal);
  }
  RayQuery query;
  query.t_min = kVisibilityRayOffset;
  query.t_max = 4;
  query.two_sided = true;
  // Positions and directions in the ray caster's layout.
  cl::Array<float> rays(context, std::size_t{7} * probed.capacity);
  const std::vector<float> points = probed.points.download(context);
  rays.write(context, points);
  cl::Array<std::uint8_t> is_hidden(context, probed.capacity);
  kiln_visibility_params params = impl_->params(probed);
  const cl::Kernel set_directions_kernel =
      context.kernel("visibility", "kiln_visibility_set_ray_directions");
  const cl::Kernel add = context.kernel("visibility", "kiln_visibility_add_view",
                                        probed.seen.empty() ? "" : kStoreSeenDefine);
  for (std::size_t first = 0; first < impl_->directions.size(); first += impl_->batch()) {
    impl_->choose_views(first, impl_->batch());
    for (std::uint32_t k = 0; k < impl_->views.size(); ++k) {
      if (k % 4 == 0) impl_->poll(first + k);
      context.launch(set_directions_kernel, probed.count, kLocal, params, impl_->device_views, k,
                     probed.points, rays);
      impl_->rays->occluded(rays, probed.count, probed.capacity, query, is_hidden);
      params.first_direction = static_cast<std::uint32_t>(first);
      const float weight = impl_->directions[first + k].weight;
      if (probed.seen.empty()) {
        context.launch(add, probed.count, kLocal, params, impl_->device_views, k, weight,
                       probed.points, is_hidden, probed.sums);
      } else {
        context.launch(add, probed.count, kLocal, params, impl_->device_views, k, weight,
                       probed.points, is_hidden, probed.sums, probed.seen);
      }
    }
  }
  context.finish();
}

std::vector<float> VisibilityProbe::corners() {
  cl::Context& context = impl_->context;
  cl::Array<float> sums(context, 12 * impl_->triangles.size());
  context.fill(sums, 0.0F);
  kiln_visibility_params params{};
  params.count = static_cast<std::uint32_t>(impl_->triangles.size());
  params.view_size = impl_->view_size;
  for (std::size_t first = 0; first < impl_->directions.size(); first += impl_->batch()) {
    impl_->choose_views(first, impl_->batch());
    impl_->draw();
    params.view_count = static_cast<std::uint32_t>(impl_->views.size());
    context.launch(context.kernel("visibility", "kiln_visibility_add_to_corners"), params.count,
                   kLocal, params, impl_->device_views, impl_->weights, impl_->keys.keys,
                   impl_->keys.drawn, impl_->rasterizer().triangles(),
                   impl_->rasterizer().positions(), sums);
  }
  return sums.download(context);
}

}  // namespace kiln
