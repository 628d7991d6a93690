// Sums of directions at points of a surface, and their means.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "kiln/match.h"
#include "mesh/vector.h"

namespace kiln {

/// Weighted sum of directions, and sum of their weights.
struct DirectionSum {
  Vec3d sum{};
  double weight = 0;
  void add(const Vec3d& directions, double weights) {
    sum += directions;
    weight += weights;
  }
};

/// The mean direction, whose length measures the agreement of the directions; w is 0 if the sum is empty.
inline std::array<float, 4> mean_of(const DirectionSum& s) {
  if (!(s.weight > 0)) return {0, 0, 0, 0};
  const Vec3 mean = to_float(s.sum * (1 / s.weight));
  return {mean.x, mean.y, mean.z, 1};
}

/// The standard deviation of the directions (equation 3 of the paper).
inline double deviation_of(const std::array<float, 4>& mean) {
  const Vec3d m{mean[0], mean[1], mean[2]};
  return std::sqrt(std::max(0.0, 1 - dot(m, m)));
}

/// Fills points without a direction with the mean of their neighbours' directions, ring by ring.
/// \param neighbours calls its argument with every neighbour of a point
template <typename Neighbours>
void fill_unseen(std::vector<std::array<float, 4>>& means, std::vector<std::uint32_t> unseen,
                 const Neighbours& neighbours, VisibilityReport& report) {
  report.unseen = unseen.size();
  std::vector<std::pair<std::uint32_t, std::array<float, 4>>> ring;
  while (!unseen.empty()) {
    ring.clear();
    std::vector<std::uint32_t> unseen_points;
    for (const std::uint32_t point : unseen) {
      DirectionSum around;
      neighbours(point, [&](std::uint32_t other) {
        const std::array<float, 4>& mean = means[other];
        if (mean[3] > 0) around.add(Vec3d{mean[0], mean[1], mean[2]}, 1);
      });
      if (around.weight > 0) {
        ring.emplace_back(point, mean_of(around));
      } else {
        unseen_points.push_back(point);
      }
    }
    if (ring.empty()) break;
    for (const auto& [point, mean] : ring) means[point] = mean;
    unseen = std::move(unseen_points);
  }
  report.without = unseen.size();
}

/// Adds the mean standard deviation of all points with a direction to the report.
void add_deviation(const std::vector<std::array<float, 4>>& means, VisibilityReport& report);

}  // namespace kiln
