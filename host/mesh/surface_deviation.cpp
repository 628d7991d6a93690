// Measures the deviation between two meshes.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "mesh/kept_triangles.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// Relative and absolute margin for rounding, in bounds of squared distances.
constexpr double kRoundingFactor = 1.0001, kRoundingOffset = 1e-14;

/// \param squared_distances  must not be empty
void set_statistics(const std::vector<double>& squared_distances, DistanceReport& report) {
  double sum = 0, sum_of_squares = 0, largest = 0;
  for (const double value : squared_distances) {
    sum += std::sqrt(value);
    sum_of_squares += value;
    largest = std::max(largest, value);
  }
  const auto count = static_cast<double>(squared_distances.size());
  report.largest = std::sqrt(largest);
  report.mean = sum / count;
  report.root_mean_square = std::sqrt(sum_of_squares / count);
}

}  // namespace

DistanceReport one_sided_distance(std::span<const Vec3> dense_positions,
                                  std::span<const Triangle> dense_triangles,
                                  const SurfaceDistance& low, std::uint64_t max_samples) {
  DistanceReport report;
  const std::uint64_t available = std::uint64_t{dense_triangles.size()} * 4;
  report.samples = std::min(available, max_samples);
  if (report.samples == 0) return report;

  const KeptTriangles kept(low.corners());
  std::vector<double> squared_distances(report.samples);
  std::atomic<std::uint64_t> searched_samples = 0;
  parallel_for(report.samples, 1024, [&](std::size_t begin, std::size_t end) {
    Vec3d previous_point{};
    std::uint64_t searched_in_task = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t sample = distance_sample(i, report.samples, available);
      const Triangle& t = dense_triangles[sample / 4];
      const Vec3& a = dense_positions[t[0]];
      const Vec3& b = dense_positions[t[1]];
      const Vec3& c = dense_positions[t[2]];
      const Vec3 point = distance_point(dense_positions, t, sample % 4);
      if (const std::uint32_t same = kept.find({a, b, c}); same != KeptTriangles::kNone) {
        squared_distances[i] = squared_distance_to_triangle(
            to_double(point), kept.corners(same), std::numeric_limits<double>::infinity());
      } else {
        // The previous sample's distance, plus the distance between the two samples, bounds the search.
        double within = std::numeric_limits<double>::infinity();
        if (i > begin) {
          const double farthest =
              std::sqrt(squared_distances[i - 1]) + length(to_double(point) - previous_point);
          within = kRoundingFactor * farthest * farthest + kRoundingOffset;
        }
        squared_distances[i] = low.squared(point, within);
        ++searched_in_task;
      }
      previous_point = to_double(point);
    }
    searched_samples += searched_in_task;
  });
  report.searched_count = searched_samples;
  set_statistics(squared_distances, report);
  return report;
}

DistanceReport low_to_high_distance(const SurfaceDistance& dense, std::span<const Vec3> positions,
                                    std::span<const Triangle> triangles) {
  constexpr std::size_t kPointsPerTriangle = 7;
  const KeptTriangles kept(dense.corners());
  std::vector<double> squared_distances(kPointsPerTriangle * triangles.size());
  std::atomic<std::uint64_t> searched_samples = 0;
  parallel_for(triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::uint64_t searched_in_task = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = triangles[i];
      const std::uint32_t same = kept.find({positions[t[0]], positions[t[1]], positions[t[2]]});
      const auto squared_distance = [&](const Vec3& point) {
        if (same == KeptTriangles::kNone) return dense.squared(point);
        return squared_distance_to_triangle(to_double(point), kept.corners(same),
                                            std::numeric_limits<double>::infinity());
      };
      if (same == KeptTriangles::kNone) searched_in_task += kPointsPerTriangle;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d a = to_double(positions[t[k]]), b = to_double(positions[t[(k + 1) % 3]]);
        squared_distances[kPointsPerTriangle * i + 2 * k] = squared_distance(positions[t[k]]);
        squared_distances[kPointsPerTriangle * i + 2 * k + 1] =
            squared_distance(to_float((a + b) * 0.5));
      }
      squared_distances[kPointsPerTriangle * i + 6] =
          squared_distance(distance_point(positions, t, 3));
    }
    searched_samples += searched_in_task;
  });
  DistanceReport report;
  report.samples = squared_distances.size();
  report.searched_count = searched_samples;
  if (!squared_distances.empty()) set_statistics(squared_distances, report);
  return report;
}

}  // namespace kiln
