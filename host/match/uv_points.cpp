#include "match/uv_points.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "base/parallel.h"
#include "mesh/kernels_shared.h"
#include "mesh/uv_grid.h"

namespace kiln {
namespace {

constexpr std::size_t kPointsPerTask = 1 << 12;
constexpr std::size_t kMaxGridSide = 1024;  // maximum number of cells a side of the grid
// Tolerance of negative weights, so that each point on a shared edge is in at least one of the triangles.
constexpr double kMinUvWeight = 1e-9;

/// True if a triangle can be matched according to the rules of UvLayout.
bool is_matchable(const Source::Impl& source, std::size_t triangle, const std::array<Vec2, 3>& uv) {
  const auto finite_corner = [&](std::uint32_t i) { return is_finite(source.positions[i]); };
  const Triangle& t = source.triangles[triangle];
  return std::all_of(uv.begin(), uv.end(), [](const Vec2& p) { return is_finite(p); }) &&
         std::all_of(t.begin(), t.end(), finite_corner);
}

/// WeightsAtUv of a triangle's corners 1 and 2 at a UV.
struct WeightsAtUv {
  double x = 0, y = 0;      // position of corner 0
  double ax = 0, ay = 0;    // edge to corner 1
  double bx = 0, by = 0;    // edge to corner 2
  double doubled_area = 0;  // twice the area, not 0

  explicit WeightsAtUv(const std::array<Vec2, 3>& uv)
      : x(uv[0].x),
        y(uv[0].y),
        ax(uv[1].x - x),
        ay(uv[1].y - y),
        bx(uv[2].x - x),
        by(uv[2].y - y),
        doubled_area(ax * by - bx * ay) {}

  std::array<double, 2> at(const Vec2& p) const {
    const double px = p.x - x, py = p.y - y;
    return {(px * by - bx * py) / doubled_area, (ax * py - px * ay) / doubled_area};
  }
};

/// A grid of UVs over the unit square. UVs outside belong to the cells at its border.
class UvCells {
 public:
  explicit UvCells(std::span<const Vec2> uvs)
      : cells_per_side_(std::clamp<std::size_t>(
            static_cast<std::size_t>(std::sqrt(static_cast<double>(uvs.size()))), 1, kMaxGridSide)),
        first_(cells_per_side_ * cells_per_side_ + 1) {
    for (const Vec2& uv : uvs) {
      if (is_finite(uv)) ++first_[cell(uv) + 1];
    }
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) first_[i + 1] += first_[i];
    index_.resize(first_.back());
    std::vector<std::uint32_t> cursor(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < uvs.size(); ++i) {
      if (is_finite(uvs[i])) index_[cursor[cell(uvs[i])]++] = static_cast<std::uint32_t>(i);
    }
  }

  /// Calls visit(index) for every UV in the cells under a box.
  template <typename Visit>
  void for_each_uv_in(const Vec2& low, const Vec2& high, const Visit& visit) const {
    for (std::size_t y = cell_along_axis(low.y); y <= cell_along_axis(high.y); ++y) {
      // The UVs of a row's cells are consecutive in memory.
      const std::uint32_t end = first_[y * cells_per_side_ + cell_along_axis(high.x) + 1];
      for (std::uint32_t i = first_[y * cells_per_side_ + cell_along_axis(low.x)]; i < end; ++i)
        visit(index_[i]);
    }
  }

 private:
  std::size_t cell_along_axis(double at) const {
    const auto count = static_cast<double>(cells_per_side_);
    return static_cast<std::size_t>(std::clamp(at * count, 0.0, count - 1));
  }
  std::size_t cell(const Vec2& uv) const {
    return cell_along_axis(uv.y) * cells_per_side_ + cell_along_axis(uv.x);
  }

  std::size_t cells_per_side_;
  std::vector<std::uint32_t> first_, index_;
};

std::array<Vec2, 3> corners(const Source::Impl& source, std::size_t triangle) {
  const Triangle& t = source.uv_triangles[triangle];
  return {source.uvs[t[0]], source.uvs[t[1]], source.uvs[t[2]]};
}

}  // namespace

UvPoints find_uv_points(const Source::Impl& source, std::span<const Vec2> uvs) {
  const UvCells uv_cells(uvs);
  UvPoints found;
  found.triangle.assign(uvs.size(), KILN_NO_TRIANGLE);
  parallel_for(source.triangles.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::array<Vec2, 3> uv = corners(source, t);
      if (!is_matchable(source, t, uv)) continue;
      const WeightsAtUv weights(uv);
      if (weights.doubled_area == 0) continue;
      const auto [x_low, x_high] = std::minmax({uv[0].x, uv[1].x, uv[2].x});
      const auto [y_low, y_high] = std::minmax({uv[0].y, uv[1].y, uv[2].y});
      uv_cells.for_each_uv_in({x_low, y_low}, {x_high, y_high}, [&](std::uint32_t i) {
        const auto [u, v] = weights.at(uvs[i]);
        if (u < -kMinUvWeight || v < -kMinUvWeight || u + v > 1 + kMinUvWeight) return;
        // Atomic minimum, so that the lowest triangle wins in any order; KILN_NO_TRIANGLE is
        // the largest value.
        const std::atomic_ref<std::uint32_t> lowest_triangle(found.triangle[i]);
        std::uint32_t current_lowest = lowest_triangle.load(std::memory_order_relaxed);
        while (t < current_lowest &&
               !lowest_triangle.compare_exchange_weak(current_lowest, static_cast<std::uint32_t>(t),
                                                      std::memory_order_relaxed)) {
        }
      });
    }
  });
  found.barycentric.resize(2 * uvs.size());
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    if (found.triangle[i] == KILN_NO_TRIANGLE) continue;
    const auto [u, v] = WeightsAtUv(corners(source, found.triangle[i])).at(uvs[i]);
    found.barycentric[i] = static_cast<float>(u);
    found.barycentric[i + uvs.size()] = static_cast<float>(v);
  }
  return found;
}

}  // namespace kiln
