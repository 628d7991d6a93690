#include "bake/errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <utility>

#include "bake/map_units.h"
#include "bake/report.h"
#include "base/formatted.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

constexpr std::uint32_t kComparedTexels = 2000, kReferenceRays = 4096, kFinerSamples = 4,
                        kMaxSamples = 16;
// kernels read samples in multiples of this number
constexpr std::uint32_t kSampleGranularity = 64;

bool is_compared(const MapInfo& map) {
  return map.type != MapType::id && map.type != MapType::coverage;
}

/// Copies the given texels of a band, with all their samples, to a smaller band.
TexelBand pick_texels(cl::Context& context, const TexelBand& band,
                      std::span<const std::uint32_t> places,
                      std::span<const std::uint32_t> first_samples, const SamplePick& texel_pick) {
  TexelBand part;
  part.first_row = band.first_row;
  part.row_count = band.row_count;
  part.texel_count = static_cast<std::uint32_t>(places.size());
  part.sample_count = texel_pick.count();
  part.samples = band.samples;
  part.capacity = texel_pick.capacity();
  part.small_triangles = band.small_triangles;
  part.texel_index = cl::Array<std::uint32_t>(context, places);
  part.texel_first = cl::Array<std::uint32_t>(context, first_samples);
  part.sample_slot = texel_pick.of(band.sample_slot, band.capacity, 1);
  part.triangle = texel_pick.of(band.triangle, band.capacity, 1);
  part.barycentric = texel_pick.of(band.barycentric, band.capacity, 2);
  part.points = texel_pick.of(band.points, band.capacity, 7);
  return part;
}

/// The texels of a band whose errors are measured.
struct ComparedTexels {
  TexelBand band;                     ///< These texels alone, with all their samples
  std::vector<std::uint32_t> places;  ///< Index of each texel in the band's rows
};

/// Joins the samples of several bands to one, from which a match can be run.
TexelBand join_samples(cl::Context& context, std::span<const ComparedTexels> parts) {
  TexelBand joined;
  joined.samples = parts.front().band.samples;
  joined.small_triangles = parts.front().band.small_triangles;
  for (const ComparedTexels& part : parts) joined.sample_count += part.band.sample_count;
  joined.capacity =
      (joined.sample_count + kSampleGranularity - 1) / kSampleGranularity * kSampleGranularity;
  const auto join = [&]<typename T>(cl::Array<T> TexelBand::*member, std::uint32_t planes) {
    std::vector<T> values(std::size_t{planes} * joined.capacity);
    for (std::uint32_t p = 0; p < planes; ++p) {
      std::size_t at = std::size_t{p} * joined.capacity;
      for (const ComparedTexels& part : parts) {
        (part.band.*member)
            .read(context, std::span(values).subspan(at, part.band.sample_count),
                  std::size_t{p} * part.band.capacity);
        at += part.band.sample_count;
      }
    }
    joined.*member = cl::Array<T>(context, std::span<const T>(values));
  };
  join(&TexelBand::triangle, 1);
  join(&TexelBand::barycentric, 2);
  join(&TexelBand::points, 7);
  return joined;
}

/// One finer evaluation of a bake's maps.
///
/// A high poly in memory is matched band by band. One that is larger than memory is read once for each match, so the
/// compared texels of all bands, which are few, are matched together.
class FinerEvaluation {
 public:
  FinerEvaluation(const BakedScene& scene, const BakeOptions& options)
      : scene_(scene),
        options_(options),
        context_(context_of(scene.high.device)),
        layers_(scene.streamed_part != nullptr ? *scene.streamed_part : scene.high, scene.surface,
                options_, ImageStorage::none, 1, /*is_reference=*/true),
        sampler_(context_, scene.surface,
                 {options.width, options.height, options.samples, kBandSamples}),
        own_matcher_(options.samples != scene.options.samples &&
                             scene.matcher.reads_sample_positions()
                         ? scene.make_matcher(options_)
                         : nullptr),
        matcher_(own_matcher_ != nullptr ? *own_matcher_ : scene.matcher) {}

  void run(const BakeProgress& progress, std::uint64_t baked) {
    const std::uint64_t comparison_interval =
        std::max<std::uint64_t>(1, (baked + kComparedTexels - 1) / kComparedTexels);
    map_errors_.resize(layers_.all().size());
    for (std::uint32_t b = 0; b < sampler_.band_count(); ++b) {
      progress.at(static_cast<double>(b) / sampler_.band_count(), "measuring errors");
      sampled_band_ = sampler_.sample(b, std::move(sampled_band_));
      scene_.directions.set_directions(context_, sampled_band_);
      scene_.sheet_distances.write_search_distances(context_, sampled_band_);
      scene_.cage.write_sample_reach(context_, sampled_band_);
      add_compared_texels(comparison_interval);
      if (scene_.streamed_part == nullptr) evaluate_compared_texels();
    }
    evaluate_compared_texels();
  }

  void add_errors_to(std::string_view reference, BakeReport& report) {
    for (std::size_t l = 0; l < map_errors_.size(); ++l) {
      std::vector<double>& errors = map_errors_[l];
      if (errors.empty()) continue;
      std::sort(errors.begin(), errors.end());
      const MapRow& row = *layers_.all()[l].row;
      MapError error;
      error.kind = row.info.kind;
      error.unit = unit_of(row).name;
      error.texels = static_cast<std::uint32_t>(errors.size());
      error.reference = reference;
      for (const double e : errors) {
        error.mean += e / static_cast<double>(errors.size());
        error.rms += e * e / static_cast<double>(errors.size());
      }
      error.rms = std::sqrt(error.rms);
      error.p95 = errors[(errors.size() * 95 + 99) / 100 - 1];
      error.max = errors.back();
      report.errors.push_back(error);
    }
  }

 private:
  /// Chooses the texels of a band whose errors are measured.
  std::vector<std::uint32_t> choose_texels(std::span<const std::uint32_t> index,
                                           std::uint64_t comparison_interval) {
    std::vector<std::uint32_t> chosen_texels;
    const std::size_t offset = std::size_t{sampled_band_.first_row} * options_.width;
    for (std::uint32_t t = 0; t < sampled_band_.texel_count; ++t) {
      if (scene_.layers.coverage()[offset + index[t]] != kCoverageBaked) continue;
      if (texels_since_comparison_ == comparison_interval / 2) chosen_texels.push_back(t);
      if (++texels_since_comparison_ == comparison_interval) texels_since_comparison_ = 0;
    }
    return chosen_texels;
  }

  /// Copies those texels of the sampled band whose errors are measured.
  void add_compared_texels(std::uint64_t comparison_interval) {
    std::vector<std::uint32_t> index(sampled_band_.texel_count),
        first(sampled_band_.texel_count + std::size_t{1});
    if (sampled_band_.texel_count == 0) return;
    sampled_band_.texel_index.read(context_, index);
    sampled_band_.texel_first.read(context_, first);
    const std::vector<std::uint32_t> chosen_texels = choose_texels(index, comparison_interval);
    if (chosen_texels.empty()) return;
    std::vector<std::uint32_t> places, first_samples{0}, samples;
    for (const std::uint32_t t : chosen_texels) {
      places.push_back(index[t]);
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) samples.push_back(s);
      first_samples.push_back(static_cast<std::uint32_t>(samples.size()));
    }
    const SamplePick texel_pick(context_, samples, kSampleGranularity);
    TexelBand band = pick_texels(context_, sampled_band_, places, first_samples, texel_pick);
    compared_texels_.push_back({std::move(band), std::move(places)});
  }

  /// Matches the texels of add_compared_texels(), and adds the errors of their maps.
  void evaluate_compared_texels() {
    const std::vector<ComparedTexels> parts = std::exchange(compared_texels_, {});
    if (parts.size() == 1) {
      const DeviceCorrespondence match = run_match(parts.front().band);
      add_errors_of(parts.front(), match);
      return;
    }
    if (parts.empty()) return;
    const DeviceCorrespondence joined = run_match(join_samples(context_, parts));
    std::uint32_t first = 0;
    for (const ComparedTexels& part : parts) {
      std::vector<std::uint32_t> samples(part.band.sample_count);
      std::iota(samples.begin(), samples.end(), first);
      first += part.band.sample_count;
      add_errors_of(part, SamplePick(context_, samples, kSampleGranularity).of(joined));
    }
  }

  DeviceCorrespondence run_match(const TexelBand& band) {
    DeviceCorrespondence match(context_, band.capacity, layers_.any_map_needs_visibility());
    match.count = band.sample_count;
    matcher_.run(band, match);
    context_.finish();
    if (scene_.streamed_part == nullptr) return match;
    scene_.streamed_part->read_matched(match);
    layers_.invalidate_source_results();
    return match;
  }

  void add_errors_of(const ComparedTexels& texels, const DeviceCorrespondence& match) {
    make(texels.band, match);
    for (std::size_t l = 0; l < map_errors_.size(); ++l) compare_map(l, texels);
  }

  /// Evaluates some texels of a band in all maps. Each keeps all its samples, so that matchers can treat the texels as
  /// a band.
  void make(const TexelBand& texels, const DeviceCorrespondence& match) {
    const std::size_t size = std::size_t{texels.row_count} * options_.width;
    finer_coverage_.assign(size, kCoverageEmpty);
    finer_values_.resize(map_errors_.size());
    layers_.invalidate_band_results();
    for (std::size_t l = 0; l < map_errors_.size(); ++l) {
      const Layer& layer = layers_.all()[l];
      finer_values_[l].assign(size * layer.row->info.channels, 0.0F);
      layer.map_maker->run(texels, match, {finer_values_[l], finer_coverage_});
    }
    if (scene_.blend == nullptr) return;
    scene_.blend->run(context_, texels, matcher_,
                      [&](const DeviceCorrespondence& other, const cl::Array<float>& shares) {
                        layers_.invalidate_band_results();
                        for (std::size_t l = 0; l < map_errors_.size(); ++l) {
                          layers_.all()[l].map_maker->run_blended(
                              texels, match, other, shares, {finer_values_[l], finer_coverage_});
                        }
                      });
  }

  void compare_map(std::size_t layer, const ComparedTexels& texels) {
    const MapRow& row = *layers_.all()[layer].row;
    const std::size_t channels = row.info.channels;
    const std::size_t offset = std::size_t{texels.band.first_row} * options_.width;
    const Image& baked = baked_image(row.info.kind);
    for (const std::uint32_t place : texels.places) {
      if (finer_coverage_[place] != kCoverageBaked) continue;
      map_errors_[layer].push_back(map_difference(row, &baked.pixels[(offset + place) * channels],
                                                  &finer_values_[layer][place * channels]));
    }
  }

  const Image& baked_image(MapKind kind) const {
    return std::find_if(scene_.layers.all().begin(), scene_.layers.all().end(),
                        [&](const Layer& layer) { return layer.row->info.kind == kind; })
        ->image;
  }

  const BakedScene& scene_;
  BakeOptions options_;
  cl::Context& context_;
  Layers layers_;
  TexelSampler sampler_;
  // Used instead of the bake's matcher if that matcher supports only the bake's own number of
  // samples per texel
  std::unique_ptr<Matcher> own_matcher_;
  Matcher& matcher_;
  TexelBand sampled_band_;
  std::vector<ComparedTexels> compared_texels_;   // Not evaluated yet
  std::vector<std::vector<float>> finer_values_;  // Finer values of the band's texels, for each map
  std::vector<std::uint8_t> finer_coverage_;
  // Number of texels since the last texel that was compared
  std::uint64_t texels_since_comparison_ = 0;
  std::vector<std::vector<double>> map_errors_;  // Errors of all compared texels, for each map
};

/// Returns the bake's options, reduced to the maps that a finer evaluation compares.
template <typename Wanted>
BakeOptions finer_options(const BakedScene& scene, const Wanted& wanted) {
  BakeOptions options = scene.options;
  change_occlusion(options, [](OcclusionOptions& occlusion) {
    occlusion.max_error = 0;
    occlusion.by = OcclusionBy::rays;
  });
  std::erase_if(options.maps, [&](MapKind kind) { return !wanted(map_row(kind).info); });
  std::erase_if(options.variants,
                [&](const MapVariant& map) { return !wanted(map_row(map.kind).info); });
  return options;
}

void warn_about_unmet_bounds(const BakeOptions& options, BakeReport& report) {
  const auto check = [&](MapKind kind, std::string_view name, double wanted) {
    const auto error = std::find_if(report.errors.begin(), report.errors.end(),
                                    [&](const MapError& other) { return other.kind.name == name; });
    if (wanted <= 0 || !obeys(map_row(kind).info, "occlusion.max_error") ||
        error == report.errors.end() || error->rms / 255 <= wanted) {
      return;
    }
    const std::string text =
        formatted("The map %s has an error of %.3g (root mean square), above the bound of %.3g.",
                  std::string(name).c_str(), error->rms / 255, wanted);
    report.warnings.push_back({"ray-error-not-reached", text, 1});
  };
  for (const MapKind map : options.maps) check(map, map.name, options.occlusion.max_error);
  for (const MapVariant& map : options.variants)
    check(map.kind, map.name, options_of(map, options).occlusion.max_error);
}

}  // namespace

void measure_errors(const BakedScene& scene, const BakeProgress& progress, BakeReport& report) {
  const auto baked = static_cast<std::uint64_t>(
      std::count(scene.layers.coverage().begin(), scene.layers.coverage().end(), kCoverageBaked));
  const bool compares_errors = scene.options.report.errors;
  BakeOptions same_points = finer_options(scene, [&](const MapInfo& map) {
    return obeys(map, compares_errors ? "occlusion.rays" : "occlusion.max_error");
  });
  if (!same_points.maps.empty() || !same_points.variants.empty()) {
    same_points.transfers.clear();
    same_points.own_maps.clear();
    change_occlusion(same_points,
                     [](OcclusionOptions& occlusion) { occlusion.rays = kReferenceRays; });
    FinerEvaluation finer(scene, same_points);
    finer.run(progress.part(0, 0.5), baked);
    finer.add_errors_to("4096 rays from the same points", report);
    warn_about_unmet_bounds(scene.options, report);
  }
  if (!compares_errors || scene.options.match.saved != nullptr) return;
  BakeOptions finer_sampling = finer_options(scene, is_compared);
  if (map_count(finer_sampling) == 0) return;
  finer_sampling.samples = std::min(kMaxSamples, kFinerSamples * scene.options.samples);
  change_occlusion(finer_sampling, [&](OcclusionOptions& occlusion) {
    occlusion.rays =
        std::max(16U, kReferenceRays / (finer_sampling.samples * finer_sampling.samples));
  });
  FinerEvaluation finer(scene, finer_sampling);
  finer.run(progress.part(0.5, 1), baked);
  finer.add_errors_to(finer_sampling.samples == kFinerSamples * scene.options.samples
                          ? "16 times as many points, each matched separately"
                          : "256 points a texel, each matched separately",
                      report);
}

}  // namespace kiln
