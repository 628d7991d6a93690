#include "simplify/small_components.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/box.h"

namespace kiln {

ComponentSizes::ComponentSizes(const Work& work) : part_(work.triangles.size()) {
  DisjointSets sets(work.points.size());
  join_parts(work.triangles, sets);
  std::uint32_t roots = 0;
  for (std::uint32_t v = 0; v < work.points.size(); ++v) roots += sets.find(v) == v;
  if (roots < 2) {
    diagonal_ = {std::numeric_limits<double>::infinity()};
    return;
  }
  constexpr std::uint32_t kNoComponent = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(work.points.size(), kNoComponent);
  std::vector<Box<Vec3d>> boxes;
  for (std::size_t t = 0; t < part_.size(); ++t) {
    std::uint32_t& part = number[sets.find(work.triangles[t][0])];
    if (part == kNoComponent) {
      part = static_cast<std::uint32_t>(boxes.size());
      boxes.emplace_back();
      faces_.push_back(0);
    }
    part_[t] = part;
    ++faces_.at(part);
    for (const std::uint32_t v : work.triangles[t]) boxes[part].add(work.points[v]);
  }
  for (const Box<Vec3d>& box : boxes) diagonal_.push_back(box.diagonal());
  largest_ = static_cast<std::uint32_t>(std::max_element(diagonal_.begin(), diagonal_.end()) -
                                        diagonal_.begin());
}

bool ComponentSizes::is_below(std::uint32_t part, double size) const {
  return part != largest_ && diagonal_[part] < size;
}

std::uint64_t ComponentSizes::count_below(double size) const {
  std::uint64_t count = 0;
  for (std::uint32_t part = 0; part < diagonal_.size(); ++part) count += is_below(part, size);
  return count;
}

std::vector<std::uint8_t> ComponentSizes::below(double size) const {
  std::vector<std::uint8_t> dropped(diagonal_.size());
  for (std::uint32_t part = 0; part < dropped.size(); ++part) dropped[part] = is_below(part, size);
  return dropped;
}

std::vector<std::uint8_t> ComponentSizes::surplus(std::size_t faces, std::uint32_t least) const {
  std::vector<std::uint32_t> order(faces_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return diagonal_[a] > diagonal_[b]; });
  std::vector<std::uint8_t> dropped(faces_.size(), 0);
  std::size_t needed = 0;
  for (const std::uint32_t part : order) {
    needed += std::min(faces_[part], least);
    dropped[part] = needed > faces && part != largest_;
  }
  return dropped;
}

std::vector<Triangle> ComponentSizes::body(const Work& work) const {
  std::vector<double> area(diagonal_.size(), 0);
  for (std::size_t t = 0; t < part_.size(); ++t) {
    const Triangle& v = work.triangles[t];
    const Vec3d& a = work.points[v[0]];
    area[part_[t]] += length(cross(work.points[v[1]] - a, work.points[v[2]] - a));
  }
  const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < part_.size(); ++t) {
    if (part_[t] == largest) triangles.push_back(work.triangles[t]);
  }
  return triangles;
}

Work ComponentSizes::without_components(const Work& work,
                                        const std::vector<std::uint8_t>& dropped) const {
  constexpr std::uint32_t kNoComponent = std::numeric_limits<std::uint32_t>::max();
  Work result;
  result.keep_labels = work.keep_labels;
  std::vector<std::uint32_t> number(work.points.size(), kNoComponent);
  for (std::size_t t = 0; t < part_.size(); ++t) {
    if (dropped[part_[t]] != 0) continue;
    Triangle corners = work.triangles[t];
    for (std::uint32_t& v : corners) {
      if (number[v] == kNoComponent) {
        number[v] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(work.points[v]);
      }
      v = number[v];
    }
    result.triangles.push_back(corners);
    if (!work.sources.empty()) result.sources.push_back(work.sources[t]);
    if (!work.labels.empty()) result.labels.push_back(work.labels[t]);
  }
  return result;
}

void join_parts(const std::vector<Triangle>& triangles, DisjointSets& parts) {
  for (const Triangle& t : triangles) {
    parts.join(t[0], t[1]);
    parts.join(t[1], t[2]);
  }
}

void restore_lost_parts(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                        const std::vector<std::uint32_t>& origin, DisjointSets& parts) {
  std::vector<std::uint8_t> has_remaining(origin.size(), 0);
  for (const Triangle& t : triangles) has_remaining[parts.find(origin[t[0]])] = 1;
  for (const Triangle& t : dense) {
    if (has_remaining[parts.find(t[0])] == 0) triangles.push_back(t);
  }
}

double mean_edge(const Work& work, std::size_t faces) {
  double area = 0;
  for (const Triangle& t : work.triangles) {
    const Vec3d &a = work.points[t[0]], &b = work.points[t[1]], &c = work.points[t[2]];
    area += 0.5 * length(cross(b - a, c - a));
  }
  return std::sqrt(4 / std::sqrt(3.0) * area / static_cast<double>(faces));
}

}  // namespace kiln
