#include "simplify/layout_borders.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mesh/uv_grid.h"

namespace kiln {
namespace {

/// Points a side at which the layout is looked at for overlaps.
constexpr std::uint32_t kProbes = 1024;
constexpr std::uint32_t kNoBorder = 0xFFFFFFFFU;

double doubled(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
}

bool all_finite(std::span<const Vec2> uvs, const Triangle& t) {
  return is_finite(uvs[t[0]]) && is_finite(uvs[t[1]]) && is_finite(uvs[t[2]]);
}

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t item) {
  while (parent[item] != item) item = parent[item] = parent[parent[item]];
  return item;
}

/// Calls body with each probe strictly inside a triangle.
template <class Body>
void each_probe(const std::array<Vec2, 3>& p, const Vec2& low, const Vec2& size, const Body& body) {
  // Off by shares of a step that layouts are unlikely to have their edges at.
  constexpr double kOffU = 0.38196601125, kOffV = 0.61803398875;
  const auto first = [](double value, double off) {
    return static_cast<std::uint32_t>(
        std::clamp(std::ceil(value * kProbes - off), 0.0, 1.0 * kProbes));
  };
  std::array<double, 3> u{}, v{};
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = (double{p[k].x} - low.x) / size.x;
    v[k] = (double{p[k].y} - low.y) / size.y;
  }
  const auto [least_v, most_v] = std::minmax({v[0], v[1], v[2]});
  const std::uint32_t last = first(most_v, kOffV);
  for (std::uint32_t y = first(least_v, kOffV); y < last; ++y) {
    const double at = (y + kOffV) / kProbes;
    double from = 2, to = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      if ((v[k] <= at) == (v[l] <= at)) continue;
      const double x = u[k] + (u[l] - u[k]) * (at - v[k]) / (v[l] - v[k]);
      from = std::min(from, x);
      to = std::max(to, x);
    }
    const std::uint32_t end = first(to, kOffU);
    for (std::uint32_t x = first(from, kOffU); x < end; ++x) body(y * kProbes + x);
  }
}

}  // namespace

LayoutBorders::LayoutBorders(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                             std::span<const std::uint32_t> charts,
                             std::vector<std::uint8_t> on_border, const LayoutCopies& copies)
    : copies_(&copies), on_border_(std::move(on_border)), chart_(uvs.size(), 0) {
  for (std::size_t t = 0; t < corners.size(); ++t) {
    for (const std::uint32_t c : corners[t]) chart_[c] = charts[t];
  }
  bool any = false;
  Vec2 high{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    if (!is_finite(uvs[i])) on_border_[i] = 0;
    count += on_border_[i];
    if (!is_finite(uvs[i])) continue;
    low_ = any ? Vec2{std::min(low_.x, uvs[i].x), std::min(low_.y, uvs[i].y)} : uvs[i];
    high = any ? Vec2{std::max(high.x, uvs[i].x), std::max(high.y, uvs[i].y)} : uvs[i];
    any = true;
  }
  size_ = {std::max(high.x - low_.x, 1e-30F), std::max(high.y - low_.y, 1e-30F)};
  side_ = static_cast<std::uint32_t>(
      std::clamp(std::sqrt(static_cast<double>(count) / 2), 1.0, 1024.0));
  start_.assign(std::size_t{side_} * side_ + 1, 0);
  const auto cell = [&](std::size_t i) {
    return std::size_t{row(uvs[i].y)} * side_ + column(uvs[i].x);
  };
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    if (on_border_[i] != 0) ++start_[cell(i) + 1];
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  items_.resize(count);
  std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    if (on_border_[i] != 0) items_[next[cell(i)]++] = static_cast<std::uint32_t>(i);
  }
  find_overlaps(uvs, corners, charts);
}

void LayoutBorders::find_overlaps(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                                  std::span<const std::uint32_t> charts) {
  const std::uint32_t count =
      charts.empty() ? 0 : *std::max_element(charts.begin(), charts.end()) + 1;
  group_.resize(count);
  std::iota(group_.begin(), group_.end(), 0U);
  std::vector<std::uint8_t> twice(count, 0);
  std::vector<std::uint32_t> owner(std::size_t{kProbes} * kProbes, kNoBorder);
  for (std::size_t t = 0; t < corners.size(); ++t) {
    if (!all_finite(uvs, corners[t])) continue;
    each_probe(
        {uvs[corners[t][0]], uvs[corners[t][1]], uvs[corners[t][2]]}, low_, size_,
        [&](std::uint32_t probe) {
          std::uint32_t& first = owner[probe];
          if (first == kNoBorder) {
            first = static_cast<std::uint32_t>(t);
            return;
          }
          if (copies_->triangles(first, static_cast<std::uint32_t>(t))) return;
          const std::uint32_t chart = charts[first];
          twice[charts[t]] = twice[chart] = 1;
          const auto [low, high] = std::minmax({root(group_, chart), root(group_, charts[t])});
          group_[high] = low;
        });
  }
  overlapping_.assign(count, 0);
  for (std::uint32_t c = 0; c < count; ++c) {
    group_[c] = root(group_, c);
    if (twice[c] != 0) overlapping_[group_[c]] = 1;
  }
}

std::uint32_t LayoutBorders::column(float u) const {
  const double at = (double{u} - low_.x) / size_.x * side_;
  return static_cast<std::uint32_t>(std::clamp(at, 0.0, side_ - 1.0));
}

std::uint32_t LayoutBorders::row(float v) const {
  const double at = (double{v} - low_.y) / size_.y * side_;
  return static_cast<std::uint32_t>(std::clamp(at, 0.0, side_ - 1.0));
}

bool LayoutBorders::free(std::span<const Vec2> uvs, std::uint32_t before, std::uint32_t gone,
                         std::uint32_t after) const {
  const Vec2 &a = uvs[before], &b = uvs[gone], &c = uvs[after];
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return true;
  const double turn = doubled(a, b, c);
  if (turn == 0) return true;
  const double sign = turn > 0 ? 1 : -1;
  const std::uint32_t own = group_[chart_[gone]];
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  const auto [bottom, top] = std::minmax({a.y, b.y, c.y});
  for (std::uint32_t y = row(bottom); y <= row(top); ++y) {
    for (std::uint32_t x = column(left); x <= column(right); ++x) {
      const std::size_t cell = std::size_t{y} * side_ + x;
      for (std::uint32_t i = start_[cell]; i < start_[cell + 1]; ++i) {
        const std::uint32_t other = items_[i];
        if (on_border_[other] == 0 || other == before || other == gone || other == after) continue;
        if (group_[chart_[other]] == own && overlapping_[own] != 0) continue;
        const Vec2& p = uvs[other];
        if (p == a || p == c || (p == b && copies_->first(other) == copies_->first(gone))) continue;
        if (sign * doubled(a, b, p) >= 0 && sign * doubled(b, c, p) >= 0 &&
            sign * doubled(c, a, p) >= 0) {
          return false;
        }
      }
    }
  }
  return true;
}

}  // namespace kiln
