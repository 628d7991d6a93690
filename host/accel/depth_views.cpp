#include "accel/depth_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "cl/tuning.h"

namespace kiln {
namespace {

// number of bits in the kernel's `excluded_views`
constexpr std::uint32_t kDepthViewsPerLaunch = 64;
// Largest share of the device's memory for the keys of one batch.
constexpr double kMaxMemoryShare = 0.25;

}  // namespace

std::vector<Vec3d> spread_directions(std::uint32_t count) {
  std::vector<Vec3d> result;
  result.reserve(count);
  const double golden_ratio = std::numbers::phi;
  if (count == 12) {
    const double length = std::sqrt(1 + golden_ratio * golden_ratio);
    const double a = 1 / length;
    const double b = golden_ratio / length;
    for (const double s : {1.0, -1.0}) {
      for (const double t : {1.0, -1.0}) {
        result.push_back({0, s * a, t * b});
        result.push_back({s * a, t * b, 0});
        result.push_back({t * b, 0, s * a});
      }
    }
    return result;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * i + 1) / count;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    const double phi = 2 * std::numbers::pi * std::fmod(i / golden_ratio, 1.0);
    result.push_back({r * std::cos(phi), z, r * std::sin(phi)});
  }
  return result;
}

std::uint32_t DepthViews::batch_size(const cl::Context& context, std::uint32_t size) {
  const auto pixels = static_cast<double>(DepthKeys::count(size, size));
  const double key_bytes = 8.0 * pixels;
  const double limit = std::min(static_cast<double>(context.info().largest_buffer_bytes),
                                kMaxMemoryShare * static_cast<double>(context.info().memory_bytes));
  // The number of pixels of a batch must fit 32 bits.
  const double max_views = std::min(limit / key_bytes, 4294967295.0 / pixels);
  return static_cast<std::uint32_t>(std::clamp(max_views, 1.0, double{kDepthViewsPerLaunch}));
}

DepthViews::DepthViews(cl::Context& context, ViewedSurface& surface,
                       const std::vector<Vec3d>& directions, std::uint32_t size, bool two_sided,
                       const ViewArea& area, ViewUse use)
    : context_(context) {
  std::uint32_t first_view = 0;
  for (const Vec3d& toward : directions) {
    kiln_view view = make_view(toward, area.radius, size, area.center);
    view.first = first_view;
    view.flags = two_sided ? KILN_RASTER_TWO_SIDED : 0;
    first_view += static_cast<std::uint32_t>(DepthKeys::count(size, size));
    views_.push_back(view);
  }
  device_views_ = cl::Array<kiln_view>(context, std::span<const kiln_view>(views_));
  batch_keys_ = DepthKeys(context, first_view);
  surface.draw(views_, batch_keys_);
  if (use == ViewUse::match) shown_ = surface.show(batch_keys_);
}

void DepthViews::reset(cl::Context& context, std::uint32_t count, const cl::Array<float>& score,
                       DeviceCorrespondence& result) {
  result.count = count;
  context.fill(score, std::numeric_limits<float>::infinity());
  context.fill(result.triangle, std::uint32_t{KILN_NO_TRIANGLE});
  context.fill(result.barycentric, 0.0F);
  context.fill(result.distance, 0.0F);
  context.fill(result.status, std::uint8_t{KILN_STATUS_MISS});
}

kiln_views_params DepthViews::params(std::uint32_t count, std::uint32_t capacity,
                                     const ViewQuery& query) const {
  kiln_views_params params{};
  params.count = count;
  params.capacity = capacity;
  params.view_count = static_cast<std::uint32_t>(views_.size());
  params.criterion = query.criterion == ViewCriterion::depth      ? KILN_VIEWS_DEPTH
                     : query.criterion == ViewCriterion::distance ? KILN_VIEWS_DISTANCE
                                                                  : KILN_VIEWS_ANGLE;
  params.max_distance = query.max_distance;
  params.least_cosine = query.least_cosine;
  params.refine = query.refine ? 1 : 0;
  return params;
}

void DepthViews::match(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                       const ViewQuery& query, const cl::Array<float>& score,
                       DeviceCorrespondence& result) const {
  kiln_views_params values = params(count, capacity, query);
  values.result_capacity = result.capacity;
  const cl::Kernel kernel = context_.kernel("views", "kiln_views_match");
  context_.launch(kernel, count, context_.group_size(kernel, context_.tuning().view_group, kLocal),
                  values, device_views_, batch_keys_.keys, batch_keys_.drawn, shown_->triangles,
                  shown_->positions, shown_->ids, points, score, result.triangle,
                  result.barycentric, result.distance, result.status);
}

void DepthViews::probe(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                       const ViewQuery& query, const cl::Array<float>& quality) const {
  context_.launch(context_.kernel("views", "kiln_views_probe"), count, kLocal,
                  params(count, capacity, query), device_views_, batch_keys_.keys,
                  batch_keys_.drawn, points, quality);
}

}  // namespace kiln
