#include "simplify/layout_copies.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "mesh/uv_grid.h"

namespace kiln {
namespace {

/// Corners at a distance of at most kMaxCopyDistance count as the same. kCellSize is the side of a cell of the grid
/// that finds them. Both are in UV units.
constexpr double kMaxCopyDistance = 1e-5, kCellSize = 1.0 / 1024;

struct CopyCenter {
  /// Whole-number UV offset that moves the triangle's centroid into the unit square.
  std::array<double, 2> whole_offset{};
  std::array<double, 2> center{};
};

std::int64_t cell_of(double value) {
  return static_cast<std::int64_t>(std::floor(value / kCellSize));
}

std::uint64_t cell_key(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x + 2) << 32 | static_cast<std::uint64_t>(y + 2);
}

}  // namespace

LayoutCopies::LayoutCopies(std::span<const Vec2> uvs, std::span<const Triangle> corners)
    : on_fold_(uvs.size(), 0), first_triangle_copy_(corners.size()) {
  std::iota(first_triangle_copy_.begin(), first_triangle_copy_.end(), 0U);
  std::vector<CopyCenter> centers(corners.size());
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> triangles_of_cell;
  triangles_of_cell.reserve(corners.size());
  DisjointSets copy_sets(uvs.size());
  const auto at = [&](std::uint32_t t, std::size_t k) {
    const Vec2& uv = uvs[corners[t][k]];
    return std::array<double, 2>{uv.x - centers[t].whole_offset[0],
                                 uv.y - centers[t].whole_offset[1]};
  };
  /// Finds, for each corner of t, the corresponding corner of `other`. Returns false if a corner has none.
  const auto matches = [&](std::uint32_t t, std::uint32_t other, std::array<std::size_t, 3>& of) {
    std::array<bool, 3> is_matched{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto p = at(t, k);
      for (of[k] = 0; of[k] < 3; ++of[k]) {
        const auto q = at(other, of[k]);
        if (!is_matched[of[k]] && std::abs(p[0] - q[0]) < kMaxCopyDistance &&
            std::abs(p[1] - q[1]) < kMaxCopyDistance)
          break;
      }
      if (of[k] == 3) return false;
      is_matched[of[k]] = true;
    }
    return true;
  };
  for (std::uint32_t t = 0; t < corners.size(); ++t) {
    const Vec2 &a = uvs[corners[t][0]], &b = uvs[corners[t][1]], &c = uvs[corners[t][2]];
    if (!is_finite(a) || !is_finite(b) || !is_finite(c)) continue;
    const double doubled_area =
        (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
    if (doubled_area == 0) continue;
    CopyCenter& copy_center = centers[t];
    const double u = (double{a.x} + b.x + c.x) / 3, v = (double{a.y} + b.y + c.y) / 3;
    copy_center.whole_offset = {std::floor(u), std::floor(v)};
    copy_center.center = {u - copy_center.whole_offset[0], v - copy_center.whole_offset[1]};
    const std::int64_t x = cell_of(copy_center.center[0]), y = cell_of(copy_center.center[1]);
    std::array<std::size_t, 3> of{};
    std::uint32_t first_copy = t;
    for (std::int64_t row = y - 1; row <= y + 1; ++row) {
      for (std::int64_t column = x - 1; column <= x + 1; ++column) {
        const auto list = triangles_of_cell.find(cell_key(column, row));
        if (list == triangles_of_cell.end()) continue;
        for (const std::uint32_t other : list->second) {
          std::array<std::size_t, 3> corner_order{};
          if (other >= first_copy || !matches(t, other, corner_order)) continue;
          first_copy = other;
          of = corner_order;
        }
      }
    }
    if (first_copy == t) {
      triangles_of_cell[cell_key(x, y)].push_back(
          t);  // The first of several copies represents all of them
      continue;
    }
    has_any_copies_ = true;
    first_triangle_copy_[t] = first_copy;
    for (std::size_t k = 0; k < 3; ++k) {
      copy_sets.join(corners[t][k], corners[first_copy][of[k]]);
      if (corners[t][k] == corners[first_copy][of[k]]) on_fold_[corners[t][k]] = 1;
    }
  }
  if (!has_any_copies_) return;
  next_copy_.resize(uvs.size());
  first_copy_.resize(uvs.size());
  std::iota(next_copy_.begin(), next_copy_.end(), 0U);
  for (std::uint32_t uv = 0; uv < uvs.size(); ++uv) {
    first_copy_[uv] = copy_sets.find(uv);
    if (first_copy_[uv] == uv) continue;
    next_copy_[uv] = next_copy_[first_copy_[uv]];
    next_copy_[first_copy_[uv]] = uv;
  }
}

}  // namespace kiln
