// Computes visibility from depth views, and collects the occluders.
#include <algorithm>
#include <cmath>

#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"
#include "shared/visibility.h"

namespace kiln {
namespace {

// Number of views that have the same error as one ray per sample, for up to kMaxRaysAsViews rays
// (measured on the bunny, tools/bench/README.md). With more rays, the views' resolution limits the
// error.
constexpr std::uint32_t kViewsPerRay = 2, kMaxRaysAsViews = 64, kMinViews = 16;
// Cost of a view, in units of the cost of one ray: a constant, plus an amount per triangle and per
// sample. Views are chosen if they cost less than kMaxCostShare of the rays.
constexpr double kCostOfView = 10000, kCostOfTriangle = 0.15, kCostOfSample = 0.125,
                 kMaxCostShare = 0.7;

/// Estimated number of samples that the low poly covers, from its area in UV space.
double samples_of(const BakeOptions& options, const LowSurface& surface) {
  double area = 0;
  for (const std::size_t t : surface.usable_triangles()) {
    const auto& [a, b, c] = surface.triangles[t];
    area += std::abs((double{b.uv.x} - a.uv.x) * (double{c.uv.y} - a.uv.y) -
                     (double{c.uv.x} - a.uv.x) * (double{b.uv.y} - a.uv.y)) /
            2;
  }
  return std::min(area, 1.0) * options.width * options.height * options.samples * options.samples;
}

}  // namespace

bool may_use_views(const OcclusionOptions& occlusion) {
  if (occlusion.by != OcclusionBy::automatic) return occlusion.by == OcclusionBy::views;
  return !occlusion.distance && occlusion.falloff == OcclusionFalloff::none &&
         occlusion.back_faces && !(occlusion.max_error > 0) && occlusion.rays <= kMaxRaysAsViews;
}

std::uint32_t views_for(const MapRequest& request) {
  const OcclusionOptions& occlusion = request.options.occlusion;
  if (!may_use_views(occlusion)) return 0;
  if (occlusion.by == OcclusionBy::views) return occlusion.views;
  const double samples = samples_of(request.options, request.surface);
  double triangles = 0;
  if (occlusion.by_high) triangles += static_cast<double>(request.source.triangles.size());
  if (occlusion.by_low) triangles += static_cast<double>(request.surface.triangles.size());
  for (const Mesh* mesh : occlusion.by_others) {
    triangles += static_cast<double>(mesh->triangles.size());
  }
  const std::uint32_t views = std::max(kMinViews, kViewsPerRay * occlusion.rays);
  const double by_views =
      views * (kCostOfView + kCostOfTriangle * triangles + kCostOfSample * samples);
  return by_views < kMaxCostShare * occlusion.rays * samples ? views : 0;
}

Hemispheres::OccluderCaster Hemispheres::caster_of_all_occluders() const {
  OccluderCaster occluders_of_all;
  const auto add = [&](std::span<const Vec3> points, std::span<const Triangle> faces) {
    const auto first = static_cast<std::uint32_t>(occluders_of_all.positions.size());
    occluders_of_all.positions.insert(occluders_of_all.positions.end(), points.begin(),
                                      points.end());
    for (const Triangle& t : faces) {
      occluders_of_all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  };
  if (by_high_ && !source_.is_streamed()) add(source_.positions, source_.triangles);
  for (const Mesh& other : other_occluders_) add(other.positions, other.triangles);
  for (std::size_t i = 0; by_low_ && i < surface_.triangles.size(); ++i) {
    if (surface_.usable[i] == 0) continue;
    const auto& [a, b, c] = surface_.triangles[i];
    const std::array<Vec3, 3> points{a.position, b.position, c.position};
    const std::array<Triangle, 1> face{Triangle{0, 1, 2}};
    add(points, face);
  }
  return occluders_of_all;
}

Hemispheres::Occluders Hemispheres::occluders() {
  const bool others = by_low_ || !other_occluders_.empty();
  if (others && !all_occluders_) {
    const OccluderCaster occluders_of_all = caster_of_all_occluders();
    all_occluders_.emplace(context_, occluders_of_all.positions, occluders_of_all.triangles,
                           source_.traversal);
  }
  const RayCaster* const in_memory = all_occluders_ ? &*all_occluders_ : nullptr;
  if (by_high_ && source_.is_streamed()) {
    return {.high = &source_.occluder_search(), .others = in_memory};
  }
  return {.whole = in_memory != nullptr ? in_memory : &source_.rays()};
}

void Hemispheres::gather_views(const TexelBand& band, const DeviceCorrespondence& match,
                               bool second) {
  Sums& sums = sums_[second ? 1 : 0];
  if (sums.has_open_counts) return;
  if (!views_) {
    OccluderCaster occluders_of_all = caster_of_all_occluders();
    views_.emplace(context_, std::move(occluders_of_all.positions), occluders_of_all.triangles,
                   view_directions_, HemisphereViews::size_for(width_, height_), source_.traversal);
  }
  const std::uint32_t capacity = (band.sample_count + KILN_VISIBILITY_SAMPLES - 1) /
                                 KILN_VISIBILITY_SAMPLES * KILN_VISIBILITY_SAMPLES;
  const cl::Array<float> points(context_, std::size_t{KILN_HEMISPHERE_PLANES} * capacity);
  const cl::Array<float> view_sums(context_, std::size_t{KILN_HEMISPHERE_VIEW_SUMS} * capacity);
  context_.fill(view_sums, 0.0F);
  if (needs_bent_sum_) {
    make_room(context_, sums.bent_sum, std::size_t{3} * std::max(plane_of(band), capacity));
    context_.fill(sums.bent_sum, 0.0F);
  }
  upload();
  kiln_hemisphere_params params = ray_params(band, match, second, rays_out_);
  params.count = band.sample_count;
  params.stride = params.plane = capacity;
  params.push = 1;
  make_points(params, band, match, points);
  views_->add(points, band.sample_count, capacity, view_sums, sums.bent_sum, plane_of(band));
  sums.view_sums.resize(std::size_t{KILN_HEMISPHERE_VIEW_SUMS} * band.sample_count);
  for (std::size_t p = 0; p < KILN_HEMISPHERE_VIEW_SUMS; ++p) {
    view_sums.read(context_,
                   std::span(sums.view_sums).subspan(p * band.sample_count, band.sample_count),
                   p * capacity);
  }
  sums.has_open_counts = true;
}

OcclusionReport Hemispheres::report() const {
  if (view_directions_ == 0) return {};
  return {OcclusionBy::views, view_directions_, HemisphereViews::size_for(width_, height_)};
}

/// The views with even numbers and those with odd numbers give two estimates of each texel, which
/// are smoothed over the surface and across seams wherever that loses no detail.
std::vector<float> Hemispheres::visibility_by_views(const TexelBand& band,
                                                    const DeviceCorrespondence& match,
                                                    bool second) {
  gather_views(band, match, second);
  const std::vector<float>& view_sums = sums_[second ? 1 : 0].view_sums;
  const std::size_t plane = band.sample_count;
  std::vector<float> shares(plane);
  const TexelSamples texel_samples = prepare_filter(band, match, second);
  const std::size_t texels = texel_samples.first.size() - 1;
  if (texels == 0) return shares;
  std::vector<float> pairs(2 * texels);
  for (std::size_t t = 0; t < texels; ++t) {
    for (std::size_t estimate = 0; estimate < 2; ++estimate) {
      double open = 0, all = 0;
      for (std::size_t s = texel_samples.first[t]; s < texel_samples.first[t + 1]; ++s) {
        open += view_sums[estimate * plane + texel_samples.samples[s]];
        all += view_sums[(2 + estimate) * plane + texel_samples.samples[s]];
      }
      pairs[2 * t + estimate] = all > 0 ? static_cast<float>(open / all) : 0.0F;
    }
  }
  const AoDenoiser::Result smooth = denoiser_->run(pairs);
  for (std::size_t t = 0; t < texels; ++t) {
    for (std::size_t s = texel_samples.first[t]; s < texel_samples.first[t + 1]; ++s) {
      shares[texel_samples.samples[s]] = smooth.shares[t];
    }
  }
  return shares;
}

}  // namespace kiln
