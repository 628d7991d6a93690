#include "kiln/bake.h"

#include <optional>
#include <utility>

#include "bake/fallback_blend.h"
#include "bake/layers.h"
#include "bake/match_stage.h"
#include "bake/report.h"
#include "bake/switches.h"
#include "image/mips.h"
#include "match/match_array.h"
#include "match/view_plan.h"
#include "mesh/charts.h"
#include "source/dense_mesh.h"
#include "texel/texels.h"

namespace kiln {
namespace {

// Shares of the whole at which stages begin.
constexpr double kAtBlend = 0.97, kAtMips = 0.97, kAtGutter = 0.98;

/// Views of a dense mesh that is much larger than the light one may show too little of it.
void warn_about_pixels(const LowSurface& surface, double unit, BakeReport& report) {
  if (!report.views) return;
  const ViewArea area = view_area(surface, 0, 1e300);
  const double radius = area.radius * unit;
  if (!(report.views->pixel > radius / 25)) return;
  report.warnings.push_back(
      {"coarse-views",
       "A pixel of the depth views is " + std::to_string(report.views->pixel / radius) +
           " times the light mesh's radius, so they show next to nothing of it: raise views.size, "
           "cut away what lies far from it in the dense mesh, or use rays.",
       1});
}

/// What the bakes of several clusters share.
struct Clusters {
  std::uint32_t cluster = 0;
  std::shared_ptr<const VisibilityField> field;
};

void check_saved(const BakeOptions& options, const Source::Impl& high, const Mesh& low) {
  if (options.match == nullptr) return;
  check_match(*options.match, options, high.triangles.size());
  check_meshes(*options.match, hash_source(high.positions, high.triangles), hash_low(low));
}

/// The stages of a bake, in their order: samples, match, maps, blend, mip chain, padding and encoding.
class Pipeline {
 public:
  Pipeline(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
           Clusters& clusters);
  /// \throws Cancelled
  BakeResult run();

 private:
  void keep_on(double done, std::string_view stage) const {
    if (options_.progress && !options_.progress(done, stage)) throw Cancelled();
  }
  void prepare();
  void sample_and_match(std::uint32_t number, TexelBand& band);
  void keep_band(const TexelBand& band);
  void blend();
  void make_mips();
  void pad_and_encode();
  void finish_report();

  const Source::Impl& high_;
  cl::Context& context_;
  const Mesh& low_;
  const BakeOptions& options_;
  Clusters& clusters_;
  double unit_;
  Stopwatch watch_;
  LowSurface surface_;
  TexelSampler sampler_;
  EdgeTurn turn_;
  Layers layers_;
  std::unique_ptr<Matcher> matcher_;
  Correspondence match_;
  std::vector<std::uint32_t> chart_of_triangle_;
  ChartMap charts_;
  std::optional<Switches> switches_;
  std::optional<FallbackBlend> blend_;
  std::vector<std::vector<Image>> mips_;
  double distance_sum_ = 0;
  BakeResult result_;
};

Pipeline::Pipeline(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                   Clusters& clusters)
    : high_(high),
      context_(high.device.context()),
      low_(low),
      options_(options),
      clusters_(clusters),
      unit_(1 / high.frame.scale),
      surface_(LowSurface::of(low, high.frame, options.cage_mesh)),
      sampler_(context_, surface_, {options.width, options.height, options.samples, kBandSamples}),
      layers_(high, surface_, options) {}

void Pipeline::prepare() {
  BakeReport& report = result_.report;
  report.seconds_texels = watch_.lap();
  turn_ = edge_turn(options_, high_, surface_);
  matcher_ = make_matcher(high_, surface_, options_, report, clusters_.cluster, clusters_.field);
  context_.finish();
  report.seconds_match = watch_.lap() - report.seconds_build;
  if (options_.keep_match) {
    result_.match =
        make_match(options_.width, options_.height, options_.samples, high_.triangles.size());
    result_.match->source_hash = hash_source(high_.positions, high_.triangles);
    result_.match->low_hash = hash_low(low_);
  }
  report.seconds_image = watch_.lap();
  if (options_.mips) {
    chart_of_triangle_ = uv_charts(low_);
    charts_ = ChartMap(std::size_t{options_.width} * options_.height, options_.samples);
  }
  report.seconds_mips += watch_.lap();
  if (!options_.fallback.empty() && layers_.unit_vectors() != nullptr) {
    switches_.emplace(low_, options_.width, options_.height);
  }
  if (options_.fallback_blend > 0) {
    blend_.emplace(options_.width, options_.height, options_.fallback_blend);
  }
}

void Pipeline::sample_and_match(std::uint32_t number, TexelBand& band) {
  band = sampler_.sample(number);
  turn_.apply(context_, band);
  context_.finish();
  result_.report.seconds_texels += watch_.lap();
  if (match_.capacity < band.capacity) {
    match_ = Correspondence();
    match_ = Correspondence(context_, band.capacity);
  }
  match_.count = band.sample_count;
  matcher_->run(band, match_);
  context_.finish();
  result_.report.seconds_match += watch_.lap();
}

void Pipeline::keep_band(const TexelBand& band) {
  BakeReport& report = result_.report;
  if (switches_) switches_->store(layers_.reads(), band, matcher_->deciders());
  if (blend_) blend_->store(layers_.reads(), band, matcher_->deciders());
  if (result_.match) store_band(context_, band, match_, unit_, *result_.match);
  count_samples(context_, match_, unit_, report, distance_sum_);
  report.texels += band.texel_count;
  report.samples += band.sample_count;
  report.seconds_image += watch_.lap();
  if (options_.mips) charts_.store(context_, band, options_.width, chart_of_triangle_);
  report.seconds_mips += watch_.lap();
}

void Pipeline::blend() {
  if (!blend_) return;
  BakeReport& report = result_.report;
  blend_->plan(surface_);
  for (std::uint32_t b = 0; b < sampler_.band_count(); ++b) {
    keep_on(kAtBlend, "blending");
    TexelBand band = sampler_.sample(b);
    turn_.apply(context_, band);
    if (!blend_->touches(band)) continue;
    match_.count = band.sample_count;
    matcher_->run(band, match_);
    report.blended_texels +=
        blend_->run(context_, band, *matcher_,
                    [&](const Correspondence& other, const cl::Array<float>& shares) {
                      layers_.run_blended(band, match_, other, shares);
                    });
  }
  if (switches_) report.switches_blended = switches_->measure(*layers_.unit_vectors());
  report.seconds_match += watch_.lap();
}

void Pipeline::make_mips() {
  if (!options_.mips) return;
  keep_on(kAtMips, "mip-maps");
  mips_ = layers_.mips(context_, options_, charts_);
  charts_ = {};
  result_.report.seconds_mips += watch_.lap();
}

void Pipeline::pad_and_encode() {
  keep_on(kAtGutter, "gutter");
  std::vector<Image> images =
      layers_.finish(context_, options_, false, result_.coverage, result_.report.gutter_texels);
  for (std::size_t l = 0; l < images.size(); ++l) {
    result_.maps.push_back({layers_.all()[l].row->info.kind, std::move(images[l]),
                            options_.mips ? std::move(mips_[l]) : std::vector<Image>(),
                            clusters_.cluster});
  }
  result_.report.seconds_image += watch_.lap();
}

void Pipeline::finish_report() {
  BakeReport& report = result_.report;
  const std::uint64_t hits = report.samples - report.missed;
  report.mean_abs_distance = hits != 0 ? distance_sum_ / static_cast<double>(hits) : 0;
  report.peak_device_bytes = context_.peak_device_bytes();
  report.warnings.insert(report.warnings.end(), sampler_.report().warnings.begin(),
                         sampler_.report().warnings.end());
  warn_about_misses(report);
  warn_about_pixels(surface_, unit_, report);
}

BakeResult Pipeline::run() {
  BakeReport& report = result_.report;
  prepare();
  // Matches that prepare for long have reported their progress.
  const double prepared = report.visibility ? kPreparingShare : 0;
  const std::uint32_t bands = sampler_.band_count();
  for (std::uint32_t b = 0; b < bands; ++b) {
    keep_on(prepared + (kAtBlend - prepared) * b / bands, "baking");
    TexelBand band;
    sample_and_match(b, band);
    layers_.run(band, match_);
    report.seconds_detail += watch_.lap();
    keep_band(band);
  }
  MatchNotes notes;
  matcher_->finish(notes);
  take_notes(std::move(notes), report);
  if (switches_) report.switches = switches_->measure(*layers_.unit_vectors());
  blend();
  make_mips();
  pad_and_encode();
  finish_report();
  if (options_.progress) options_.progress(1.0, "done");
  return std::move(result_);
}

BakeResult bake_cluster(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                        Clusters& clusters) {
  try {
    check_saved(options, high, low);
    return Pipeline(high, low, options, clusters).run();
  } catch (const Cancelled&) {
    BakeResult none;
    none.cancelled = true;
    return none;
  }
}

/// Adds a further cluster's maps and seconds to the first one's.
void join(BakeResult& result, BakeResult baked) {
  for (BakedMap& map : baked.maps) {
    if (find_map(map.kind.name).type != MapType::coverage) result.maps.push_back(std::move(map));
  }
  const BakeReport& further = baked.report;
  result.report.seconds_texels += further.seconds_texels;
  result.report.seconds_match += further.seconds_match;
  result.report.seconds_detail += further.seconds_detail;
  result.report.seconds_image += further.seconds_image;
  result.report.seconds_mips += further.seconds_mips;
}

}  // namespace

BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options) {
  check_options(options);
  const std::uint32_t count = options.visibility.clusters;
  Clusters clusters;
  if (count == 1) return bake_cluster(source.impl(), low, options, clusters);
  BakeResult result;
  for (; clusters.cluster < count; ++clusters.cluster) {
    BakeOptions one = options;
    if (options.progress) {
      one.progress = [&](double done, std::string_view stage) {
        return options.progress((clusters.cluster + done) / count, stage);
      };
    }
    BakeResult baked = bake_cluster(source.impl(), low, one, clusters);
    if (baked.cancelled) return baked;
    if (clusters.cluster == 0) {
      result = std::move(baked);
      result.clusters = clusters.field->clusters();
    } else {
      join(result, std::move(baked));
    }
  }
  return result;
}

}  // namespace kiln
