#include "bake/pipeline.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bake/errors.h"
#include "bake/report.h"
#include "bake/streaming.h"
#include "base/formatted.h"
#include "base/option.h"
#include "match/match_array.h"
#include "match/view_plan.h"
#include "mesh/charts.h"
#include "mesh/normals.h"
#include "mesh/steps.h"

namespace kiln {
namespace {

// Progress at which stages begin, as a share of the bake.
constexpr double kBlendProgress = 0.97, kMipsProgress = 0.97, kPaddingProgress = 0.98;

/// Cached advice about the low poly's coordinates, see coarse_steps().
struct CoarseAdvice {
  std::string words;
};

/// Cached hash_source(), for the matches of all texture sets.
struct SourceHash {
  std::uint64_t value;
};

}  // namespace

Pipeline::Pipeline(const Scene& scene, Bands bands, BakeProgress progress)
    : scene_(scene),
      context_(context_of(scene.high.device)),
      bands_stay_(bands),
      progress_(std::move(progress)),
      unit_(1 / scene.high.frame.scale),
      low_(scene.high.low_surface(scene.low, scene.options.match.cage_mesh,
                                  scene.options.match.uv_copies)),
      surface_(*low_),
      cage_(context_, scene.high.frame, surface_),
      matched_(scene.high.is_streamed() ? scene.high.matched_part() : nullptr),
      sampler_(context_, surface_,
               {scene.options.width, scene.options.height, scene.options.samples,
                band_samples(scene.high)}),
      turn_(find_turn()),
      sheets_(sheet_reach(scene.options, surface_)),
      layers_(matched_ != nullptr ? *matched_ : scene.high, surface_, scene.options, true,
              scene.finer) {
  const BakeOptions& options = scene_.options;
  if (scene_.high.is_streamed()) refuse_streaming(options);
  if (options.match.saved == nullptr) result_.report.cage_mesh = cage_.report(surface_);
  result_.report.uv_copies =
      surface_.copy_of.size() -
      static_cast<std::size_t>(
          std::count(surface_.copy_of.begin(), surface_.copy_of.end(), LowSurface::kNoCopy));
  result_.report.small_triangles = sampler_.small_charts().triangles.size();
  result_.report.small_without_texel = sampler_.small_charts().triangles_without_texel.size();
  result_.report.seconds_texels = watch_.lap() - result_.report.seconds_build;
  if (options.encoding.mips) {
    chart_of_triangle_ = uv_charts(scene_.low, surface_.with_uvs);
    charts_ = ChartMap(std::size_t{options.width} * options.height, options.samples);
  }
  bands_.resize(bands_stay_ == Bands::stay ? sampler_.band_count() : 1);
  result_.report.seconds_mips = watch_.lap();
}

/// Determines how directions are blended at hard edges, which may build the high poly's BVH.
EdgeTurn Pipeline::find_turn() {
  const BakeOptions& options = scene_.options;
  if (options.match.saved == nullptr && options.match.ray.direction == RayDirection::painted &&
      obeys(match_row(options.match.method).info, "match.ray.direction") &&
      scene_.low.colors.empty()) {
    throw Error(ErrorCode::input,
                "'" + scene_.low.name +
                    "' has no vertex colours, but this direction of rays needs them as weights of "
                    "the normals: paint them in a modelling tool, or choose another direction.");
  }
  const double built = scene_.high.stats().build_seconds;
  EdgeTurn turn = edge_turn(options, scene_.high, surface_, &result_.report.edges);
  result_.report.seconds_build += scene_.high.stats().build_seconds - built;
  return turn;
}

void Pipeline::start_watch() {
  BakeReport& report = result_.report;
  watch_.lap();
  report.seconds_texels = report.seconds_build = report.seconds_match = report.seconds_detail =
      report.seconds_image = report.seconds_mips = 0;
}

void Pipeline::sample() {
  for (std::uint32_t b = 0; b < bands_.size(); ++b) load_band(b);
  sampled_ = bands_stay_ == Bands::stay;
}

/// Samples a band and allocates its correspondence.
PipelineBand& Pipeline::sample_band(std::uint32_t number) {
  PipelineBand& band = bands_[bands_stay_ == Bands::stay ? number : 0];
  band.texels = sampler_.sample(number, std::move(band.texels));
  turn_.apply(context_, band.texels);
  sheets_.apply(context_, band.texels);
  cage_.apply(context_, band.texels);
  if (band.match.capacity < band.texels.capacity) {
    band.match = DeviceCorrespondence();
    band.match = DeviceCorrespondence(context_, band.texels.capacity, layers_.need_visibility());
  }
  band.match.count = band.texels.sample_count;
  return band;
}

/// Returns a stored band, or samples it and records its texels' charts.
PipelineBand& Pipeline::load_band(std::uint32_t number) {
  if (sampled_) return bands_[number];
  PipelineBand& band = sample_band(number);
  context_.finish();
  result_.report.seconds_texels += watch_.lap();
  if (scene_.options.encoding.mips) {
    charts_.store(context_, band.texels, scene_.options.width, chart_of_triangle_);
  }
  result_.report.seconds_mips += watch_.lap();
  return band;
}

bool Pipeline::keeps_matcher() const {
  const BakeOptions& options = scene_.options;
  return options.match.saved == nullptr && options.match.parts == nullptr &&
         !any_in_chain(options, [](const MatchRow& row) { return !row.is_refittable; });
}

void Pipeline::prepare_match(Clusters& clusters) {
  if (matcher_ != nullptr && keeps_matcher()) return;
  BakeReport& report = result_.report;
  const double built = report.seconds_build;
  cluster_ = clusters.cluster;
  report.views.reset();
  report.warnings.clear();
  matcher_ = nullptr;  // the former matcher's memory is freed first
  matcher_ = make_matcher(scene_.high, surface_, scene_.options, report, clusters, progress_,
                          turn_.turns());
  made_warnings_ = std::exchange(report.warnings, {});
  prepare_copies();
  context_.finish();
  report.seconds_match += watch_.lap() - (report.seconds_build - built);
}

/// Prepares the check of triangles that share texels. It is skipped for matches by UVs, which find the same point for
/// both triangles, and for saved matches, which have no other points.
void Pipeline::prepare_copies() {
  const BakeOptions& options = scene_.options;
  copies_.reset();
  if (bands_stay_ == Bands::stay || surface_.copy_of.empty() || options.match.saved != nullptr ||
      match_row(options.match.method).at_uvs != nullptr)
    return;
  if (scene_.high.is_streamed()) {
    made_warnings_.push_back({"copies-unchecked",
                              "Triangles of '" + scene_.low.name +
                                  "' share their texels with others. Whether these show the same "
                                  "surface was not checked, "
                                  "since the high poly is larger than memory.",
                              1});
    return;
  }
  copies_.emplace(match_request(options, scene_.high, surface_), options, *matcher_,
                  [this](TexelBand& band) {
                    turn_.apply(context_, band);
                    sheets_.apply(context_, band);
                    cage_.apply(context_, band);
                  });
}

void Pipeline::move(std::uint32_t first, std::span<const Vec3> positions) {
  source_hash_.reset();
  if (points_stay()) matcher_->move(first, positions);
  if (!turn_.turns() || !turns_by_source(scene_.options)) return;
  turn_ = find_turn();
  if (!std::exchange(sampled_, false)) return;
  sample();
}

/// Creates the objects that collect measurements band by band.
void Pipeline::make_collectors() {
  const BakeOptions& options = scene_.options;
  if (!options.match.fallback.empty() && layers_.unit_vectors() != nullptr) {
    transitions_.emplace(scene_.low, surface_.with_uvs, options.width, options.height);
  }
  if (options.match.fallback_blend > 0) {
    blend_.emplace(options.width, options.height, options.match.fallback_blend);
  }
  // Matches that need no BVH skip this measurement, since building a BVH would take longer than the bake. So do high
  // polys that are larger than memory.
  if (scene_.high.is_streamed() || options.match.saved != nullptr ||
      !obeys(match_row(options.match.method).info, "report.recall"))
    return;
  const MatchRequest request = match_request(options, scene_.high, surface_);
  CopyCheck* const copies = copies_ ? &*copies_ : nullptr;
  if (options.report.recall > 0)
    coverage_.emplace(request, HighCoverage::spread(scene_.high, options.report.recall), copies);
  if (options.report.vertex_coverage) {
    vertex_coverage_.emplace(request, HighCoverage::vertices(scene_.high), copies);
  }
  result_.report.seconds_recall += watch_.lap();
}

/// Makes a match without samples, with the hashes of its meshes.
Match Pipeline::empty_match() {
  const BakeOptions& options = scene_.options;
  Match match =
      make_match(options.width, options.height, options.samples, scene_.high.triangles.size());
  if (!source_hash_) {
    source_hash_ =
        scene_.high.by_positions()
            ->get<SourceHash>([&] {
              return SourceHash{hash_source(scene_.high.positions, scene_.high.triangles)};
            })
            ->value;
  }
  if (!low_hash_) low_hash_ = hash_low(scene_.low);
  match.source_hash = *source_hash_;
  match.low_hash = *low_hash_;
  return match;
}

void Pipeline::over_bands(const Pass& pass) {
  BakeReport& report = result_.report;
  if (pass.match) {
    distance_sum_ = 0;
    clear_counts(report);
  }
  if (scene_.options.report.keep_match && (pass.match || pass.measure)) {
    result_.match = empty_match();
  }
  report.seconds_image += watch_.lap();
  // Matches with a long preparation have reported their own progress.
  const double preparing_share = report.visibility ? kPreparingShare : 0;
  const std::uint32_t count = sampler_.band_count();
  for (std::uint32_t b = 0; b < count; ++b) {
    progress_.at(preparing_share + (kBlendProgress - preparing_share) * b / count, "baking");
    PipelineBand& band = load_band(b);
    find(band, pass);
    if (pass.read) layers_.run(band.texels, band.match);
    report.seconds_detail += watch_.lap();
    record(band, pass);
  }
  layers_.extend_images();
}

/// Matches a band's samples.
void Pipeline::find(PipelineBand& band, const Pass& pass) {
  layers_.next_band();
  const double built = scene_.high.stats().build_seconds;
  if (pass.match) {
    matcher_->run(band.texels, band.match);
  } else if (pass.measure) {
    matcher_->measure(band.texels, band.match);
  }
  context_.finish();
  const double building = scene_.high.stats().build_seconds - built;  // of chunks
  result_.report.seconds_build += building;
  result_.report.seconds_match += watch_.lap() - building;
  if (matched_ == nullptr) return;
  matched_->read_matched(band.match);
  layers_.next_source();
  result_.report.seconds_detail += watch_.lap();
}

/// Counts a band's samples, and passes the band to the collectors.
void Pipeline::record(const PipelineBand& band, const Pass& pass) {
  BakeReport& report = result_.report;
  if (transitions_) transitions_->store(layers_.reads(), band.texels, matcher_->deciders());
  if (blend_) blend_->store(layers_.reads(), band.texels, matcher_->deciders());
  report.seconds_image += watch_.lap();
  if (coverage_) coverage_->store(scene_.high, layers_.reads(), band.match);
  if (vertex_coverage_) vertex_coverage_->store(scene_.high, layers_.reads(), band.match);
  report.seconds_recall += watch_.lap();
  if (result_.match && (pass.match || pass.measure)) {
    store_band(context_, band.texels, band.match, unit_, *result_.match);
  }
  if (pass.match) {
    count_samples(layers_.reads(), band.match, unit_, report, distance_sum_);
    report.texels += band.texels.texel_count;
    report.samples += band.texels.sample_count;
  }
  report.seconds_image += watch_.lap();
}

void Pipeline::finish_match(bool first_time) {
  BakeReport& report = result_.report;
  const std::uint64_t hits = report.samples - report.missed;
  report.mean_abs_distance = hits != 0 ? distance_sum_ / static_cast<double>(hits) : 0;
  report.warnings = made_warnings_;
  MatchNotes notes;
  if (first_time) matcher_->finish(notes);
  add_notes(std::move(notes), report);
  const std::vector<Warning>& sampling = sampler_.report().warnings;
  report.warnings.insert(report.warnings.end(), sampling.begin(), sampling.end());
  warn_of_normals(scene_.low, report.warnings);
  const auto coarse = surface_.made->get<CoarseAdvice>(
      [&] { return CoarseAdvice{coarse_steps(scene_.low, scene_.high.frame)}; });
  if (!coarse->words.empty()) {
    report.warnings.push_back({"coarse-low", "'" + scene_.low.name + "': " + coarse->words, 1});
  }
  if (report.cage_mesh && surface_.cage_hull != nullptr && !surface_.cage_hull->misfit.empty()) {
    report.warnings.push_back({"cage-no-copy",
                               "The cage '" + surface_.cage_hull->name +
                                   "' is used as a closed hull, not as a copy of the low poly: " +
                                   surface_.cage_hull->misfit + ".",
                               1});
  }
  warn_about_small_charts(sampler_.small_charts(), scene_.low, report.warnings);
  if (copies_ && first_time) {
    report.uv_copies_differ = copies_->check_copies(scene_.low, report.warnings);
  }
  warn_about_coverage(std::uint64_t{scene_.options.width} * scene_.options.height, report);
  warn_about_misses(report);
  warn_about_pixels();
}

/// Warns if the high poly is so much larger than the low poly that views hardly resolve the low poly.
void Pipeline::warn_about_pixels() {
  BakeReport& report = result_.report;
  if (!report.views) return;
  const ViewArea area = view_area(surface_, 0, 1e300);
  const double radius = area.radius * unit_;
  if (!(report.views->pixel > radius / 25)) return;
  report.warnings.push_back({"coarse-views",
                             "A pixel of the depth views is " +
                                 decimal(report.views->pixel / radius) +
                                 " times the low poly's radius, which is too coarse to show it: "
                                 "raise " +
                                 option("match.views.size") +
                                 ", "
                                 "remove distant geometry from the high poly, or use rays.",
                             1});
}

void Pipeline::report_coverage() {
  BakeReport& report = result_.report;
  if (coverage_) report.recall = coverage_->report(scene_.high.frame);
  // If nearly all samples missed, the warnings about misses suffice, and lost detail is not reported.
  if (report.recall && report.missed * 50 <= report.samples) {
    warn_about_loss(*report.recall, scene_.options, report.warnings);
  }
  if (vertex_coverage_) result_.recalled = vertex_coverage_->marks();
  report.seconds_recall += watch_.lap();
}

void Pipeline::blend() {
  if (!blend_) return;
  BakeReport& report = result_.report;
  blend_->plan(surface_);
  for (std::uint32_t b = 0; b < sampler_.band_count(); ++b) {
    progress_.at(kBlendProgress, "blending");
    PipelineBand& band = sample_band(b);
    if (!blend_->touches(band.texels)) continue;
    matcher_->run(band.texels, band.match);
    report.blended_texels +=
        blend_->run(context_, band.texels, *matcher_,
                    [&](const DeviceCorrespondence& other, const cl::Array<float>& shares) {
                      layers_.run_blended(band.texels, band.match, other, shares);
                    });
  }
  if (transitions_) report.transitions_blended = transitions_->measure(*layers_.unit_vectors());
  report.seconds_match += watch_.lap();
}

/// The last stages: mip chain, padding, encoding.
void Pipeline::finish_maps(Image* drawn) {
  // frees the memory of bands for the following stages
  if (bands_stay_ == Bands::pass) bands_.clear();
  const BakeOptions& options = scene_.options;
  BakeReport& report = result_.report;
  if (options.encoding.two_component) {
    for (Layer& layer : layers_.all()) {
      if (layer.row->info.type != MapType::unit_vector) continue;
      flatten_below_surface(layer.row->info.kind.name, layer.image, layers_.coverage(), report);
    }
  }
  std::vector<std::vector<Image>> mips(layers_.all().size());
  if (options.encoding.mips) {
    progress_.at(kMipsProgress, "mip-maps");
    mips = layers_.mips(context_, options, charts_);
    if (bands_stay_ == Bands::pass) charts_ = {};
    report.seconds_mips += watch_.lap();
  }
  progress_.at(kPaddingProgress, "gutter");
  std::vector<Image> images = layers_.finish(context_, options, bands_stay_ == Bands::stay,
                                             result_.coverage, report.gutter_texels, drawn);
  result_.maps.clear();
  for (std::size_t l = 0; l < images.size(); ++l) {
    const MapInfo& info = layers_.all()[l].row->info;
    BakedMap map{info.kind, std::move(images[l]), std::move(mips[l]), cluster_, info};
    if (obeys(info, "encoding.origin")) map.origin = map_origin(options, scene_.high.frame);
    result_.maps.push_back(std::move(map));
  }
  report.seconds_image += watch_.lap();
}

void Pipeline::measure_errors(Clusters& clusters) {
  BakeReport& report = result_.report;
  report.seconds_image += watch_.lap();
  const auto make = [&](const BakeOptions& options) {
    BakeReport discarded_report;  // receives notes that would repeat those of the bake
    return make_matcher(scene_.high, surface_, options, discarded_report, clusters, BakeProgress(),
                        turn_.turns());
  };
  kiln::measure_errors({scene_.high, surface_, scene_.options, turn_, sheets_, cage_, *matcher_,
                        make, blend_ ? &*blend_ : nullptr, layers_},
                       progress_.part(kBlendProgress, kMipsProgress), report);
  report.seconds_errors += watch_.lap();
}

/// Maximum distance of points from the low poly, world units.
double Pipeline::reach() const {
  const BakeOptions& options = scene_.options;
  const bool looks =
      options.match.saved == nullptr && !any_in_chain(options, [](const MatchRow& row) {
        return !obeys(row.info, "match.max_distance");
      });
  if (!looks) return scene_.high.frame.diagonal;
  const MatchRequest request = match_request(options, scene_.high, surface_);
  const double cage =
      std::max(request.cage.value_or(0) * unit_,
               result_.report.cage_mesh ? result_.report.cage_mesh->outward_most : 0);
  // Rays that start on a cage pass through the low poly.
  return std::max(cage, request.distance * unit_ - (request.cage ? cage : 0));
}

void Pipeline::finish_report() {
  const double farthest = reach();
  BakeReport& report = result_.report;
  for (BakedMap& map : result_.maps) {
    const auto layer =
        std::find_if(layers_.all().begin(), layers_.all().end(),
                     [&](const Layer& made) { return made.row->info.kind == map.kind; });
    map.ranges = ranges_of(*layer->row, {scene_.high, scene_.options, farthest});
    map.unit = layer->row->unit;
    layer->maker->report(map, report.warnings);
    if (find_variant(scene_.options, map.kind.name) != nullptr) continue;
    if (!map.ids.empty()) report.ids = map.ids;
    if (map.occlusion) report.occlusion = map.occlusion;
    if (map.curvature_radius > 0) report.curvature_radius = map.curvature_radius;
  }
  report.peak_device_bytes = context_.peak_device_bytes();
}

BakeResult Pipeline::run(Clusters& clusters, Image* drawn) {
  prepare_match(clusters);
  make_collectors();
  over_bands({});
  finish_match(true);
  report_coverage();
  if (transitions_) result_.report.transitions = transitions_->measure(*layers_.unit_vectors());
  blend();
  if (scene_.options.report.errors || layers_.obey_max_error(scene_.options)) {
    measure_errors(clusters);
  }
  finish_maps(drawn);
  finish_report();
  progress_.report(1, "done");
  return std::move(result_);
}

Match Pipeline::whole_match() {
  Match match = empty_match();
  for (const PipelineBand& band : bands_) {
    store_band(context_, band.texels, band.match, unit_, match);
  }
  return match;
}

}  // namespace kiln
