#include "simplify/small_components.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/box.h"

namespace kiln {

ComponentSizes::ComponentSizes(const Work& work) : component_of_triangle_(work.triangles.size()) {
  DisjointSets sets(work.points.size());
  join_parts(work.triangles, sets);
  std::uint32_t component_count = 0;
  for (std::uint32_t v = 0; v < work.points.size(); ++v) component_count += sets.find(v) == v;
  if (component_count < 2) {
    diagonal_ = {std::numeric_limits<double>::infinity()};
    return;
  }
  constexpr std::uint32_t kNoComponent = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(work.points.size(), kNoComponent);
  std::vector<Box<Vec3d>> boxes;
  for (std::size_t t = 0; t < component_of_triangle_.size(); ++t) {
    std::uint32_t& part = number[sets.find(work.triangles[t][0])];
    if (part == kNoComponent) {
      part = static_cast<std::uint32_t>(boxes.size());
      boxes.emplace_back();
      faces_.push_back(0);
    }
    component_of_triangle_[t] = part;
    ++faces_.at(part);
    for (const std::uint32_t v : work.triangles[t]) boxes[part].add(work.points[v]);
  }
  for (const Box<Vec3d>& box : boxes) diagonal_.push_back(box.diagonal());
  largest_component_ = static_cast<std::uint32_t>(
      std::max_element(diagonal_.begin(), diagonal_.end()) - diagonal_.begin());
}

bool ComponentSizes::is_below(std::uint32_t part, double size) const {
  return part != largest_component_ && diagonal_[part] < size;
}

std::uint64_t ComponentSizes::count_below(double size) const {
  std::uint64_t count = 0;
  for (std::uint32_t part = 0; part < diagonal_.size(); ++part) count += is_below(part, size);
  return count;
}

std::vector<std::uint8_t> ComponentSizes::components_below(double size) const {
  std::vector<std::uint8_t> is_dropped(diagonal_.size());
  for (std::uint32_t part = 0; part < is_dropped.size(); ++part)
    is_dropped[part] = is_below(part, size);
  return is_dropped;
}

std::vector<std::uint8_t> ComponentSizes::surplus_components(std::size_t faces,
                                                             std::uint32_t least) const {
  std::vector<std::uint32_t> order(faces_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return diagonal_[a] > diagonal_[b]; });
  std::vector<std::uint8_t> is_dropped(faces_.size(), 0);
  std::size_t needed_faces = 0;
  for (const std::uint32_t part : order) {
    needed_faces += std::min(faces_[part], least);
    is_dropped[part] = needed_faces > faces && part != largest_component_;
  }
  return is_dropped;
}

std::vector<Triangle> ComponentSizes::largest_component(const Work& work) const {
  std::vector<double> area(diagonal_.size(), 0);
  for (std::size_t t = 0; t < component_of_triangle_.size(); ++t) {
    const Triangle& v = work.triangles[t];
    const Vec3d& a = work.points[v[0]];
    area[component_of_triangle_[t]] += length(cross(work.points[v[1]] - a, work.points[v[2]] - a));
  }
  const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < component_of_triangle_.size(); ++t) {
    if (component_of_triangle_[t] == largest) triangles.push_back(work.triangles[t]);
  }
  return triangles;
}

Work ComponentSizes::without_components(const Work& work,
                                        const std::vector<std::uint8_t>& is_dropped) const {
  constexpr std::uint32_t kNoComponent = std::numeric_limits<std::uint32_t>::max();
  Work result;
  result.keep_labels = work.keep_labels;
  std::vector<std::uint32_t> number(work.points.size(), kNoComponent);
  for (std::size_t t = 0; t < component_of_triangle_.size(); ++t) {
    if (is_dropped[component_of_triangle_[t]] != 0) continue;
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
