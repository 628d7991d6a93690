// Steps of assess(), each of which computes some of the measures.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kiln/assess.h"
#include "measure/assess_samples.h"

namespace kiln {

/// Values with weights, for weighted means and quantiles.
struct WeightedValues {
  std::vector<std::pair<double, double>> values;
  void add(double value, double weight) { values.emplace_back(value, weight); }
};

/// \param unit  length of one unit of the values, in world units
/// \param area_unit  area of one unit of the weights, in square world units
Distribution distribution(WeightedValues weighted, double unit, double area_unit);

/// Sums over rays: of weights, of weighted values, and of weighted squared values.
class RaySums {
 public:
  void add(double weight, double value, double square) {
    weight_ += weight;
    value_ += value;
    square_ += square;
  }
  /// \param total_weight  total weight of all rays
  /// \param unit  length of one unit of the values, in world units
  RayMeasure measure(double total_weight, double unit) const;

 private:
  double weight_ = 0, value_ = 0, square_ = 0;
};

/// Neighbours of samples in the grid of a match.
class SampleGrid {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  SampleGrid(const AssessedSamples& samples, const Mesh& low, const Match& match);

  /// The neighbour of a sample in the grid, if it is matched and of the same chart; otherwise kNone.
  std::uint32_t neighbour(std::size_t i, int right, int below) const;
  /// The sample at an element of the grid, whether or not it is matched; kNone if the element has
  /// no sample.
  std::uint32_t sample_of(std::size_t element) const { return sample_of_element_[element]; }

 private:
  const AssessedSamples& samples_;
  std::int64_t width_, height_;
  std::vector<std::uint32_t> sample_of_element_;
  std::vector<std::uint32_t> sample_charts_;
};

/// Computes object_space, image_space, normalised_image_space, image_space_over_area, never_visible and directions.
/// \returns false if cancelled
bool rate_rays(const Source::Impl& source, const Mesh& low, const AssessedSamples& samples,
               const AssessOptions& options, MatchAssessment& result);

/// Computes uniformity and uniformity_across_seams.
void rate_uniformity(const Source::Impl& source, const Mesh& low, const Match& match,
                     const AssessedSamples& samples, const SampleGrid& grid, bool fields,
                     MatchAssessment& result);

}  // namespace kiln
