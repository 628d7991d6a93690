#include <cmath>
#include <limits>

#include "bake/match_stage.h"
#include "kiln/session.h"
#include "match/match_array.h"
#include "match/view_plan.h"
#include "match/views.h"
#include "mesh/kernels_shared.h"

namespace kiln {

struct ViewSession::Impl {
  struct Band {
    TexelBand texels;
    cl::Array<float> score;
    Correspondence match;
  };

  Impl(const Source& dense, const Mesh& low_mesh, const BakeOptions& wanted)
      : source(dense),
        high(source.impl()),
        context(high.device.context()),
        options(wanted),
        source_hash(hash_source(high.positions, high.triangles)),
        low_hash(hash_low(low_mesh)) {
    check_options(options);
    const LowSurface surface = LowSurface::of(low_mesh, high.frame);
    query = view_query(match_request(options, high, surface));
    Rasterizer& raster = high.raster();
    query.area = view_area(surface, query.max_distance, raster.radius());
    size = options.views.size != 0
               ? options.views.size
               : choose_view_size(high.positions, high.triangles, query.area.radius, kLargestView)
                     .size;
    widen(query.area, raster.radius(), size);
    TexelSampler sampler(context, surface,
                         {options.width, options.height, options.samples, 1U << 20});
    for (std::uint32_t i = 0; i < sampler.band_count(); ++i) {
      Band band;
      band.texels = sampler.sample(i);
      const std::uint32_t count = band.texels.sample_count;
      if (count == 0) continue;
      band.score = cl::Array<float>(context, count);
      band.match = Correspondence(context, count);
      DepthViews::reset(context, count, band.score, band.match);
      samples += count;
      bands.push_back(std::move(band));
    }
  }

  Source source;
  const Source::Impl& high;
  cl::Context& context;
  BakeOptions options;
  std::uint64_t source_hash, low_hash;
  ViewQuery query;
  std::uint32_t size = 0;
  std::uint64_t samples = 0;
  std::vector<Band> bands;
};

ViewSession::ViewSession(const Source& source, const Mesh& low, const BakeOptions& options)
    : impl_(std::make_unique<Impl>(source, low, options)) {}
ViewSession::~ViewSession() = default;
ViewSession::ViewSession(ViewSession&&) noexcept = default;
ViewSession& ViewSession::operator=(ViewSession&&) noexcept = default;

ViewSession::Step ViewSession::add(const Vec3& toward) {
  Impl& impl = *impl_;
  const DepthViews view(impl.context, impl.high.raster(), {unit_direction(toward)}, impl.size,
                        impl.query.two_sided, impl.query.area);
  Step step;
  step.samples = impl.samples;
  for (Impl::Band& band : impl.bands) {
    const std::vector<float> before = band.score.download(impl.context);
    const std::uint32_t count = band.texels.sample_count;
    view.match(band.texels.points, count, band.texels.capacity, impl.query, band.score, band.match);
    const std::vector<float> after = band.score.download(impl.context);
    for (std::uint32_t i = 0; i < count; ++i) {
      step.changed += after[i] < before[i] ? 1 : 0;
      step.decided += after[i] < std::numeric_limits<float>::infinity() ? 1 : 0;
    }
  }
  return step;
}

Match ViewSession::match() const {
  const Impl& impl = *impl_;
  Match match = make_match(impl.options.width, impl.options.height, impl.options.samples,
                           impl.high.triangles.size());
  match.source_hash = impl.source_hash;
  match.low_hash = impl.low_hash;
  for (const Impl::Band& band : impl.bands) {
    store_band(impl.context, band.texels, band.match, 1 / impl.high.frame.scale, match);
  }
  return match;
}

}  // namespace kiln
