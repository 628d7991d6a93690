#include "mesh/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kLeafSize = 4;

double squared_to_segment(const Vec3d& offset, const Vec3d& edge) {
  const double length2 = dot(edge, edge);
  const double t = length2 > 0 ? std::clamp(dot(offset, edge) / length2, 0.0, 1.0) : 0.0;
  const Vec3d rest = offset - edge * t;
  return dot(rest, rest);
}

/// The plane's distance where the foot lies inside the triangle, else the nearest edge's.
double squared_to_triangle(const Vec3& p, const Vec3* c) {
  const Vec3d ab = Vec3d(c[1]) - Vec3d(c[0]);
  const Vec3d ac = Vec3d(c[2]) - Vec3d(c[0]);
  const Vec3d ap = Vec3d(p) - Vec3d(c[0]);
  const Vec3d n = cross(ab, ac);
  const double n2 = dot(n, n);
  if (n2 > 0) {
    const double d00 = dot(ab, ab), d01 = dot(ab, ac), d11 = dot(ac, ac);
    const double d20 = dot(ap, ab), d21 = dot(ap, ac);
    const double v = d11 * d20 - d01 * d21;
    const double w = d00 * d21 - d01 * d20;
    if (v >= 0 && w >= 0 && v + w <= d00 * d11 - d01 * d01) {
      const double along = dot(ap, n);
      return along * along / n2;
    }
  }
  const double e0 = squared_to_segment(ap, ab);
  const double e1 = squared_to_segment(ap, ac);
  const double e2 = squared_to_segment(Vec3d(p) - Vec3d(c[1]), Vec3d(c[2]) - Vec3d(c[1]));
  return std::min({e0, e1, e2});
}

double squared_to_box(const Vec3& p, const Vec3& low, const Vec3& high) {
  const double x = std::max({double{low.x} - p.x, double{p.x} - high.x, 0.0});
  const double y = std::max({double{low.y} - p.y, double{p.y} - high.y, 0.0});
  const double z = std::max({double{low.z} - p.z, double{p.z} - high.z, 0.0});
  return x * x + y * y + z * z;
}

float component(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

void extend(Vec3& low, Vec3& high, const Vec3& p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
}

}  // namespace

SurfaceDistance::SurfaceDistance(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles) {
  if (triangles.empty()) return;
  std::vector<Vec3> centers(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3& a = positions[triangles[t][0]];
    const Vec3& b = positions[triangles[t][1]];
    const Vec3& c = positions[triangles[t][2]];
    centers[t] = {(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3};
  }
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  build(order, centers, positions, triangles);
  corners_.reserve(triangles.size() * 3);
  for (const std::uint32_t t : order) {
    for (const std::uint32_t vertex : triangles[t]) corners_.push_back(positions[vertex]);
  }
  order_ = std::move(order);
}

void SurfaceDistance::build(std::vector<std::uint32_t>& order, const std::vector<Vec3>& centers,
                            std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  // Depth first with the left child next to its parent; the parent learns its right child's place
  // when that one is taken from the stack. Halving the count bounds the depth by log2(n).
  struct Task {
    std::uint32_t first, last, parent;
  };
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<Task> tasks{{0, static_cast<std::uint32_t>(order.size()), kNone}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const auto index = static_cast<std::uint32_t>(boxes_.size());
    if (task.parent != kNone) boxes_[task.parent].first = index;

    constexpr float kInf = std::numeric_limits<float>::infinity();
    Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf}, center_low = low, center_high = high;
    for (std::uint32_t i = task.first; i < task.last; ++i) {
      for (const std::uint32_t vertex : triangles[order[i]]) extend(low, high, positions[vertex]);
      extend(center_low, center_high, centers[order[i]]);
    }
    boxes_.push_back({low, high, task.first, 0});
    if (task.last - task.first <= kLeafSize) {
      boxes_.back().count = task.last - task.first;
      continue;
    }
    const Vec3 size{center_high.x - center_low.x, center_high.y - center_low.y,
                    center_high.z - center_low.z};
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = task.first + (task.last - task.first) / 2;
    std::nth_element(order.begin() + task.first, order.begin() + middle, order.begin() + task.last,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const float ka = component(centers[a], axis);
                       const float kb = component(centers[b], axis);
                       return ka != kb ? ka < kb : a < b;
                     });
    tasks.push_back({middle, task.last, index});
    tasks.push_back({task.first, middle, kNone});
  }
}

double SurfaceDistance::squared(const Vec3& point) const {
  std::uint32_t place = 0;
  return search(point, place);
}

std::uint32_t SurfaceDistance::nearest(const Vec3& point) const {
  std::uint32_t place = 0;
  search(point, place);
  return order_.empty() ? 0 : order_[place];
}

double SurfaceDistance::search(const Vec3& point, std::uint32_t& place) const {
  double best = std::numeric_limits<double>::infinity();
  if (boxes_.empty()) return best;
  struct Entry {
    std::uint32_t box;
    double distance;
  };
  std::array<Entry, 64> stack;  // The depth is at most 32, and each level leaves one entry behind.
  std::size_t top = 0;
  stack[top++] = {0, squared_to_box(point, boxes_[0].low, boxes_[0].high)};
  while (top != 0) {
    const Entry entry = stack[--top];
    if (entry.distance >= best) continue;
    const Box& box = boxes_[entry.box];
    if (box.count != 0) {
      for (std::uint32_t i = box.first; i < box.first + box.count; ++i) {
        const double distance = squared_to_triangle(point, &corners_[std::size_t{3} * i]);
        if (!(distance < best)) continue;
        best = distance;
        place = i;
      }
      continue;
    }
    const std::uint32_t left = entry.box + 1;
    const std::uint32_t right = box.first;
    const double to_left = squared_to_box(point, boxes_[left].low, boxes_[left].high);
    const double to_right = squared_to_box(point, boxes_[right].low, boxes_[right].high);
    if (to_left <= to_right) {
      stack[top++] = {right, to_right};
      stack[top++] = {left, to_left};
    } else {
      stack[top++] = {left, to_left};
      stack[top++] = {right, to_right};
    }
  }
  return best;
}

void SurfaceDistance::each_within(const Vec3& center, double squared_radius,
                                  const std::function<void(const Vec3*)>& body) const {
  if (boxes_.empty()) return;
  std::array<std::uint32_t, 64> stack{};
  std::size_t top = 1;
  while (top != 0) {
    const std::uint32_t index = stack[--top];
    const Box& box = boxes_[index];
    if (squared_to_box(center, box.low, box.high) > squared_radius) continue;
    if (box.count == 0) {
      stack[top++] = box.first;
      stack[top++] = index + 1;
      continue;
    }
    for (std::uint32_t i = box.first; i < box.first + box.count; ++i) {
      const Vec3* corners = &corners_[std::size_t{3} * i];
      if (squared_to_triangle(center, corners) <= squared_radius) body(corners);
    }
  }
}

DistanceReport one_sided_distance(std::span<const Vec3> dense_positions,
                                  std::span<const Triangle> dense_triangles,
                                  const SurfaceDistance& light, std::uint64_t max_samples) {
  DistanceReport report;
  const std::uint64_t available = std::uint64_t{dense_triangles.size()} * 4;
  report.samples = std::min(available, max_samples);
  if (report.samples == 0) return report;

  std::vector<double> squared(report.samples);
  parallel_for(report.samples, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      // Evenly spaced in the list of four samples a triangle: its corners, then its centroid.
      const auto sample = static_cast<std::uint64_t>(
          static_cast<double>(i) *
          (static_cast<double>(available) / static_cast<double>(report.samples)));
      const Triangle& t = dense_triangles[std::min(sample, available - 1) / 4];
      const Vec3& a = dense_positions[t[0]];
      const Vec3& b = dense_positions[t[1]];
      const Vec3& c = dense_positions[t[2]];
      const std::array<Vec3, 4> points{
          a, b, c, Vec3{(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3}};
      squared[i] = light.squared(points[sample % 4]);
    }
  });
  double sum = 0, sum_of_squares = 0, largest = 0;
  for (const double value : squared) {
    sum += std::sqrt(value);
    sum_of_squares += value;
    largest = std::max(largest, value);
  }
  const auto count = static_cast<double>(report.samples);
  report.largest = std::sqrt(largest);
  report.mean = sum / count;
  report.root_mean_square = std::sqrt(sum_of_squares / count);
  return report;
}

}  // namespace kiln
