#include "detail/hemisphere_views.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "accel/depth_views.h"
#include "accel/ray.h"
#include "mesh/usable.h"
#include "shared/visibility.h"

namespace kiln {
namespace {

// Maximum number of views drawn together. Limits memory to 64 MiB of keys and 32 MiB of depths.
constexpr std::uint32_t kViewsPerBatch = 32;
// Depth bias in pixels: a surface hides a sample only if it is nearer by more than this, since the
// sample's own surface varies in depth within a pixel.
constexpr float kBiasPixels = 0.5F;

// Bounds of a view's side in pixels. Between them, a view has about the map's resolution.
constexpr std::uint32_t kMinViewPixels = 256, kMaxViewPixels = 512;

}  // namespace

std::uint32_t HemisphereViews::size_for(std::uint32_t width, std::uint32_t height) {
  return std::bit_ceil(std::clamp(std::max(width, height), kMinViewPixels, kMaxViewPixels));
}

HemisphereViews::HemisphereViews(cl::Context& context, std::vector<Vec3> positions,
                                 std::span<const Triangle> triangles, std::uint32_t directions,
                                 std::uint32_t size, Traversal traversal)
    : context_(context),
      size_(size),
      uses_scalar_kernel_(choose_traversal(context, traversal) == Traversal::gpu) {
  double radius = 0;
  for (const Vec3& p : positions) {
    if (is_finite(p)) radius = std::max(radius, length(to_double(p)));
  }
  int scale_exponent = 0;
  std::frexp(radius, &scale_exponent);
  // The scale is a power of two, so that scaling is exact
  if (radius > 0.5) scale_ = static_cast<float>(std::ldexp(0.5, -scale_exponent));
  for (Vec3& p : positions) p = {p.x * scale_, p.y * scale_, p.z * scale_};
  rasterizer_.emplace(context, positions, triangles);
  for (const Vec3d& view_direction : spread_directions(directions)) {
    kiln_view view = make_view(view_direction, rasterizer_->radius(), size_);
    view.flags = KILN_RASTER_TWO_SIDED;
    views_.push_back(view);
  }
}

void HemisphereViews::add(const cl::Array<float>& points, std::uint32_t count,
                          std::uint32_t capacity, const cl::Array<float>& sums,
                          const cl::Array<float>& bent_sum, std::uint32_t bent_sum_plane) {
  const std::uint64_t pixels = DepthKeys::count(size_, size_);
  const std::uint32_t batch =
      std::min({DepthViews::batch_size(context_, size_), kViewsPerBatch, directions()});
  if (view_depths_.empty()) {
    depth_keys_ = DepthKeys(context_, pixels * batch);
    view_depths_ = cl::Array<float>(context_, std::size_t{size_} * size_ * batch);
  }
  std::string build_defines = uses_scalar_kernel_ ? "-DKILN_VISIBILITY_SCALAR=1" : "";
  if (!bent_sum.empty())
    build_defines += (uses_scalar_kernel_ ? " " : "") + std::string("-DKILN_HEMISPHERE_BENT_SUM=1");
  const cl::Kernel add =
      context_.kernel("hemisphere_views", "kiln_hemisphere_add_views", build_defines);
  const cl::Kernel depths =
      context_.kernel("hemisphere_views", "kiln_hemisphere_unpack_depths", build_defines);
  for (std::uint32_t first = 0; first < directions(); first += batch) {
    const std::uint32_t batch_size = std::min(batch, directions() - first);
    const std::span<kiln_view> views = std::span(views_).subspan(first, batch_size);
    for (std::uint32_t k = 0; k < batch_size; ++k) {
      views[k].first = static_cast<std::uint32_t>(pixels) * k;
    }
    const cl::Array<kiln_view> on_device(context_, std::span<const kiln_view>(views));
    rasterizer_->draw(views, depth_keys_);
    kiln_hemisphere_views_params params{};
    params.count = count;
    params.capacity = capacity;
    params.bent_sum_plane = bent_sum_plane;
    params.view_count = batch_size;
    params.view_size = size_;
    params.first_view = first;
    params.bias = kBiasPixels / views[0].scale;
    params.scale = scale_;
    const std::size_t rows = std::size_t{size_} * KILN_RASTER_TILES(size_) * batch_size;
    context_.launch(depths, rows, kLocal, params, on_device, depth_keys_.keys, depth_keys_.drawn,
                    view_depths_);
    const std::size_t work_items = uses_scalar_kernel_ ? count : capacity / KILN_VISIBILITY_SAMPLES;
    if (bent_sum.empty()) {
      context_.launch(add, work_items, kLocal, params, on_device, view_depths_, points, sums);
    } else {
      context_.launch(add, work_items, kLocal, params, on_device, view_depths_, points, sums,
                      bent_sum);
    }
    context_.finish();  // The kernels still read the views, which are freed here
  }
}

}  // namespace kiln
