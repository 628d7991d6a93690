// Range queries of points, which are sorted into slabs of y, and by x within each slab, so that a query of a
// small box visits few points.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "mesh/vector.h"

namespace kiln {

/// Range queries over a subset of points.
class CoverageSlabs {
 public:
  /// Sorts a subset of points into slabs.
  /// \param points  all points
  /// \param subset  indices of the subset
  CoverageSlabs(std::span<const Vec3> points, std::vector<std::uint32_t> subset)
      : points_(points), sorted_points_(std::move(subset)) {
    if (sorted_points_.empty()) return;
    const auto [least, most] = std::minmax_element(
        sorted_points_.begin(), sorted_points_.end(),
        [&](std::uint32_t a, std::uint32_t b) { return points[a].y < points[b].y; });
    min_y_ = points[*least].y;
    size_ = points[*most].y - min_y_;
    const auto key = [&](std::uint32_t i) { return std::pair(slab(points_[i].y), points_[i].x); };
    std::sort(sorted_points_.begin(), sorted_points_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    for (const std::uint32_t i : sorted_points_) ++first_[slab(points_[i].y) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
  }

  /// Calls use(point) for all points whose x and y lie within a box, and possibly for others, until it
  /// returns false.
  template <typename Use>
  void for_each_in_box(const Vec3d& low, const Vec3d& top, const Use& use) const {
    if (sorted_points_.empty()) return;
    for (std::size_t s = slab(low.y); s <= slab(top.y); ++s) {
      const std::uint32_t* const end = sorted_points_.data() + first_[s + 1];
      const std::uint32_t* next =
          std::lower_bound(sorted_points_.data() + first_[s], end, low.x,
                           [&](std::uint32_t i, double x) { return points_[i].x < x; });
      for (; next != end && points_[*next].x <= top.x; ++next) {
        if (!use(*next)) return;
      }
    }
  }

 private:
  static constexpr std::size_t kSlabCount = 64;

  std::size_t slab(double y) const {
    const double slab = (y - min_y_) / size_ * kSlabCount;
    // A point with a NaN coordinate goes to the first slab
    return slab > 0 ? static_cast<std::size_t>(std::min(slab, kSlabCount - 1.0)) : 0;
  }

  std::span<const Vec3> points_;
  std::vector<std::uint32_t> sorted_points_;
  double min_y_ = 0, size_ = 0;
  std::array<std::size_t, kSlabCount + 1> first_{};
};

}  // namespace kiln
