#include "kiln/bake.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bake_match.h"
#include "detail.h"
#include "fallback_blend.h"
#include "geometry/charts.h"
#include "gutter.h"
#include "kernels_shared.h"
#include "matcher.h"
#include "mips.h"
#include "parallel.h"
#include "source.h"
#include "switches.h"
#include "texels.h"
#include "view_plan.h"

namespace kiln {
namespace {

class Stopwatch {
 public:
  /// Seconds since the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Sums of a band's correspondences. Distances are added per block in a fixed order.
void count_samples(cl::Context& context, const Correspondence& match, double unit,
                   BakeReport& report, double& distance_sum) {
  std::vector<std::uint8_t> status(match.count);
  std::vector<float> distance(match.count);
  match.status.read(context, status);
  match.distance.read(context, distance);
  struct Sums {
    std::array<std::uint64_t, KILN_STATUS_COUNT> counts{};
    double distance = 0;
  };
  constexpr std::size_t kBlock = 1 << 16;
  std::vector<Sums> blocks((match.count + kBlock - 1) / kBlock);
  parallel_for(match.count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Sums& sums = blocks[i / kBlock];
      ++sums.counts[std::min<std::size_t>(status[i], KILN_STATUS_COUNT - 1)];
      if (status[i] != KILN_STATUS_MISS) sums.distance += std::abs(distance[i]);
    }
  });
  for (const Sums& sums : blocks) {
    report.outward += sums.counts[KILN_STATUS_OUTWARD];
    report.inward += sums.counts[KILN_STATUS_INWARD];
    report.cage += sums.counts[KILN_STATUS_CAGE];
    report.viewed += sums.counts[KILN_STATUS_VIEW];
    report.closest += sums.counts[KILN_STATUS_CLOSEST];
    report.missed += sums.counts[KILN_STATUS_MISS];
    distance_sum += sums.distance * unit;
  }
}

/// What empty texels hold: the direction that lights like the plain surface.
std::array<float, 3> background(const BakeOptions& options) {
  if (options.space == NormalMapSpace::object) return {0, 0, 0};
  return {0, 0, 1};
}

/// From unit vectors to what files hold.
void encode(const BakeOptions& options, const std::vector<std::uint8_t>& coverage, Image& image) {
  const bool mark = options.miss == MissPolicy::mark;
  parallel_for(coverage.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float* pixel = &image.pixels[i * 3];
      const bool marked = mark && coverage[i] == kCoverageMissed;
      if (marked) {
        pixel[0] = pixel[2] = 1;
        pixel[1] = -1;
      }
      if (options.two_component && !marked) pixel[2] = options.raw ? 0.0F : -1.0F;
      if (options.raw) continue;
      for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] * 0.5F + 0.5F;
    }
  });
}

/// 1 where a texel was baked.
Image mask_image(const BakeOptions& options, const std::vector<std::uint8_t>& coverage) {
  Image mask{options.width, options.height, 1, std::vector<float>(coverage.size())};
  std::transform(coverage.begin(), coverage.end(), mask.pixels.begin(),
                 [](std::uint8_t value) { return value == kCoverageBaked ? 1.0F : 0.0F; });
  return mask;
}

/// Background, gutter and encoding. \returns how many texels became gutter
std::uint64_t finish_image(cl::Context& context, const BakeOptions& options, std::int32_t gutter,
                           Image& image, std::vector<std::uint8_t>& coverage) {
  const std::array<float, 3> empty = background(options);
  parallel_for(coverage.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (coverage[i] == kCoverageEmpty)
        std::copy(empty.begin(), empty.end(), &image.pixels[i * 3]);
    }
  });
  const std::uint64_t count =
      fill_gutter(context, image, coverage, {gutter, options.miss != MissPolicy::keep, true});
  encode(options, coverage, image);
  return count;
}

/// The levels below a map of unit vectors that has neither gutter nor encoding yet.
std::vector<Image> finished_mips(cl::Context& context, const BakeOptions& options,
                                 const Image& image, const std::vector<std::uint8_t>& coverage,
                                 const ChartMap& charts) {
  MipOptions mip_options;
  mip_options.unit_vectors = true;
  mip_options.missed_have_values = options.miss == MissPolicy::keep;
  if (options.miss == MissPolicy::mark) mip_options.missed = {1, -1, 1, 0};
  std::vector<MipLevel> levels = make_mips(image, coverage, charts, mip_options);
  std::vector<Image> images;
  std::int32_t gutter = options.gutter;
  for (MipLevel& level : levels) {
    if (gutter > 0) gutter = std::max(2, gutter / 2);
    finish_image(context, options, gutter, level.image, level.coverage);
    images.push_back(std::move(level.image));
  }
  return images;
}

/// What helps where samples are missed.
std::string miss_advice(const BakeReport& report) {
  if (!report.views) {
    return "raise --max-distance, check that both meshes lie in the same place, or add --two-sided "
           "where the dense mesh's faces are turned inside out.";
  }
  std::string advice =
      "let rays or nearest points decide them (--fallback ray, --fallback closest), ";
  advice += report.views->undersampled > 0.5
                ? "raise --view-size, since most triangles are smaller "
                  "than a pixel of the views, "
                : "look from more sides (--views), ";
  advice += "raise --max-distance, or add --two-sided where faces are turned inside out.";
  return advice;
}

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

void warn_about_misses(BakeReport& report) {
  if (report.samples == 0) {
    report.warnings.push_back(
        {"no-texels",
         "No texel centre lies inside a UV triangle: the map is empty. Use a larger "
         "size, or check the UV layout.",
         1});
  } else if (report.missed * 50 > report.samples) {
    const auto percent = static_cast<int>(100.0 * static_cast<double>(report.missed) /
                                          static_cast<double>(report.samples));
    report.warnings.push_back({"many-misses",
                               std::to_string(percent) +
                                   "% of the samples found no point of the dense mesh within the "
                                   "distance: " +
                                   miss_advice(report),
                               report.missed});
  }
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
                       {options.width, options.height, options.samples, 1U << 20});
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
