#include "plan/candidate.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "bake/pipeline.h"
#include "base/stopwatch.h"
#include "detail/registry.h"
#include "plan/settings.h"
#include "plan/widen_search.h"

namespace kiln {

using namespace plan_settings;

namespace {

std::vector<std::uint32_t> map_channels(const BakeOptions& bake) {
  std::vector<std::uint32_t> channels;
  for (const MapInfo& info : maps()) {
    const auto map_count = std::count(bake.maps.begin(), bake.maps.end(), info.kind);
    channels.insert(channels.end(), static_cast<std::size_t>(map_count), info.channels);
  }
  for (const MapVariant& map : bake.variants) channels.push_back(map_row(map.kind).info.channels);
  channels.insert(channels.end(), bake.transfers.size() + bake.own_maps.size(), 4);
  return channels;
}

/// Quantises a map to the values that files of `bits` bits per channel store.
Image quantize_map(Image map, std::uint32_t bits) {
  const float steps = static_cast<float>((1U << bits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * steps + 0.5F) / steps;
  }
  return map;
}

}  // namespace

void set_measured(const NormalError& error, Candidate& candidate) {
  candidate.measured = error.mean_degrees;
  candidate.standard_error = error.standard_error_degrees;
  candidate.silhouette_mismatch = error.one_sided_share;
}

CandidateBuilder::CandidateBuilder(const Source& source, const LowPolyPlanOptions& options,
                                   const BakeOptions& bake, LevelEvaluator& evaluator,
                                   LowPolyPlan& plan)
    : source_(source),
      options_(options),
      bake_(bake),
      evaluator_(evaluator),
      plan_(plan),
      bits_(options.bits != 0                          ? options.bits
            : options.max_error < kMin8BitErrorDegrees ? 16
                                                       : 8),
      channels_(map_channels(bake)) {}

std::uint32_t CandidateBuilder::samples_for(std::uint32_t size) const {
  // Texels of larger maps cover less of rendered pictures, so they need fewer samples each.
  return options_.choose_samples ? std::clamp(1024 / std::max(size, 1U), 1U, 4U) : bake_.samples;
}

std::uint64_t CandidateBuilder::vertices_of(std::size_t level, std::uint32_t size) const {
  const auto count = static_cast<double>(evaluator_.levels().vertices(level));
  // Seams are curves on the surface, so the number of their vertices grows with the square root of the vertex count.
  return static_cast<std::uint64_t>(size == 0 ? vertices_per_position_ * count
                                              : count + seam_vertices_ * std::sqrt(count));
}

LowPolyBytes CandidateBuilder::bytes_of(std::size_t level, std::uint32_t size) const {
  return low_poly_bytes(vertices_of(level, size), evaluator_.levels().faces(level), size, channels_,
                        bits_);
}

double CandidateBuilder::expected_error(std::size_t level, std::uint32_t size) const {
  if (size == 0) return evaluator_.at(level, /*mapped=*/false).without_map;
  return model_.expected(evaluator_.faces(level), evaluator_.at(level, /*mapped=*/true), size);
}

Candidate CandidateBuilder::predict(std::size_t level, std::uint32_t size) const {
  Candidate candidate;
  candidate.faces = evaluator_.levels().faces(level);
  candidate.positions = evaluator_.levels().vertices(level);
  candidate.vertices = vertices_of(level, size);
  candidate.size = size;
  candidate.samples = samples_for(size);
  candidate.bits = bits_;
  candidate.method = bake_.match.method;
  candidate.bytes = bytes_of(level, size);
  candidate.expected = expected_error(level, size);
  return candidate;
}

BuiltCandidate CandidateBuilder::build(std::size_t level, std::uint32_t size) {
  BuiltCandidate built;
  built.level = level;
  built.candidate = predict(level, size);
  built.low = size == 0 ? evaluator_.mesh(level) : evaluator_.unwrapped(level, size).mesh;
  Candidate& candidate = built.candidate;
  candidate.faces = built.low.triangles.size();
  candidate.positions = built.low.positions.size();
  candidate.vertices = split_vertices(built.low);
  candidate.bytes = low_poly_bytes(candidate.vertices, candidate.faces, size, channels_, bits_);
  const auto positions = static_cast<double>(candidate.positions);
  const Stopwatch watch;
  const NormalProbe probe(impl_of(source_),
                          built.low.uvs.empty() ? add_placeholder_uvs(built.low) : built.low,
                          evaluator_.high_view());
  if (size == 0) {
    vertices_per_position_ = static_cast<double>(candidate.vertices) / positions;
    set_measured(probe.without_map(), candidate);
    evaluator_.record_measured(level, /*mapped=*/false,
                               {candidate.measured, 0, candidate.silhouette_mismatch});
  } else {
    seam_vertices_ = (static_cast<double>(candidate.vertices) - positions) / std::sqrt(positions);
    built.unwrapped = evaluator_.unwrapped(level, size).report;
    candidate.charts = built.unwrapped.charts;
    build_map(built, probe);
  }
  plan_.seconds_measure += watch.total();
  return built;
}

/// Bakes the first map at twice the size for which its charts are laid out: its mip levels then calibrate the error
/// model for that size and all smaller ones.
void CandidateBuilder::build_map(BuiltCandidate& built, const NormalProbe& probe) {
  Candidate& candidate = built.candidate;
  const std::uint32_t size = candidate.size, largest_size = std::min(bake_.width, bake_.height);
  built.bake = bake_;
  built.bake.width = built.bake.height = size;
  built.bake.samples = candidate.samples;
  BakeOptions trial_options = built.bake;
  request_only(trial_options, {shading_map(trial_options).value()});
  trial_options.encoding.raw = trial_options.encoding.two_component = trial_options.report.errors =
      trial_options.report.keep_match = false;
  trial_options.report.recall = 0;
  trial_options.encoding.mips = true;
  if (!has_map_errors_ && 2 * size <= largest_size) {
    trial_options.width = trial_options.height = 2 * size;
    trial_options.samples = std::max(trial_options.samples / 2, 1U);
  }
  has_map_errors_ = true;
  if (!uses_all_directions_) {
    trial_options.match.visibility.directions =
        std::min(trial_options.match.visibility.directions, kTrialDirections);
  }
  const std::string progress_text = "trying " + std::to_string(size) + " x " + std::to_string(size);
  if (bake_.progress) {
    trial_options.progress = [&](double, std::string_view) {
      return bake_.progress(0.5, progress_text);
    };
  }
  const BakeResult result = widen_search(
      trial_options,
      [&](const BakeOptions& wide_options) {
        return bake_drawn(impl_of(source_), built.low, wide_options, nullptr);
      },
      [](const BakeResult& baked) {
        const BakeReport& report = baked.report;
        return report.samples == 0 ? 0 : static_cast<double>(report.missed) / report.samples;
      });
  built.bake.match.max_distance = trial_options.match.max_distance;
  const LevelErrors level = evaluator_.mapped_errors(probe);
  evaluator_.record_measured(built.level, /*mapped=*/true, level);
  const BakedMap& map = result.maps.front();
  const auto measure = [&](const Image& image) {
    if (image.width < kSmallestMap) return;
    const NormalError error = probe.with_map(quantize_map(image, bits_), trial_options);
    model_.add_measurement(evaluator_.faces(built.level), level, image.width, error.mean_degrees,
                           image.width == size);
    if (image.width == size) set_measured(error, candidate);
  };
  measure(map.image);
  for (const Image& mip : map.mips) measure(mip);
}

void CandidateBuilder::finish(BuiltCandidate& built) {
  plan_.unwrapped = built.unwrapped;
  plan_.bake = built.bake;
  plan_.bake.progress = bake_.progress;
  plan_.result = bake_drawn(impl_of(source_), plan_.low, plan_.bake, &plan_.drawn);
  plan_.drawn = quantize_map(std::move(plan_.drawn), bits_);
  const Stopwatch watch;
  const NormalProbe probe(impl_of(source_), built.low, evaluator_.high_view());
  set_measured(probe.with_map(plan_.drawn, plan_.bake), built.candidate);
  plan_.seconds_measure += watch.total();
  uses_all_directions_ = true;
}

}  // namespace kiln
