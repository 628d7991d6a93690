#include <cmath>
#include <limits>
#include <utility>

#include "bake/pipeline.h"
#include "kiln/session.h"
#include "match/view_plan.h"
#include "match/views.h"

namespace kiln {
namespace {

/// Checks options, and removes all maps from them.
BakeOptions options_without_maps(BakeOptions options) {
  check_options(options);
  request_only(options, {});
  options.encoding.mips = false;
  options.match.cage_mesh = nullptr;
  return options;
}

}  // namespace

/// A pipeline for matches that add one view at a time. It keeps its bands, and computes no maps.
struct KILN_HIDDEN ViewSession::Impl {
  Impl(const Source& dense, const Mesh& low_mesh, const BakeOptions& wanted)
      : source(dense),
        low(low_mesh),
        options(options_without_maps(wanted)),
        pipeline({impl_of(source), low, options}, BandStorage::kept) {
    const Source::Impl& high = impl_of(source);
    query = view_query(match_request(options, high, pipeline.surface()));
    Rasterizer& raster = high.raster();
    query.area = view_area(pipeline.surface(), query.max_distance, raster.radius());
    size = options.match.views.size != 0
               ? options.match.views.size
               : choose_view_size(high.triangle_blocks(), query.area.radius, kMaxViewSide).size;
    widen_view_area(query.area, raster.radius(), size);
    pipeline.sample();
    for (PipelineBand& band : pipeline.bands()) {
      const std::uint32_t count = band.texels.sample_count;
      band_scores.emplace_back(pipeline.context(), count);
      if (count != 0) DepthViews::reset(pipeline.context(), count, band_scores.back(), band.match);
      samples += count;
    }
  }

  Source source;
  Mesh low;
  BakeOptions options;
  Pipeline pipeline;
  ViewQuery query;
  std::uint32_t size = 0;
  std::uint64_t samples = 0;
  std::vector<cl::Array<float>> band_scores;  // For each band, the best score of each sample so far
};

ViewSession::ViewSession(const Source& source, const Mesh& low, const BakeOptions& options)
    : impl_(new Impl(source, low, options)) {}
ViewSession::~ViewSession() { delete impl_; }
ViewSession::ViewSession(ViewSession&& other) noexcept
    : impl_(std::exchange(other.impl_, nullptr)) {}
ViewSession& ViewSession::operator=(ViewSession&& other) noexcept {
  delete std::exchange(impl_, std::exchange(other.impl_, nullptr));
  return *this;
}

ViewSession::Step ViewSession::add(const Vec3& toward) {
  Impl& impl = *impl_;
  cl::Context& context = impl.pipeline.context();
  const DepthViews view(context, impl_of(impl.source).raster(), {unit_direction(toward)}, impl.size,
                        impl.query.two_sided, impl.query.area);
  Step step;
  step.samples = impl.samples;
  for (std::size_t b = 0; b < impl.band_scores.size(); ++b) {
    PipelineBand& band = impl.pipeline.bands()[b];
    const std::uint32_t count = band.texels.sample_count;
    if (count == 0) continue;
    const std::vector<float> old_scores = impl.band_scores[b].download(context);
    view.match(band.texels.points, count, band.texels.capacity, impl.query, impl.band_scores[b],
               band.match);
    const std::vector<float> new_scores = impl.band_scores[b].download(context);
    for (std::uint32_t i = 0; i < count; ++i) {
      step.changed += new_scores[i] < old_scores[i] ? 1 : 0;
      step.decided += new_scores[i] < std::numeric_limits<float>::infinity() ? 1 : 0;
    }
  }
  return step;
}

Match ViewSession::match() const { return impl_->pipeline.stored_match(); }

}  // namespace kiln
