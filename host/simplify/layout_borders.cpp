#include "simplify/layout_borders.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "mesh/uv_grid.h"

namespace kiln {
namespace {

/// Number of probe points along each side of the layout. Probes find overlapping triangles.
constexpr std::uint32_t kProbesPerSide = 1024;
constexpr std::uint32_t kNoBorder = 0xFFFFFFFFU, kNoIndex = 0xFFFFFFFFU;

double doubled_area(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
}

bool has_finite_uvs(std::span<const Vec2> uvs, const Triangle& t) {
  return is_finite(uvs[t[0]]) && is_finite(uvs[t[1]]) && is_finite(uvs[t[2]]);
}

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t item) {
  while (parent[item] != item) item = parent[item] = parent[parent[item]];
  return item;
}

/// Calls `body` for each probe point that lies strictly inside a triangle.
template <class Body>
void each_probe(const std::array<Vec2, 3>& p, const Vec2& low, const Vec2& size, const Body& body) {
  // Position of a probe within its cell. The numbers are close to irrational ones, so that edges of layouts hardly ever
  // hit a probe.
  constexpr double kProbeOffsetU = 0.38196601125, kProbeOffsetV = 0.61803398875;
  const auto first = [](double value, double off) {
    return static_cast<std::uint32_t>(
        std::clamp(std::ceil(value * kProbesPerSide - off), 0.0, 1.0 * kProbesPerSide));
  };
  std::array<double, 3> u{}, v{};
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = (double{p[k].x} - low.x) / size.x;
    v[k] = (double{p[k].y} - low.y) / size.y;
  }
  const auto [least_v, most_v] = std::minmax({v[0], v[1], v[2]});
  const std::uint32_t last = first(most_v, kProbeOffsetV);
  for (std::uint32_t y = first(least_v, kProbeOffsetV); y < last; ++y) {
    const double at = (y + kProbeOffsetV) / kProbesPerSide;
    double from = 2, to = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      if ((v[k] <= at) == (v[l] <= at)) continue;
      const double x = u[k] + (u[l] - u[k]) * (at - v[k]) / (v[l] - v[k]);
      from = std::min(from, x);
      to = std::max(to, x);
    }
    const std::uint32_t end = first(to, kProbeOffsetU);
    for (std::uint32_t x = first(from, kProbeOffsetU); x < end; ++x) body(y * kProbesPerSide + x);
  }
}

}  // namespace

LayoutBorders::LayoutBorders(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                             std::span<const std::uint32_t> charts,
                             const std::vector<std::uint8_t>& on_border, const LayoutCopies& copies)
    : copies_(&copies),
      chart_of_uv_(uvs.size(), 0),
      position_of_uv_(uvs.size(), 0),
      index_of_uv_(uvs.size(), kNoIndex) {
  for (std::size_t t = 0; t < corners.size(); ++t) {
    for (const std::uint32_t c : corners[t]) chart_of_uv_[c] = charts[t];
  }
  bool any = false;
  Vec2 high{};
  for (std::uint32_t i = 0; i < uvs.size(); ++i) {
    if (!is_finite(uvs[i])) continue;
    if (on_border[i] != 0) border_corners_.push_back(i);
    low_ = any ? Vec2{std::min(low_.x, uvs[i].x), std::min(low_.y, uvs[i].y)} : uvs[i];
    high = any ? Vec2{std::max(high.x, uvs[i].x), std::max(high.y, uvs[i].y)} : uvs[i];
    any = true;
  }
  size_ = {std::max(high.x - low_.x, 1e-30F), std::max(high.y - low_.y, 1e-30F)};
  const auto key = [&](std::uint32_t i) {
    return std::tuple(uvs[i].y, uvs[i].x, copies_->first_copy(i));
  };
  const auto is_same_position = [&](std::uint32_t i, std::uint32_t j) { return key(i) == key(j); };
  std::sort(border_corners_.begin(), border_corners_.end(), [&](std::uint32_t i, std::uint32_t j) {
    return std::tuple_cat(key(i), std::tuple(i)) < std::tuple_cat(key(j), std::tuple(j));
  });
  std::size_t count = 0;
  for (std::size_t i = 0; i < border_corners_.size(); ++i) {
    count += i == 0 || !is_same_position(border_corners_[i - 1], border_corners_[i]) ? 1 : 0;
  }
  cells_per_side_ = static_cast<std::uint32_t>(
      std::clamp(std::sqrt(static_cast<double>(count) / 2), 1.0, 1024.0));
  const auto cell = [&](std::uint32_t i) {
    return std::size_t{row(uvs[i].y)} * cells_per_side_ + column(uvs[i].x);
  };
  std::stable_sort(border_corners_.begin(), border_corners_.end(),
                   [&](std::uint32_t i, std::uint32_t j) { return cell(i) < cell(j); });
  first_position_of_cell_.assign(std::size_t{cells_per_side_} * cells_per_side_ + 1, 0);
  border_positions_.reserve(count);
  for (std::uint32_t i = 0; i < border_corners_.size(); ++i) {
    const std::uint32_t uv = border_corners_[i];
    if (i == 0 || !is_same_position(border_corners_[i - 1], uv)) {
      border_positions_.push_back({i, 0});
      ++first_position_of_cell_[cell(uv) + 1];
    }
    ++border_positions_.back().count;
    position_of_uv_[uv] = static_cast<std::uint32_t>(border_positions_.size() - 1);
    index_of_uv_[uv] = i;
  }
  std::partial_sum(first_position_of_cell_.begin(), first_position_of_cell_.end(),
                   first_position_of_cell_.begin());
  find_overlaps(uvs, corners, charts);
}

void LayoutBorders::find_overlaps(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                                  std::span<const std::uint32_t> charts) {
  const std::uint32_t count =
      charts.empty() ? 0 : *std::max_element(charts.begin(), charts.end()) + 1;
  chart_group_.resize(count);
  std::iota(chart_group_.begin(), chart_group_.end(), 0U);
  std::vector<std::uint8_t> is_overlapping(count, 0);
  std::vector<std::uint32_t> first_triangle_at(std::size_t{kProbesPerSide} * kProbesPerSide,
                                               kNoBorder);
  std::vector<std::uint8_t> is_overlapping_triangle(corners.size(), 0);
  // True if a triangle need not be tested: it has exactly the UVs of its first copy, and that copy shares no probe with
  // other triangles. With this, thousands of copies over one part of the texture take one test.
  const auto is_known = [&](std::size_t t) {
    const std::uint32_t first = copies_->first_triangle_copy(static_cast<std::uint32_t>(t));
    if (first == t || is_overlapping_triangle[first] != 0) return false;
    const auto at = [&](std::size_t of, std::size_t k) { return uvs[corners[of][k % 3]]; };
    for (std::size_t rotation = 0; rotation < 3; ++rotation) {
      if (at(t, 0) == at(first, rotation) && at(t, 1) == at(first, rotation + 1) &&
          at(t, 2) == at(first, rotation + 2)) {
        return true;
      }
    }
    return false;
  };
  for (std::size_t t = 0; t < corners.size(); ++t) {
    if (!has_finite_uvs(uvs, corners[t]) || is_known(t)) continue;
    each_probe({uvs[corners[t][0]], uvs[corners[t][1]], uvs[corners[t][2]]}, low_, size_,
               [&](std::uint32_t probe) {
                 std::uint32_t& first = first_triangle_at[probe];
                 if (first == kNoBorder) {
                   first = static_cast<std::uint32_t>(t);
                   return;
                 }
                 if (copies_->are_triangle_copies(first, static_cast<std::uint32_t>(t))) return;
                 is_overlapping_triangle[t] = 1;
                 const std::uint32_t chart = charts[first];
                 is_overlapping[charts[t]] = is_overlapping[chart] = 1;
                 const auto [low, high] =
                     std::minmax({root(chart_group_, chart), root(chart_group_, charts[t])});
                 chart_group_[high] = low;
               });
  }
  overlapping_.assign(count, 0);
  for (std::uint32_t c = 0; c < count; ++c) {
    chart_group_[c] = root(chart_group_, c);
    if (is_overlapping[c] != 0) overlapping_[chart_group_[c]] = 1;
  }
}

std::uint32_t LayoutBorders::column(float u) const {
  const double at = (double{u} - low_.x) / size_.x * cells_per_side_;
  return static_cast<std::uint32_t>(std::clamp(at, 0.0, cells_per_side_ - 1.0));
}

std::uint32_t LayoutBorders::row(float v) const {
  const double at = (double{v} - low_.y) / size_.y * cells_per_side_;
  return static_cast<std::uint32_t>(std::clamp(at, 0.0, cells_per_side_ - 1.0));
}

void LayoutBorders::remove(std::uint32_t uv) {
  if (index_of_uv_[uv] == kNoIndex) return;
  BorderPosition& border_position = border_positions_[position_of_uv_[uv]];
  const std::uint32_t last = border_corners_[border_position.first + --border_position.count];
  border_corners_[index_of_uv_[uv]] = last;
  index_of_uv_[last] = index_of_uv_[uv];
  index_of_uv_[uv] = kNoIndex;
}

bool LayoutBorders::may_remove(std::span<const Vec2> uvs, std::uint32_t before, std::uint32_t gone,
                               std::uint32_t after) const {
  const Vec2 &a = uvs[before], &b = uvs[gone], &c = uvs[after];
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return true;
  const double signed_area = doubled_area(a, b, c);
  if (signed_area == 0) return true;
  const double sign = signed_area > 0 ? 1 : -1;
  const std::uint32_t own_group = chart_group_[chart_of_uv_[gone]];
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  const auto [bottom, top] = std::minmax({a.y, b.y, c.y});
  for (std::uint32_t y = row(bottom); y <= row(top); ++y) {
    for (std::uint32_t x = column(left); x <= column(right); ++x) {
      const std::size_t cell = std::size_t{y} * cells_per_side_ + x;
      for (std::uint32_t i = first_position_of_cell_[cell]; i < first_position_of_cell_[cell + 1];
           ++i) {
        const std::span<const std::uint32_t> corners_at_position(
            border_corners_.data() + border_positions_[i].first, border_positions_[i].count);
        if (corners_at_position.empty()) continue;
        const Vec2& p = uvs[corners_at_position[0]];
        if (p == a || p == c ||
            (p == b && copies_->first_copy(corners_at_position[0]) == copies_->first_copy(gone)))
          continue;
        if (!(sign * doubled_area(a, b, p) >= 0 && sign * doubled_area(b, c, p) >= 0 &&
              sign * doubled_area(c, a, p) >= 0)) {
          continue;
        }
        // Borders of charts that overlapped from the start do not block each other.
        const auto may_block = [&](std::uint32_t other) {
          return overlapping_[own_group] == 0 || chart_group_[chart_of_uv_[other]] != own_group;
        };
        if (std::any_of(corners_at_position.begin(), corners_at_position.end(), may_block))
          return false;
      }
    }
  }
  return true;
}

}  // namespace kiln
