#include "kiln/assess.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "accel/ray.h"
#include "base/parallel.h"
#include "kiln/measure.h"
#include "measure/assess_samples.h"
#include "mesh/charts.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;
constexpr std::size_t kGrain = 1 << 15;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;
// Frame units: what a ray passes over, so that a sample's own triangle does not hide it.
constexpr float kSkip = 1e-5F;
constexpr float kBeyond = 64;
// Up to so many directions to avoid, test directions keep 2 degrees from each; more leave no room for that.
constexpr std::size_t kFew = 64;
constexpr double kLeastStretch = -16;

/// Values with weights, to be summed up.
struct Weighted {
  std::vector<std::pair<double, double>> values;
  void add(double value, double weight) { values.emplace_back(value, weight); }
};

double at_share(const std::vector<std::pair<double, double>>& sorted, double total, double share) {
  double below = 0;
  for (const auto& [value, weight] : sorted) {
    below += weight;
    if (below >= share * total) return value;
  }
  return sorted.back().first;
}

/// \param unit, area_unit  world units of a value and of a weight
Distribution distribution(Weighted weighted, double unit, double area_unit) {
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
  result.median = at_share(values, total, 0.5) * unit;
  result.p95 = at_share(values, total, 0.95) * unit;
  result.p99 = at_share(values, total, 0.99) * unit;
  result.max = values.back().first * unit;
  return result;
}

Image empty_field(const Match& match, float value) {
  return {match.width, match.height, 1,
          std::vector<float>(std::size_t{match.width} * match.height, value)};
}

void rate_object_distance(const AssessedSamples& samples, double unit, bool fields,
                          MatchAssessment& result) {
  Weighted distances;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] == 0) continue;
    const double distance = length(samples.match[i] - Vec3d(samples.position[i]));
    distances.add(distance, samples.area[i]);
    if (fields) {
      result.fields.object_distance.pixels[samples.element[i]] =
          static_cast<float>(distance * unit);
    }
  }
  result.object_distance = distribution(std::move(distances), unit, unit * unit);
}

/// The corner of a grid cell and its neighbours to the right and below.
struct Cell {
  std::size_t at, right, below;
};

class Cells {
 public:
  Cells(const AssessedSamples& samples, const Mesh& low, const Match& match)
      : samples_(samples), width_(match.width), height_(match.height) {
    const std::vector<std::uint32_t> charts = uv_charts(low);
    sample_of_.assign(match.status.size(), kNone);
    chart_.resize(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      sample_of_[samples.element[i]] = static_cast<std::uint32_t>(i);
      chart_[i] = charts[samples.triangle[i]];
    }
  }

  /// The sample at a step from one, of the same chart and found; none: kNone.
  std::uint32_t neighbour(std::size_t i, bool below) const {
    const std::size_t element = samples_.element[i];
    if (below ? element / width_ + 1 >= height_ : element % width_ + 1 >= width_) return kNone;
    const std::uint32_t other = sample_of_[element + (below ? width_ : 1)];
    if (other == kNone || samples_.found[other] == 0 || chart_[other] != chart_[i]) return kNone;
    return other;
  }

 private:
  const AssessedSamples& samples_;
  std::size_t width_, height_;
  std::vector<std::uint32_t> sample_of_;
  std::vector<std::uint32_t> chart_;
};

void rate_cells(const AssessedSamples& samples, const Mesh& low, const Match& match, double unit,
                bool fields, MatchAssessment& result) {
  const Cells cells(samples, low, match);
  std::vector<double> stretches;
  std::vector<double> areas;
  double sum = 0, total = 0;
  std::uint64_t folded = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] == 0) continue;
    const std::uint32_t right = cells.neighbour(i, false);
    const std::uint32_t below = cells.neighbour(i, true);
    const auto low_step = [&](std::uint32_t to) {
      return Vec3d(samples.position[to]) - Vec3d(samples.position[i]);
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
    const double light = length(low_area);
    if (!(light > 0)) continue;
    const double stretch = std::max(std::log2(length(high_area) / light), kLeastStretch);
    const bool fold =
        dot(low_area, Vec3d(samples.normal[i])) * dot(high_area, Vec3d(samples.match_normal[i])) <
        0;
    folded += fold ? 1 : 0;
    stretches.push_back(stretch);
    areas.push_back(samples.area[i]);
    sum += stretch * samples.area[i];
    total += samples.area[i];
    if (fields) {
      result.fields.stretch.pixels[samples.element[i]] =
          fold ? -63.0F : static_cast<float>(stretch);
    }
  }
  result.cells = stretches.size();
  if (stretches.empty() || !(total > 0)) return;
  result.mean_stretch = sum / total;
  result.folded = static_cast<double>(folded) / static_cast<double>(result.cells);
  Weighted spread;
  for (std::size_t k = 0; k < stretches.size(); ++k) {
    spread.add(std::abs(stretches[k] - result.mean_stretch), areas[k]);
  }
  result.stretch = distribution(std::move(spread), 1, unit * unit);
}

std::vector<float> planes_of(std::size_t size, std::size_t planes, const auto& vector_of) {
  std::vector<float> result(size * planes, 0.0F);
  parallel_for(size, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 v = vector_of(i);
      result[i] = v.x;
      result[i + size] = v.y;
      result[i + 2 * size] = v.z;
    }
  });
  return result;
}

std::vector<Vec3> test_directions(const AssessOptions& options) {
  // Those of 12 views, too: turned, so that no test direction is one that a match likes to use.
  std::vector<Vec3> avoid = options.avoid;
  if (avoid.empty()) avoid = spread_views(12);
  const bool few = avoid.size() <= kFew && options.directions <= 512;
  return held_out_views(options.directions, avoid, few ? 0.5 : 0.02);
}

/// \returns false where cancelled
bool rate_image_distance(const Source::Impl& source, const Mesh& low, const Match& match,
                         const AssessedSamples& samples, const AssessOptions& options,
                         MatchAssessment& result) {
  const double unit = 1 / source.frame.scale;
  const std::vector<Vec3> directions = test_directions(options);
  result.directions = static_cast<std::uint32_t>(directions.size());
  // Only those that have a match: of others there is nothing to measure.
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] != 0) found.push_back(i);
  }
  if (found.empty()) return true;
  const std::size_t count = found.size();
  cl::Context& context = source.device.context();
  const RayCaster rays(context, source.frame.to_frame(low), low.triangles, source.traversal);
  // Seven planes, as rays have them; the last is not used.
  const cl::Array<float> points(
      context, std::span<const float>(
                   planes_of(count, 7, [&](std::size_t k) { return samples.position[found[k]]; })));
  const cl::Array<float> normals(
      context, std::span<const float>(
                   planes_of(count, 3, [&](std::size_t k) { return samples.normal[found[k]]; })));
  const cl::Array<float> offsets(
      context, std::span<const float>(planes_of(count, 3, [&](std::size_t k) {
        return to_float(samples.match[found[k]] - Vec3d(samples.position[found[k]]));
      })));
  const cl::Array<std::uint8_t> hidden(context, count);
  const cl::Array<float> sums(context, 2 * count);
  context.fill(sums, 0.0F);
  RayQuery query;
  query.t_min = kSkip;
  query.t_max = kBeyond;
  query.two_sided = true;
  kiln_assess_params params{};
  params.count = params.capacity = static_cast<std::uint32_t>(count);
  for (std::size_t k = 0; k < directions.size(); ++k) {
    if (options.progress && !options.progress(0.1 + 0.85 * static_cast<double>(k) /
                                                        static_cast<double>(directions.size()),
                                              "pictures")) {
      return false;
    }
    params.direction[0] = directions[k].x;
    params.direction[1] = directions[k].y;
    params.direction[2] = directions[k].z;
    context.launch(context.kernel("assess", "kiln_assess_aim"), count, kLocal, params, normals,
                   points);
    rays.occluded(points, params.count, params.capacity, query, hidden);
    context.launch(context.kernel("assess", "kiln_assess_gather"), count, kLocal, params, normals,
                   offsets, hidden, sums);
    if (k % 16 == 15) context.finish();
  }
  const std::vector<float> gathered = sums.download(context);
  Weighted distances;
  double pixels = 0, sum = 0, unseen = 0, all = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double area = samples.area[found[k]];
    const double weight = gathered[k];
    all += area;
    if (!(weight > 0)) {
      unseen += area;
      continue;
    }
    const double distance = gathered[k + count] / weight;
    distances.add(distance, area);
    pixels += area * weight;
    sum += area * gathered[k + count];
    if (options.fields) {
      result.fields.image_distance.pixels[samples.element[found[k]]] =
          static_cast<float>(distance * unit);
    }
  }
  result.image_distance = distribution(std::move(distances), unit, unit * unit);
  if (pixels > 0) result.image_distance_plain = sum / pixels * unit;
  if (all > 0) result.never_visible = unseen / all;
  (void)match;
  return true;
}

}  // namespace

MatchAssessment assess(const Source& source, const Mesh& low, const Match& match,
                       const AssessOptions& options) {
  if (options.directions < 12 || options.directions > 4096) {
    throw Error(ErrorCode::usage, "The number of test directions is " +
                                      std::to_string(options.directions) +
                                      ": it must be 12 to 4096.");
  }
  const auto start = std::chrono::steady_clock::now();
  const Source::Impl& high = source.impl();
  const double unit = 1 / high.frame.scale;
  MatchAssessment result;
  result.diagonal = high.frame.diagonal;
  const AssessedSamples samples = assessed_samples(high, low, match);
  result.samples = samples.size();
  result.missed = static_cast<std::uint64_t>(
      std::count(samples.found.begin(), samples.found.end(), std::uint8_t{0}));
  if (options.fields) {
    result.fields = {empty_field(match, -1), empty_field(match, -1), empty_field(match, -64)};
  }
  rate_object_distance(samples, unit, options.fields, result);
  rate_cells(samples, low, match, unit, options.fields, result);
  if (!rate_image_distance(high, low, match, samples, options, result)) {
    result = {};
    result.cancelled = true;
    return result;
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace kiln
