// Uniformity of a match's samples on the high poly (Tarini, Cignoni, Scopigno 2003, section 4.3).
#include <cmath>

#include "measure/assess_parts.h"
#include "mesh/charts.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "mesh/surface_links.h"

namespace kiln {
namespace {

/// Minimum distance in texels of a pair of samples across a seam; closer pairs are skipped.
constexpr double kMinPairDistance = 0.5;

/// Mean of percentages.
class MeanPercentage {
 public:
  void add(double percent) {
    sum_ += percent;
    ++value_count_;
  }
  double mean() const { return value_count_ == 0 ? 0 : sum_ / static_cast<double>(value_count_); }
  std::uint64_t count() const { return value_count_; }

 private:
  double sum_ = 0;
  std::uint64_t value_count_ = 0;
};

class SampleDistances {
 public:
  explicit SampleDistances(const AssessedSamples& samples) : samples_(samples) {}

  double low_distance(std::size_t a, std::size_t b) const {
    return length(to_double(samples_.position[a]) - to_double(samples_.position[b]));
  }
  /// For a pair of samples: how much the distance between their matched points differs from the distance between the
  /// samples, in % of the latter.
  double difference_percent(std::size_t a, std::size_t b) const {
    return 100 * std::abs(length(samples_.match[a] - samples_.match[b]) / low_distance(a, b) - 1);
  }

 private:
  const AssessedSamples& samples_;
};

Uniformity uniformity_across_seams(const Source::Impl& source, const Mesh& low, const Match& match,
                                   const AssessedSamples& samples, const SampleGrid& grid) {
  const LowSurface surface = LowSurface::of(low, source.frame);
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  std::vector<std::uint32_t> triangle(match.status.size(), KILN_NO_TRIANGLE);
  for (std::size_t i = 0; i < samples.size(); ++i)
    triangle[samples.element[i]] = samples.triangle[i];
  const TexelLinks links = TexelLinks::of(surface, topology, triangle, match.width, match.height);
  // Element offsets to the neighbours, in the order of TexelLinks: left, right, above, below.
  const std::array<std::int64_t, 4> neighbour_offsets = {-1, 1, -std::int64_t{match.width},
                                                         std::int64_t{match.width}};
  const SampleDistances distance(samples);
  MeanPercentage mean_percentage;
  for (std::size_t link = 0; link < links.links.size(); link += 9) {
    const std::uint32_t element = links.links[link];
    const std::uint32_t i = grid.sample_of(element);
    if (samples.found[i] == 0) continue;
    for (std::size_t k = 0; k < neighbour_offsets.size(); ++k) {
      const std::uint32_t other = links.links[link + 1 + k];
      if (other == KILN_VISIBILITY_NO_LINK || other == element + neighbour_offsets[k]) continue;
      const std::uint32_t j = grid.sample_of(other);
      if (samples.found[j] == 0) continue;
      if (!(distance.low_distance(i, j) >= kMinPairDistance * std::sqrt(samples.area[i]))) continue;
      mean_percentage.add(distance.difference_percent(i, j));
    }
  }
  return {mean_percentage.mean(), mean_percentage.count()};
}

}  // namespace

SampleGrid::SampleGrid(const AssessedSamples& samples, const Mesh& low, const Match& match)
    : samples_(samples), width_(match.width), height_(match.height) {
  const std::vector<std::uint32_t> charts = uv_charts(low);
  sample_of_element_.assign(match.status.size(), kNone);
  sample_charts_.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    sample_of_element_[samples.element[i]] = static_cast<std::uint32_t>(i);
    sample_charts_[i] = charts[samples.triangle[i]];
  }
}

std::uint32_t SampleGrid::neighbour(std::size_t i, int right, int below) const {
  const auto element = static_cast<std::int64_t>(samples_.element[i]);
  const std::int64_t x = element % width_ + right, y = element / width_ + below;
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return kNone;
  const std::uint32_t other = sample_of_element_[static_cast<std::size_t>(y * width_ + x)];
  if (other == kNone || samples_.found[other] == 0 || sample_charts_[other] != sample_charts_[i])
    return kNone;
  return other;
}

void rate_uniformity(const Source::Impl& source, const Mesh& low, const Match& match,
                     const AssessedSamples& samples, const SampleGrid& grid, bool fields,
                     MatchAssessment& result) {
  const SampleDistances distance(samples);
  MeanPercentage pair_percentages;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] == 0) continue;
    MeanPercentage neighbour_percentages;
    const auto add_pair = [&](int right, int below, bool counts) {
      const std::uint32_t other = grid.neighbour(i, right, below);
      if (other == SampleGrid::kNone || !(distance.low_distance(i, other) > 0)) return;
      const double percent = distance.difference_percent(i, other);
      neighbour_percentages.add(percent);
      if (counts) pair_percentages.add(percent);
    };
    // Each pair of neighbours counts once, at the sample to the left or above.
    add_pair(1, 0, true);
    add_pair(0, 1, true);
    if (!fields) continue;
    add_pair(-1, 0, false);
    add_pair(0, -1, false);
    if (neighbour_percentages.count() == 0) continue;
    result.fields.uniformity.pixels[samples.element[i]] =
        static_cast<float>(neighbour_percentages.mean());
  }
  result.uniformity = {pair_percentages.mean(), pair_percentages.count()};
  result.uniformity_across_seams = uniformity_across_seams(source, low, match, samples, grid);
}

}  // namespace kiln
