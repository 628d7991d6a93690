#include "kiln/assess.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "measure/assess_parts.h"

namespace kiln {
namespace {

constexpr double kMinStretch = -16;

double weighted_quantile(const std::vector<std::pair<double, double>>& sorted, double total,
                         double share) {
  double weight_sum = 0;
  for (const auto& [value, weight] : sorted) {
    weight_sum += weight;
    if (weight_sum >= share * total) return value;
  }
  return sorted.back().first;
}

Image uniform_image(const Match& match, float value) {
  return {match.width, match.height, 1,
          std::vector<float>(std::size_t{match.width} * match.height, value)};
}

void rate_match_distance(const AssessedSamples& samples, double unit, bool fields,
                         MatchAssessment& result) {
  WeightedValues weighted_distances;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] == 0) continue;
    const double distance = length(samples.match[i] - to_double(samples.position[i]));
    weighted_distances.add(distance, samples.area[i]);
    if (fields) {
      result.fields.match_distance.pixels[samples.element[i]] = static_cast<float>(distance * unit);
    }
  }
  result.match_distance = distribution(std::move(weighted_distances), unit, unit * unit);
}

/// Rates the stretch of the cells of the sampling grid. A cell is spanned by a sample and its neighbours to the right
/// and below.
void rate_cells(const AssessedSamples& samples, const SampleGrid& grid, double unit, bool fields,
                MatchAssessment& result) {
  constexpr std::uint32_t kNone = SampleGrid::kNone;
  std::vector<double> log2_stretches;
  std::vector<double> cell_areas;
  double sum = 0, total = 0;
  std::uint64_t folded_cells = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] == 0) continue;
    const std::uint32_t right = grid.neighbour(i, 1, 0);
    const std::uint32_t below = grid.neighbour(i, 0, 1);
    const auto low_step = [&](std::uint32_t to) {
      return to_double(samples.position[to]) - to_double(samples.position[i]);
    };
    const auto high_step = [&](std::uint32_t to) { return samples.match[to] - samples.match[i]; };
    for (const std::uint32_t to : {right, below}) {
      if (to == kNone) continue;
      result.largest_jump = std::max(result.largest_jump, length(high_step(to)) * unit);
      result.largest_step = std::max(result.largest_step, length(low_step(to)) * unit);
    }
    if (right == kNone || below == kNone) continue;
    const Vec3d low_area = cross(low_step(right), low_step(below));
    const Vec3d high_area = cross(high_step(right), high_step(below));
    const double low_size = length(low_area);
    if (!(low_size > 0)) continue;
    const double stretch = std::max(std::log2(length(high_area) / low_size), kMinStretch);
    const bool is_folded = dot(low_area, to_double(samples.normal[i])) *
                               dot(high_area, to_double(samples.match_normal[i])) <
                           0;
    folded_cells += is_folded ? 1 : 0;
    log2_stretches.push_back(stretch);
    cell_areas.push_back(samples.area[i]);
    sum += stretch * samples.area[i];
    total += samples.area[i];
    if (fields) {
      result.fields.stretch.pixels[samples.element[i]] =
          is_folded ? -63.0F : static_cast<float>(stretch);
    }
  }
  result.cells = log2_stretches.size();
  if (log2_stretches.empty() || !(total > 0)) return;
  result.mean_stretch = sum / total;
  result.folded = static_cast<double>(folded_cells) / static_cast<double>(result.cells);
  WeightedValues weighted_spreads;
  for (std::size_t k = 0; k < log2_stretches.size(); ++k) {
    weighted_spreads.add(std::abs(log2_stretches[k] - result.mean_stretch), cell_areas[k]);
  }
  result.stretch = distribution(std::move(weighted_spreads), 1, unit * unit);
}

}  // namespace

Distribution distribution(WeightedValues weighted, double unit, double area_unit) {
  Distribution result;
  auto& values = weighted.values;
  if (values.empty()) return result;
  std::sort(values.begin(), values.end());
  double total = 0, sum = 0, squares = 0;
  for (const auto& [value, weight] : values) {
    total += weight;
    sum += value * weight;
    squares += value * value * weight;
  }
  result.area = total * area_unit;
  if (total > 0) {
    result.mean = sum / total * unit;
    result.rms = std::sqrt(squares / total) * unit;
  }
  result.median = weighted_quantile(values, total, 0.5) * unit;
  result.p95 = weighted_quantile(values, total, 0.95) * unit;
  result.p99 = weighted_quantile(values, total, 0.99) * unit;
  result.max = values.back().first * unit;
  return result;
}

MatchAssessment assess(const Source& source, const Mesh& low, const Match& match,
                       const AssessOptions& options) {
  if (options.directions < 12 || options.directions > 4096) {
    throw Error(ErrorCode::usage, "The number of test directions is " +
                                      std::to_string(options.directions) +
                                      ": it must be 12 to 4096.");
  }
  const auto start = std::chrono::steady_clock::now();
  const Source::Impl& high = impl_of(source);
  const double unit = 1 / high.frame.scale;
  MatchAssessment result;
  result.diagonal = high.frame.diagonal;
  const AssessedSamples samples = assessed_samples(high, low, match);
  result.samples = samples.size();
  result.missed = static_cast<std::uint64_t>(
      std::count(samples.found.begin(), samples.found.end(), std::uint8_t{0}));
  if (options.fields) {
    const Image none = uniform_image(match, -1);
    result.fields = {none, none, none, none, none, uniform_image(match, -64)};
  }
  rate_match_distance(samples, unit, options.fields, result);
  const SampleGrid grid(samples, low, match);
  rate_cells(samples, grid, unit, options.fields, result);
  rate_uniformity(high, low, match, samples, grid, options.fields, result);
  if (!rate_rays(high, low, samples, options, result)) {
    result = {};
    result.cancelled = true;
    return result;
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace kiln
