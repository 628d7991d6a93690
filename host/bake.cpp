#include "kiln/bake.h"

#include <algorithm>

#include "bake_match.h"
#include "bake_steps.h"
#include "detail.h"
#include "geometry/charts.h"
#include "matcher.h"
#include "mips.h"
#include "source.h"
#include "texels.h"

namespace kiln {

BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options) {
  check_options(options);
  const Source::Impl& high = source.impl();
  cl::Context& context = high.device.context();
  if (options.match != nullptr) {
    check_match(*options.match, options, high.triangles.size());
    check_meshes(*options.match, hash_source(high.positions, high.triangles), hash_low(low));
  }

  BakeResult result;
  BakeReport& report = result.report;
  const double unit = 1 / high.frame.scale;
  Stopwatch watch;

  const LowSurface surface = LowSurface::of(low, high.frame, options.cage_mesh);
  TexelSampler sampler(context, surface,
                       {options.width, options.height, options.samples, kBandSamples});
  NormalDetail detail(context, surface, high.attributes, options);
  report.seconds_texels = watch.lap();
  const std::unique_ptr<Matcher> matcher = make_matcher(high, surface, options, report);
  context.finish();
  report.seconds_match = watch.lap() - report.seconds_build;

  const std::size_t texels = std::size_t{options.width} * options.height;
  Image image{options.width, options.height, 3, std::vector<float>(texels * 3)};
  result.coverage.resize(texels);
  if (options.keep_match) {
    result.match =
        make_match(options.width, options.height, options.samples, high.triangles.size());
    result.match->source_hash = hash_source(high.positions, high.triangles);
    result.match->low_hash = hash_low(low);
  }
  Correspondence match;
  cl::Array<float> band_image;
  cl::Array<std::uint8_t> band_coverage;
  double distance_sum = 0;
  report.seconds_image = watch.lap();
  std::vector<std::uint32_t> chart_of_triangle;
  ChartMap charts;
  if (options.mips) {
    chart_of_triangle = uv_charts(low);
    charts = ChartMap(texels, options.samples);
  }
  report.seconds_mips += watch.lap();

  const std::uint32_t bands = sampler.band_count();
  for (std::uint32_t b = 0; b < bands; ++b) {
    if (options.progress && !options.progress(0.97 * b / bands, "baking")) {
      result = BakeResult{};
      result.cancelled = true;
      return result;
    }
    const TexelBand band = sampler.sample(b);
    context.finish();
    report.seconds_texels += watch.lap();

    if (match.capacity < band.capacity) {
      match = Correspondence();
      match = Correspondence(context, band.capacity);
    }
    match.count = band.sample_count;
    matcher->run(band, match);
    context.finish();
    report.seconds_match += watch.lap();

    const std::size_t band_texels = std::size_t{band.row_count} * options.width;
    if (band_coverage.size() < band_texels) {
      band_image = cl::Array<float>();
      band_image = cl::Array<float>(context, band_texels * 3);
      band_coverage = cl::Array<std::uint8_t>(context, band_texels);
    }
    context.fill(band_image, 0.0F);
    context.fill(band_coverage, std::uint8_t{0});
    detail.run(band, match, band_image, band_coverage);
    context.finish();
    report.seconds_detail += watch.lap();

    const std::size_t offset = std::size_t{band.first_row} * options.width;
    band_image.read(context, std::span(image.pixels).subspan(offset * 3, band_texels * 3));
    band_coverage.read(context, std::span(result.coverage).subspan(offset, band_texels));
    if (result.match) store_band(context, band, match, unit, *result.match);
    count_samples(context, match, unit, report, distance_sum);
    report.texels += band.texel_count;
    report.samples += band.sample_count;
    report.seconds_image += watch.lap();
    if (options.mips) charts.store(context, band, options.width, chart_of_triangle);
    report.seconds_mips += watch.lap();
  }
  matcher->finish(report);

  std::vector<Image> mips;
  if (options.mips) {
    if (options.progress && !options.progress(0.97, "mip-maps")) {
      result = BakeResult{};
      result.cancelled = true;
      return result;
    }
    mips = finished_mips(context, options, image, result.coverage, charts);
    charts = {};
    report.seconds_mips += watch.lap();
  }
  if (options.progress && !options.progress(0.98, "gutter")) {
    result = BakeResult{};
    result.cancelled = true;
    return result;
  }
  report.gutter_texels = finish_image(context, options, options.gutter, image, result.coverage);
  report.seconds_image += watch.lap();

  const std::uint64_t hits = report.samples - report.missed;
  report.mean_abs_distance = hits != 0 ? distance_sum / static_cast<double>(hits) : 0;
  report.peak_device_bytes = context.peak_device_bytes();
  report.warnings.insert(report.warnings.end(), sampler.report().warnings.begin(),
                         sampler.report().warnings.end());
  warn_about_misses(report);
  for (MapKind kind : options.maps) {
    if (kind == MapKind::normal) result.maps.push_back({kind, std::move(image), std::move(mips)});
    if (kind == MapKind::mask) {
      result.maps.push_back({kind, mask_image(options, result.coverage), {}});
    }
  }
  if (options.progress) options.progress(1.0, "done");
  return result;
}

}  // namespace kiln
