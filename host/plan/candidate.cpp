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
    const auto asked = std::count(bake.maps.begin(), bake.maps.end(), info.kind);
    channels.insert(channels.end(), static_cast<std::size_t>(asked), info.channels);
  }
  for (const MapVariant& map : bake.variants) channels.push_back(map_row(map.kind).info.channels);
  channels.insert(channels.end(), bake.transfers.size() + bake.own_maps.size(), 4);
  return channels;
}

/// Quantises a map to the values that files of `bits` bits per channel store.
Image rounded(Image map, std::uint32_t bits) {
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

MadeCandidate CandidateBuilder::build(std::size_t level, std::uint32_t size) {
  MadeCandidate made;
  made.level = level;
  made.candidate = predict(level, size);
  made.low = size == 0 ? evaluator_.mesh(level) : evaluator_.laid_out(level, size).mesh;
  Candidate& candidate = made.candidate;
  candidate.faces = made.low.triangles.size();
  candidate.positions = made.low.positions.size();
  candidate.vertices = split_vertices(made.low);
  candidate.bytes = low_poly_bytes(candidate.vertices, candidate.faces, size, channels_, bits_);
  const auto positions = static_cast<double>(candidate.positions);
  const Stopwatch watch;
  const NormalProbe probe(impl_of(source_),
                          made.low.uvs.empty() ? with_any_uvs(made.low) : made.low,
                          evaluator_.high_view());
  if (size == 0) {
    vertices_per_position_ = static_cast<double>(candidate.vertices) / positions;
    set_measured(probe.without_map(), candidate);
    evaluator_.record_measured(level, /*mapped=*/false,
                               {candidate.measured, 0, candidate.silhouette_mismatch});
  } else {
    seam_vertices_ = (static_cast<double>(candidate.vertices) - positions) / std::sqrt(positions);
    made.unwrapped = evaluator_.laid_out(level, size).report;
    candidate.charts = made.unwrapped.charts;
    build_map(made, probe);
  }
  plan_.seconds_measure += watch.total();
  return made;
}

/// Bakes the first map at twice the size for which its charts are laid out: its mip levels then calibrate the error
/// model for that size and all smaller ones.
void CandidateBuilder::build_map(MadeCandidate& made, const NormalProbe& probe) {
  Candidate& candidate = made.candidate;
  const std::uint32_t size = candidate.size, largest = std::min(bake_.width, bake_.height);
  made.bake = bake_;
  made.bake.width = made.bake.height = size;
  made.bake.samples = candidate.samples;
  BakeOptions trial = made.bake;
  ask_for(trial, {shading_map(trial).value()});
  trial.encoding.raw = trial.encoding.two_component = trial.report.errors =
      trial.report.keep_match = false;
  trial.report.recall = 0;
  trial.encoding.mips = true;
  if (!knows_maps_ && 2 * size <= largest) {
    trial.width = trial.height = 2 * size;
    trial.samples = std::max(trial.samples / 2, 1U);
  }
  knows_maps_ = true;
  if (!all_directions_) {
    trial.match.visibility.directions =
        std::min(trial.match.visibility.directions, kTrialDirections);
  }
  const std::string doing = "trying " + std::to_string(size) + " x " + std::to_string(size);
  if (bake_.progress) {
    trial.progress = [&](double, std::string_view) { return bake_.progress(0.5, doing); };
  }
  const BakeResult result = widen_search(
      trial,
      [&](const BakeOptions& wide) {
        return bake_drawn(impl_of(source_), made.low, wide, nullptr);
      },
      [](const BakeResult& baked) {
        const BakeReport& report = baked.report;
        return report.samples == 0 ? 0 : static_cast<double>(report.missed) / report.samples;
      });
  made.bake.match.max_distance = trial.match.max_distance;
  const LevelErrors level = evaluator_.mapped_errors(probe);
  evaluator_.record_measured(made.level, /*mapped=*/true, level);
  const BakedMap& map = result.maps.front();
  const auto measure = [&](const Image& image) {
    if (image.width < kSmallestMap) return;
    const NormalError error = probe.with_map(rounded(image, bits_), trial);
    model_.add_measurement(evaluator_.faces(made.level), level, image.width, error.mean_degrees,
                           image.width == size);
    if (image.width == size) set_measured(error, candidate);
  };
  measure(map.image);
  for (const Image& mip : map.mips) measure(mip);
}

void CandidateBuilder::finish(MadeCandidate& made) {
  plan_.unwrapped = made.unwrapped;
  plan_.bake = made.bake;
  plan_.bake.progress = bake_.progress;
  plan_.result = bake_drawn(impl_of(source_), plan_.low, plan_.bake, &plan_.drawn);
  plan_.drawn = rounded(std::move(plan_.drawn), bits_);
  const Stopwatch watch;
  const NormalProbe probe(impl_of(source_), made.low, evaluator_.high_view());
  set_measured(probe.with_map(plan_.drawn, plan_.bake), made.candidate);
  plan_.seconds_measure += watch.total();
  all_directions_ = true;
}

}  // namespace kiln
