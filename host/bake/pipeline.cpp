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

/// Cached advice about the precision of the low poly's coordinates; see coarse_steps().
struct CoarseAdvice {
  std::string advice;
};

/// Cached hash_source(), for the matches of all texture sets.
struct SourceHash {
  std::uint64_t hash;
};

}  // namespace

Pipeline::Pipeline(const Scene& scene, BandStorage bands, BakeProgress progress)
    : scene_(scene),
      context_(context_of(scene.high.device)),
      band_storage_(bands),
      progress_(std::move(progress)),
      units_per_frame_unit_(1 / scene.high.frame.scale),
      low_(scene.high.low_surface(scene.low, scene.options.match.cage_mesh,
                                  scene.options.match.uv_copies)),
      surface_(*low_),
      cage_(context_, scene.high.frame, surface_),
      streamed_part_(scene.high.is_streamed() ? scene.high.matched_part() : nullptr),
      sampler_(context_, surface_,
               {scene.options.width, scene.options.height, scene.options.samples,
                band_samples(scene.high, scene.options)}),
      sample_directions_(make_directions()),
      sheet_distances_(sheet_distances(scene.options, surface_)),
      layers_(streamed_part_ != nullptr ? *streamed_part_ : scene.high, surface_, scene.options,
              scene.open_rows != nullptr ? ImageStorage::rows : ImageStorage::whole_images,
              scene.footprint_divisor) {
  const BakeOptions& options = scene_.options;
  if (scene_.high.is_streamed()) refuse_streaming(options);
  if (options.match.saved == nullptr) result_.report.cage_mesh = cage_.report(surface_);
  result_.report.uv_copies =
      surface_.copy_of.size() -
      static_cast<std::size_t>(
          std::count(surface_.copy_of.begin(), surface_.copy_of.end(), LowSurface::kNoCopy));
  result_.report.small_triangles = sampler_.small_charts().triangles.size();
  result_.report.small_triangles_without_texel =
      sampler_.small_charts().triangles_without_texel.size();
  result_.report.seconds_texels = stopwatch_.lap() - result_.report.seconds_build;
  if (options.encoding.mips) {
    chart_of_triangle_ = uv_charts(scene_.low, surface_.with_uvs);
    charts_ = ChartMap(std::size_t{options.width} * options.height, options.samples);
  }
  bands_.resize(band_storage_ == BandStorage::kept ? sampler_.band_count() : 1);
  result_.report.seconds_mips = stopwatch_.lap();
}

/// Determines how ray directions are blended at hard edges. This may build the high poly's BVH.
SampleDirections Pipeline::make_directions() {
  const BakeOptions& options = scene_.options;
  if (options.match.saved == nullptr && options.match.ray.direction == RayDirection::painted &&
      obeys(match_row(options.match.method).info, "match.ray.direction") &&
      scene_.low.colors.empty()) {
    throw Error(ErrorCode::input,
                "'" + scene_.low.name +
                    "' has no vertex colours, but this direction of rays needs them as weights of "
                    "the normals: paint them in a modelling tool, or choose another direction.");
  }
  const double source_seconds_before = scene_.high.stats().build_seconds;
  SampleDirections directions =
      make_sample_directions(options, scene_.high, surface_, &result_.report.edges);
  result_.report.seconds_build += scene_.high.stats().build_seconds - source_seconds_before;
  return directions;
}

void Pipeline::restart_stopwatch() {
  BakeReport& report = result_.report;
  stopwatch_.lap();
  report.seconds_texels = report.seconds_build = report.seconds_match = report.seconds_detail =
      report.seconds_image = report.seconds_mips = 0;
}

void Pipeline::sample() {
  for (std::uint32_t b = 0; b < bands_.size(); ++b) load_band(b);
  has_stored_bands_ = band_storage_ == BandStorage::kept;
}

/// Samples a band and allocates its correspondence.
PipelineBand& Pipeline::sample_band(std::uint32_t number) {
  PipelineBand& band = bands_[band_storage_ == BandStorage::kept ? number : 0];
  band.texels = sampler_.sample(number, std::move(band.texels));
  sample_directions_.set_directions(context_, band.texels);
  sheet_distances_.write_search_distances(context_, band.texels);
  cage_.write_sample_reach(context_, band.texels);
  if (band.match.capacity < band.texels.capacity) {
    band.match = DeviceCorrespondence();
    band.match =
        DeviceCorrespondence(context_, band.texels.capacity, layers_.any_map_needs_visibility());
  }
  band.match.count = band.texels.sample_count;
  return band;
}

/// Returns a band that is stored, or samples it and records the charts of its texels.
PipelineBand& Pipeline::load_band(std::uint32_t number) {
  if (has_stored_bands_) return bands_[number];
  PipelineBand& band = sample_band(number);
  context_.finish();
  result_.report.seconds_texels += stopwatch_.lap();
  if (scene_.options.encoding.mips) {
    charts_.store(context_, band.texels, scene_.options.width, chart_of_triangle_);
  }
  result_.report.seconds_mips += stopwatch_.lap();
  return band;
}

bool Pipeline::keeps_matcher() const {
  const BakeOptions& options = scene_.options;
  return options.match.saved == nullptr && options.match.parts == nullptr &&
         !any_match_or_fallback(options, [](const MatchRow& row) { return !row.is_refittable; });
}

void Pipeline::prepare_match(Clusters& clusters) {
  if (matcher_ != nullptr && keeps_matcher()) return;
  BakeReport& report = result_.report;
  const double source_seconds_before = report.seconds_build;
  cluster_ = clusters.cluster;
  report.views.reset();
  report.warnings.clear();
  matcher_ = nullptr;  // Frees the former matcher's memory first
  matcher_ = make_matcher(scene_.high, surface_, scene_.options, report, clusters, progress_,
                          sample_directions_.blends_directions());
  matcher_warnings_ = std::exchange(report.warnings, {});
  prepare_copies();
  context_.finish();
  report.seconds_match += stopwatch_.lap() - (report.seconds_build - source_seconds_before);
}

/// Prepares the check of triangles that share texels. It is skipped for matches by UVs, which find the same point for
/// both triangles, and for saved matches, which have no other points.
void Pipeline::prepare_copies() {
  const BakeOptions& options = scene_.options;
  copy_check_.reset();
  if (band_storage_ == BandStorage::kept || surface_.copy_of.empty() ||
      options.match.saved != nullptr || match_row(options.match.method).find_at_uvs != nullptr)
    return;
  if (scene_.high.is_streamed()) {
    matcher_warnings_.push_back(
        {"copies-unchecked",
         "Triangles of '" + scene_.low.name +
             "' share their texels with others. Whether these show the same "
             "surface was not checked, "
             "since the high poly is larger than memory.",
         1});
    return;
  }
  copy_check_.emplace(match_request(options, scene_.high, surface_), options, *matcher_,
                      [this](TexelBand& band) {
                        sample_directions_.set_directions(context_, band);
                        sheet_distances_.write_search_distances(context_, band);
                        cage_.write_sample_reach(context_, band);
                      });
}

void Pipeline::move(std::uint32_t first, std::span<const Vec3> positions) {
  source_hash_.reset();
  if (keeps_surface_points()) matcher_->move(first, positions);
  if (!sample_directions_.blends_directions() || !directions_depend_on_high(scene_.options)) return;
  sample_directions_ = make_directions();
  if (!std::exchange(has_stored_bands_, false)) return;
  sample();
}

/// Creates the objects that collect measurements band by band.
void Pipeline::make_collectors() {
  const BakeOptions& options = scene_.options;
  if (!options.match.fallback.empty() && layers_.unit_vectors() != nullptr) {
    method_transitions_.emplace(scene_.low, surface_.with_uvs, options.width, options.height);
  }
  if (options.match.fallback_blend > 0) {
    fallback_blend_.emplace(options.width, options.height, options.match.fallback_blend);
  }
  // Lost detail is not measured for matches that need no BVH, since building one would take longer than the bake, nor
  // for high polys that are larger than memory.
  if (scene_.high.is_streamed() || options.match.saved != nullptr ||
      !obeys(match_row(options.match.method).info, "report.recall"))
    return;
  const MatchRequest request = match_request(options, scene_.high, surface_);
  CopyCheck* const copies = copy_check_ ? &*copy_check_ : nullptr;
  if (options.report.recall > 0)
    coverage_.emplace(request, HighCoverage::spread_test_points(scene_.high, options.report.recall),
                      copies);
  if (options.report.vertex_coverage) {
    vertex_coverage_.emplace(request, HighCoverage::make_vertex_test_points(scene_.high), copies);
  }
  result_.report.seconds_recall += stopwatch_.lap();
}

/// Makes a match without samples, with the hashes of its meshes.
Match Pipeline::make_empty_match() {
  const BakeOptions& options = scene_.options;
  Match match =
      make_match(options.width, options.height, options.samples, scene_.high.triangles.size());
  if (!source_hash_) {
    source_hash_ =
        scene_.high.by_positions()
            ->get<SourceHash>([&] {
              return SourceHash{hash_source(scene_.high.positions, scene_.high.triangles)};
            })
            ->hash;
  }
  if (!low_hash_) low_hash_ = hash_low(scene_.low);
  match.source_hash = *source_hash_;
  match.low_hash = *low_hash_;
  return match;
}

void Pipeline::run_over_bands(const Pass& pass) {
  BakeReport& report = result_.report;
  if (pass.match) {
    distance_sum_ = 0;
    clear_counts(report);
  }
  if (scene_.options.report.keep_match && (pass.match || pass.update_distances)) {
    result_.match = make_empty_match();
  }
  report.seconds_image += stopwatch_.lap();
  // Matches that take long to prepare have already reported progress.
  const double preparing_share = report.visibility ? kPreparingShare : 0;
  const std::uint32_t count = sampler_.band_count();
  for (std::uint32_t b = 0; b < count; ++b) {
    progress_.at(preparing_share + (kBlendProgress - preparing_share) * b / count, "baking");
    PipelineBand& band = load_band(b);
    find(band, pass);
    if (pass.compute_maps) layers_.run(band.texels, band.match);
    report.seconds_detail += stopwatch_.lap();
    layers_.finish_rows();
    record_samples(band, pass);
  }
  layers_.extend_images();
}

/// Matches a band's samples.
void Pipeline::find(PipelineBand& band, const Pass& pass) {
  layers_.invalidate_band_results();
  const double source_seconds_before = scene_.high.stats().build_seconds;
  if (pass.match) {
    matcher_->run(band.texels, band.match);
  } else if (pass.update_distances) {
    matcher_->measure(band.texels, band.match);
  }
  context_.finish();
  const double build_seconds_of_bake =
      scene_.high.stats().build_seconds - source_seconds_before;  // of chunks
  result_.report.seconds_build += build_seconds_of_bake;
  result_.report.seconds_match += stopwatch_.lap() - build_seconds_of_bake;
  if (streamed_part_ == nullptr) return;
  streamed_part_->read_matched(band.match);
  layers_.invalidate_source_results();
  result_.report.seconds_detail += stopwatch_.lap();
}

/// Counts a band's samples, and passes the band to the collectors.
void Pipeline::record_samples(const PipelineBand& band, const Pass& pass) {
  BakeReport& report = result_.report;
  if (method_transitions_)
    method_transitions_->record_band(layers_.reads(), band.texels, matcher_->deciding_methods());
  if (fallback_blend_)
    fallback_blend_->record_band(layers_.reads(), band.texels, matcher_->deciding_methods());
  report.seconds_image += stopwatch_.lap();
  if (coverage_) coverage_->record_band(scene_.high, layers_.reads(), band.match);
  if (vertex_coverage_) vertex_coverage_->record_band(scene_.high, layers_.reads(), band.match);
  report.seconds_recall += stopwatch_.lap();
  if (result_.match && (pass.match || pass.update_distances)) {
    store_band(context_, band.texels, band.match, units_per_frame_unit_, *result_.match);
  }
  if (pass.match) {
    count_samples(layers_.reads(), band.match, units_per_frame_unit_, report, distance_sum_);
    report.texels += band.texels.texel_count;
    report.samples += band.texels.sample_count;
  }
  report.seconds_image += stopwatch_.lap();
}

void Pipeline::finish_match(bool first_time) {
  BakeReport& report = result_.report;
  const std::uint64_t hits = report.samples - report.missed;
  report.mean_abs_distance = hits != 0 ? distance_sum_ / static_cast<double>(hits) : 0;
  report.warnings = matcher_warnings_;
  MatchNotes notes;
  if (first_time) matcher_->finish(notes);
  add_notes(std::move(notes), report);
  const std::vector<Warning>& sampling = sampler_.report().warnings;
  report.warnings.insert(report.warnings.end(), sampling.begin(), sampling.end());
  warn_of_normals(scene_.low, report.warnings);
  const auto coarse_advice = surface_.made->get<CoarseAdvice>(
      [&] { return CoarseAdvice{coarse_steps(scene_.low, scene_.high.frame)}; });
  if (!coarse_advice->advice.empty()) {
    report.warnings.push_back(
        {"coarse-low", "'" + scene_.low.name + "': " + coarse_advice->advice, 1});
  }
  if (report.cage_mesh && surface_.cage_hull != nullptr && !surface_.cage_hull->mismatch.empty()) {
    report.warnings.push_back({"cage-no-copy",
                               "The cage '" + surface_.cage_hull->name +
                                   "' is used as a closed hull, not as a copy of the low poly: " +
                                   surface_.cage_hull->mismatch + ".",
                               1});
  }
  warn_about_small_charts(sampler_.small_charts(), scene_.low, report.warnings);
  if (copy_check_ && first_time) {
    report.uv_copies_differ = copy_check_->check_copies(scene_.low, report.warnings);
  }
  warn_about_coverage(std::uint64_t{scene_.options.width} * scene_.options.height, report);
  warn_about_misses(report);
  warn_about_coarse_views();
}

/// Warns if the high poly is so much larger than the low poly that views hardly resolve the low poly.
void Pipeline::warn_about_coarse_views() {
  BakeReport& report = result_.report;
  if (!report.views) return;
  const ViewArea area = view_area(surface_, 0, 1e300);
  const double radius = area.radius * units_per_frame_unit_;
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
  // If nearly all samples missed, only the misses are warned of, and lost detail is not reported.
  if (report.recall && report.missed * 50 <= report.samples) {
    warn_about_lost_detail(*report.recall, scene_.options, report.warnings);
  }
  if (vertex_coverage_) result_.recalled = vertex_coverage_->vertex_coverage();
  report.seconds_recall += stopwatch_.lap();
}

void Pipeline::blend() {
  if (!fallback_blend_) return;
  BakeReport& report = result_.report;
  fallback_blend_->plan(surface_);
  for (std::uint32_t b = 0; b < sampler_.band_count(); ++b) {
    progress_.at(kBlendProgress, "blending");
    PipelineBand& band = sample_band(b);
    if (!fallback_blend_->has_blended_texels(band.texels)) continue;
    matcher_->run(band.texels, band.match);
    report.blended_texels += fallback_blend_->run(
        context_, band.texels, *matcher_,
        [&](const DeviceCorrespondence& other, const cl::Array<float>& shares) {
          layers_.run_blended(band.texels, band.match, other, shares);
        });
  }
  if (method_transitions_)
    report.transitions_blended = method_transitions_->measure(*layers_.unit_vectors());
  report.seconds_match += stopwatch_.lap();
}

/// The last stages: mip chain, padding, encoding.
void Pipeline::finish_maps(Image* drawn) {
  // Frees the memory of bands, which the following stages need
  if (band_storage_ == BandStorage::reused) bands_.clear();
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
    if (band_storage_ == BandStorage::reused) charts_ = {};
    report.seconds_mips += stopwatch_.lap();
  }
  progress_.at(kPaddingProgress, "gutter");
  std::vector<Image> images = layers_.finish(context_, options, band_storage_ == BandStorage::kept,
                                             result_.coverage, report.gutter_texels, drawn);
  result_.maps.clear();
  for (std::size_t l = 0; l < images.size(); ++l) {
    BakedMap map = describe(layers_.all()[l]);
    map.image = std::move(images[l]);
    map.mips = std::move(mips[l]);
    result_.maps.push_back(std::move(map));
  }
  report.seconds_image += stopwatch_.lap();
}

void Pipeline::measure_errors(Clusters& clusters) {
  BakeReport& report = result_.report;
  report.seconds_image += stopwatch_.lap();
  const auto make = [&](const BakeOptions& options) {
    // The notes of the second matcher are dropped, since they repeat those of the bake's matcher
    BakeReport discarded_report;
    return make_matcher(scene_.high, surface_, options, discarded_report, clusters, BakeProgress(),
                        sample_directions_.blends_directions());
  };
  kiln::measure_errors({scene_.high, streamed_part_.get(), surface_, scene_.options,
                        sample_directions_, sheet_distances_, cage_, *matcher_, make,
                        fallback_blend_ ? &*fallback_blend_ : nullptr, layers_},
                       progress_.part(kBlendProgress, kMipsProgress), report);
  report.seconds_errors += stopwatch_.lap();
}

/// Maximum distance of points from the low poly, world units.
double Pipeline::max_point_distance() const {
  const BakeOptions& options = scene_.options;
  const bool has_max_distance =
      options.match.saved == nullptr && !any_match_or_fallback(options, [](const MatchRow& row) {
        return !obeys(row.info, "match.max_distance");
      });
  if (!has_max_distance) return scene_.high.frame.diagonal;
  const MatchRequest request = match_request(options, scene_.high, surface_);
  const double cage =
      std::max(request.cage.value_or(0) * units_per_frame_unit_,
               result_.report.cage_mesh ? result_.report.cage_mesh->max_outward : 0);
  // Rays that start on a cage run through the low poly.
  return std::max(cage, request.distance * units_per_frame_unit_ - (request.cage ? cage : 0));
}

/// Describes a layer's map by its properties that do not depend on the bake, except its ranges.
BakedMap Pipeline::describe(const Layer& layer) const {
  const MapInfo& info = layer.row->info;
  const BakeOptions& options = scene_.options;
  BakedMap map{info.kind, {options.width, options.height, info.channels, {}}, {}, cluster_, info};
  if (obeys(info, "encoding.origin")) map.origin = map_origin(options, scene_.high.frame);
  map.unit = layer.row->unit;
  return map;
}

/// Sets the receivers of the maps that are finished row by row.
void Pipeline::open_rows() {
  if (scene_.open_rows == nullptr) return;
  const double farthest = max_point_distance();
  for (const Layer& layer : layers_.all()) {
    if (!layer.rows) continue;
    BakedMap map = describe(layer);
    map.ranges = ranges_of(*layer.row, {scene_.high, scene_.options, farthest});
    layers_.set_target(layer, (*scene_.open_rows)(map));
  }
}

void Pipeline::finish_report() {
  BakeReport& report = result_.report;
  const double farthest = max_point_distance();
  for (BakedMap& map : result_.maps) {
    const auto layer =
        std::find_if(layers_.all().begin(), layers_.all().end(),
                     [&](const Layer& made) { return made.row->info.kind == map.kind; });
    // A session keeps maps that a moved high poly does not change, but their ranges depend on its size.
    map.ranges = ranges_of(*layer->row, {scene_.high, scene_.options, farthest});
    layer->map_maker->report(map, report.warnings);
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
  open_rows();
  run_over_bands({});
  finish_match(true);
  report_coverage();
  if (method_transitions_)
    result_.report.transitions = method_transitions_->measure(*layers_.unit_vectors());
  blend();
  if (scene_.options.report.errors || layers_.any_map_obeys_max_error(scene_.options)) {
    measure_errors(clusters);
  }
  finish_maps(drawn);
  finish_report();
  progress_.report(1, "done");
  return std::move(result_);
}

Match Pipeline::stored_match() {
  Match match = make_empty_match();
  for (const PipelineBand& band : bands_) {
    store_band(context_, band.texels, band.match, units_per_frame_unit_, match);
  }
  return match;
}

}  // namespace kiln
