#include "kiln/bake.h"

#include <algorithm>

#include "bake/bake_steps.h"
#include "bake/fallback_blend.h"
#include "bake/switches.h"
#include "detail/normal.h"
#include "image/mips.h"
#include "match/match_array.h"
#include "match/matcher.h"
#include "match/view_plan.h"
#include "mesh/charts.h"
#include "source/dense_mesh.h"
#include "texel/texels.h"

namespace kiln {
namespace {

/// Views of a dense mesh that is much larger than the light one may show too little of it.
void warn_about_pixels(const LowSurface& surface, double unit, BakeReport& report) {
  if (!report.views) return;
  const ViewArea area = view_area(surface, 0, 1e300);
  const double radius = area.radius * unit;
  if (!(report.views->pixel > radius / 25)) return;
  report.warnings.push_back(
      {"coarse-views",
       "A pixel of the depth views is " + std::to_string(report.views->pixel / radius) +
           " times the light mesh's radius, so they show next to nothing of it: raise --view-size, "
           "cut away what lies far from it in the dense mesh, or use rays.",
       1});
}

/// What the bakes of several clusters share.
struct Clusters {
  std::uint32_t cluster = 0;
  std::shared_ptr<const VisibilityField> field;
};

BakeResult bake_cluster(const Source& source, const Mesh& low, const BakeOptions& options,
                        Clusters& clusters) {
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
  std::unique_ptr<Matcher> matcher;
  try {
    matcher = make_matcher(high, surface, options, report, clusters.cluster, clusters.field);
  } catch (const Cancelled&) {
    result = BakeResult{};
    result.cancelled = true;
    return result;
  }
  // Methods that prepare for long have reported their progress.
  const double prepared = report.visibility ? kPreparingShare : 0;
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
  std::optional<Switches> switches;
  std::optional<FallbackBlend> blend;
  if (options.fallback != Fallback::low) switches.emplace(low, options.width, options.height);
  if (options.fallback_blend > 0) {
    blend.emplace(options.width, options.height, options.fallback_blend);
  }

  const std::uint32_t bands = sampler.band_count();
  for (std::uint32_t b = 0; b < bands; ++b) {
    if (options.progress && !options.progress(prepared + (0.97 - prepared) * b / bands, "baking")) {
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
    if (switches) switches->store(context, band, matcher->deciders());
    if (blend) blend->store(context, band, matcher->deciders());
    if (result.match) store_band(context, band, match, unit, *result.match);
    count_samples(context, match, unit, report, distance_sum);
    report.texels += band.texel_count;
    report.samples += band.sample_count;
    report.seconds_image += watch.lap();
    if (options.mips) charts.store(context, band, options.width, chart_of_triangle);
    report.seconds_mips += watch.lap();
  }

  matcher->finish(report);
  if (switches) report.switches = switches->measure(image);
  if (blend) {
    blend->plan(surface);
    for (std::uint32_t b = 0; b < bands; ++b) {
      if (options.progress && !options.progress(0.97, "blending")) {
        result = BakeResult{};
        result.cancelled = true;
        return result;
      }
      const TexelBand band = sampler.sample(b);
      if (!blend->touches(band)) continue;
      match.count = band.sample_count;
      matcher->run(band, match);
      const std::size_t offset = std::size_t{band.first_row} * options.width;
      const std::size_t band_texels = std::size_t{band.row_count} * options.width;
      band_image.write(context, std::span(image.pixels).subspan(offset * 3, band_texels * 3));
      report.blended_texels +=
          blend->run(context, band, *matcher, match, detail, band_image, band_coverage);
      band_image.read(context, std::span(image.pixels).subspan(offset * 3, band_texels * 3));
    }
    report.switches_blended = switches->measure(image);
    report.seconds_match += watch.lap();
  }
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
  warn_about_pixels(surface, unit, report);
  for (MapKind kind : options.maps) {
    if (kind == MapKind::normal) {
      result.maps.push_back({kind, std::move(image), std::move(mips), clusters.cluster});
    }
    if (kind == MapKind::mask) {
      result.maps.push_back({kind, mask_image(options, result.coverage), {}, clusters.cluster});
    }
  }
  if (options.progress) options.progress(1.0, "done");
  return result;
}

}  // namespace

BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options) {
  check_options(options);
  const std::uint32_t count = options.visibility.clusters;
  Clusters clusters;
  if (count == 1) return bake_cluster(source, low, options, clusters);
  BakeResult result;
  for (; clusters.cluster < count; ++clusters.cluster) {
    BakeOptions one = options;
    if (options.progress) {
      one.progress = [&](double done, std::string_view stage) {
        return options.progress((clusters.cluster + done) / count, stage);
      };
    }
    BakeResult baked = bake_cluster(source, low, one, clusters);
    if (clusters.cluster == 0 || baked.cancelled) {
      result = std::move(baked);
      if (result.cancelled) return result;
      result.clusters = clusters.field->clusters();
      continue;
    }
    for (BakedMap& map : baked.maps) {
      if (map.kind == MapKind::normal) result.maps.push_back(std::move(map));
    }
    const BakeReport& further = baked.report;
    result.report.seconds_texels += further.seconds_texels;
    result.report.seconds_match += further.seconds_match;
    result.report.seconds_detail += further.seconds_detail;
    result.report.seconds_image += further.seconds_image;
    result.report.seconds_mips += further.seconds_mips;
  }
  return result;
}

}  // namespace kiln
