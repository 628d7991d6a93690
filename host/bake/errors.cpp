#include "bake/errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "bake/map_units.h"
#include "bake/report.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTexels = 2000, kRays = 4096, kFiner = 4, kMostSamples = 16;
constexpr std::uint32_t kLanes = 64;  // kernels read this far beyond the last sample

bool is_compared(const MapInfo& map) {
  return map.type != MapType::id && map.type != MapType::coverage;
}

/// Some texels of a band, with all of their samples.
TexelBand part_of(cl::Context& context, const TexelBand& band,
                  std::span<const std::uint32_t> texels, std::span<const std::uint32_t> index,
                  std::span<const std::uint32_t> first) {
  std::vector<std::uint32_t> places, firsts{0};
  for (const std::uint32_t t : texels) {
    places.push_back(index[t]);
    firsts.push_back(firsts.back() + first[t + 1] - first[t]);
  }
  TexelBand part;
  part.first_row = band.first_row;
  part.row_count = band.row_count;
  part.texel_count = static_cast<std::uint32_t>(texels.size());
  part.sample_count = firsts.back();
  part.capacity = (part.sample_count + kLanes - 1) / kLanes * kLanes;
  part.texel_index = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(places));
  part.texel_first = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(firsts));
  const auto gather = [&]<typename T>(const cl::Array<T>& from, std::size_t planes) {
    std::vector<T> values(planes * part.capacity), all(band.sample_count);
    for (std::size_t plane = 0; plane < planes; ++plane) {
      from.read(context, all, plane * band.capacity);  // one wait, not one for each texel
      for (std::size_t i = 0; i < texels.size(); ++i) {
        std::copy_n(&all[first[texels[i]]], firsts[i + 1] - firsts[i],
                    &values[plane * part.capacity + firsts[i]]);
      }
    }
    return cl::Array<T>(context, std::span<const T>(values));
  };
  part.sample_slot = gather(band.sample_slot, 1);
  part.triangle = gather(band.triangle, 1);
  part.barycentric = gather(band.barycentric, 2);
  part.points = gather(band.points, 7);
  return part;
}

/// One finer evaluation.
class Finer {
 public:
  Finer(const BakedScene& scene, const BakeOptions& options)
      : scene_(scene),
        options_(options),
        context_(context_of(scene.high.device)),
        layers_(scene.high, scene.surface, options_, false),
        sampler_(context_, scene.surface,
                 {options.width, options.height, options.samples, kBandSamples}) {}

  void run(const BakeProgress& progress, std::uint64_t baked) {
    const std::uint64_t step = std::max<std::uint64_t>(1, (baked + kTexels - 1) / kTexels);
    errors_.resize(layers_.all().size());
    for (std::uint32_t b = 0; b < sampler_.band_count(); ++b) {
      progress.at(static_cast<double>(b) / sampler_.band_count(), "measuring errors");
      band_ = sampler_.sample(b, std::move(band_));
      scene_.turn.apply(context_, band_);
      scene_.cage.apply(context_, band_);
      over_band(step);
    }
  }

  void add_to(std::string_view against, BakeReport& report) {
    for (std::size_t l = 0; l < errors_.size(); ++l) {
      std::vector<double>& errors = errors_[l];
      if (errors.empty()) continue;
      std::sort(errors.begin(), errors.end());
      const MapRow& row = *layers_.all()[l].row;
      MapError error;
      error.kind = row.info.kind;
      error.unit = unit_of(row).name;
      error.texels = static_cast<std::uint32_t>(errors.size());
      error.against = against;
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
  /// The band's texels that are compared.
  std::vector<std::uint32_t> choose(std::span<const std::uint32_t> index, std::uint64_t step) {
    std::vector<std::uint32_t> chosen;
    const std::size_t offset = std::size_t{band_.first_row} * options_.width;
    for (std::uint32_t t = 0; t < band_.texel_count; ++t) {
      if (scene_.layers.coverage()[offset + index[t]] != kCoverageBaked) continue;
      if (passed_ == step / 2) chosen.push_back(t);
      if (++passed_ == step) passed_ = 0;
    }
    return chosen;
  }

  void over_band(std::uint64_t step) {
    std::vector<std::uint32_t> index(band_.texel_count), first(band_.texel_count + std::size_t{1});
    if (band_.texel_count == 0) return;
    band_.texel_index.read(context_, index);
    band_.texel_first.read(context_, first);
    const std::vector<std::uint32_t> chosen = choose(index, step);
    if (chosen.empty()) return;
    layers_.next_band();
    if (scene_.matcher.needs_band()) {
      // The texels are chosen after the match: all of the band is made.
      compare(band_, chosen, index);
      return;
    }
    const TexelBand part = part_of(context_, band_, chosen, index, first);
    compare(part, chosen, index);
  }

  void compare(const TexelBand& texels, std::span<const std::uint32_t> chosen,
               std::span<const std::uint32_t> index) {
    Correspondence match(context_, texels.capacity, layers_.need_visibility());
    match.count = texels.sample_count;
    scene_.matcher.run(texels, match);
    context_.finish();
    const std::size_t size = std::size_t{texels.row_count} * options_.width;
    const std::size_t offset = std::size_t{texels.first_row} * options_.width;
    std::vector<std::uint8_t> coverage(size);
    std::vector<float> values;
    for (std::size_t l = 0; l < errors_.size(); ++l) {
      const Layer& layer = layers_.all()[l];
      const std::size_t channels = layer.row->info.channels;
      values.assign(size * channels, 0.0F);
      layer.maker->run(texels, match, {values, coverage});
      const Image& baked = image_of(layer.row->info.kind);
      for (const std::uint32_t t : chosen) {
        if (coverage[index[t]] != kCoverageBaked) continue;
        errors_[l].push_back(map_difference(*layer.row,
                                            &baked.pixels[(offset + index[t]) * channels],
                                            &values[index[t] * channels]));
      }
    }
  }

  const Image& image_of(MapKind kind) const {
    return std::find_if(scene_.layers.all().begin(), scene_.layers.all().end(),
                        [&](const Layer& layer) { return layer.row->info.kind == kind; })
        ->image;
  }

  const BakedScene& scene_;
  BakeOptions options_;
  cl::Context& context_;
  Layers layers_;
  TexelSampler sampler_;
  TexelBand band_;
  std::uint64_t passed_ = 0;                 // since the last multiple of the step
  std::vector<std::vector<double>> errors_;  // of maps
};

/// The maps of a bake that a finer evaluation is for.
template <typename Wanted>
BakeOptions finer_options(const BakedScene& scene, const Wanted& wanted) {
  BakeOptions options = scene.options;
  options.occlusion.max_error = 0;
  options.occlusion.by = OcclusionBy::rays;
  std::erase_if(options.maps, [&](MapKind kind) { return !wanted(map_row(kind).info); });
  return options;
}

void warn_not_reached(const BakeOptions& options, BakeReport& report) {
  const double wanted = options.occlusion.max_error;
  if (wanted <= 0) return;
  for (const MapError& error : report.errors) {
    const double reached = error.rms / 255;
    if (!map_row(error.kind).info.takes_max_error || reached <= wanted) continue;
    char text[160];
    std::snprintf(text, sizeof text,
                  "The map %s reached an error of %.2g (root mean square), but %.2g was asked for.",
                  std::string(error.kind.name).c_str(), reached, wanted);
    report.warnings.push_back({"ray-error-not-reached", text, 1});
  }
}

}  // namespace

void measure_errors(const BakedScene& scene, const BakeProgress& progress, BakeReport& report) {
  const auto baked = static_cast<std::uint64_t>(
      std::count(scene.layers.coverage().begin(), scene.layers.coverage().end(), kCoverageBaked));
  const bool all = scene.options.report_errors;
  BakeOptions same = finer_options(
      scene, [&](const MapInfo& map) { return all ? map.takes_rays : map.takes_max_error; });
  if (!same.maps.empty()) {
    same.transfers.clear();
    same.own_maps.clear();
    same.occlusion.rays = kRays;
    Finer finer(scene, same);
    finer.run(progress.part(0, 0.5), baked);
    finer.add_to("4096 rays from the same points", report);
    warn_not_reached(scene.options, report);
  }
  if (!all || scene.options.match != nullptr) return;
  BakeOptions spread = finer_options(scene, is_compared);
  if (spread.maps.empty() && spread.transfers.empty() && spread.own_maps.empty()) return;
  spread.samples = std::min(kMostSamples, kFiner * scene.options.samples);
  spread.occlusion.rays = std::max(16U, kRays / (spread.samples * spread.samples));
  Finer finer(scene, spread);
  finer.run(progress.part(0.5, 1), baked);
  finer.add_to(spread.samples == kFiner * scene.options.samples
                   ? "16 times as many points, matched by themselves"
                   : "256 points a texel, matched by themselves",
               report);
}

}  // namespace kiln
