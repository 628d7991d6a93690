// Measures the deviation between two meshes.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// Relative and absolute margin for rounding, in bounds of squared distances.
constexpr double kRoundingFactor = 1.0001, kRoundingOffset = 1e-14;

/// Hash set of triangles, found by their corners in any rotation.
class KeptTriangles {
 public:
  /// \param corners  three corners per triangle; must outlive this object
  explicit KeptTriangles(std::span<const Vec3> corners)
      : corners_(corners), slots_(std::bit_ceil(corners.size() / 3 * 2 + 1), kNone) {
    for (std::size_t t = 0; 3 * t < corners.size(); ++t) {
      const Key key = key_of(&corners[3 * t]);
      std::size_t i = slot_of(key);
      while (slots_[i] != kNone && key_at(slots_[i]) != key) i = (i + 1) & (slots_.size() - 1);
      if (slots_[i] == kNone) slots_[i] = static_cast<std::uint32_t>(t);
    }
  }

  /// The corners of an equal triangle; null if there is none.
  const Vec3* find(const std::array<Vec3, 3>& triangle) const {
    const Key key = key_of(triangle.data());
    for (std::size_t i = slot_of(key); slots_[i] != kNone; i = (i + 1) & (slots_.size() - 1)) {
      if (key_at(slots_[i]) == key) return &corners_[std::size_t{3} * slots_[i]];
    }
    return nullptr;
  }

 private:
  using Point = std::array<std::uint32_t, 3>;
  using Key = std::array<Point, 3>;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  static Key key_of(const Vec3* c) {
    Key key;
    for (std::size_t k = 0; k < 3; ++k) {
      key[k] = {std::bit_cast<std::uint32_t>(c[k].x), std::bit_cast<std::uint32_t>(c[k].y),
                std::bit_cast<std::uint32_t>(c[k].z)};
    }
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    return key;
  }
  Key key_at(std::uint32_t t) const { return key_of(&corners_[std::size_t{3} * t]); }
  std::size_t slot_of(const Key& key) const {
    std::uint64_t hash = 0;
    for (const Point& point : key) {
      for (const std::uint32_t bits : point) {
        hash = (hash ^ bits) * 0x9E3779B97F4A7C15U;
        hash ^= hash >> 32;
      }
    }
    return hash & (slots_.size() - 1);
  }

  std::span<const Vec3> corners_;
  std::vector<std::uint32_t> slots_;
};

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
      if (const Vec3* same = kept.find({a, b, c}); same != nullptr) {
        squared_distances[i] = squared_distance_to_triangle(
            to_double(point), same, std::numeric_limits<double>::infinity());
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
  std::vector<double> squared_distances(kPointsPerTriangle * triangles.size());
  parallel_for(triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = triangles[i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d a = to_double(positions[t[k]]), b = to_double(positions[t[(k + 1) % 3]]);
        squared_distances[kPointsPerTriangle * i + 2 * k] = dense.squared(positions[t[k]]);
        squared_distances[kPointsPerTriangle * i + 2 * k + 1] =
            dense.squared(to_float((a + b) * 0.5));
      }
      squared_distances[kPointsPerTriangle * i + 6] =
          dense.squared(distance_point(positions, t, 3));
    }
  });
  DistanceReport report;
  report.samples = squared_distances.size();
  if (!squared_distances.empty()) set_statistics(squared_distances, report);
  return report;
}

}  // namespace kiln
