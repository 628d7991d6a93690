#include "mesh/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "mesh/box.h"
#include "mesh/two_boxes.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kLeafSize = 4;
/// Number of subtrees that are built in parallel, and minimum number of triangles in a range that is split for this
/// purpose.
constexpr std::size_t kMaxSubtrees = 32, kMinSubtreeTriangles = 4096;
/// If the plane of a triangle is farther away than the best triangle so far, the triangle is, too; kFartherFactor is
/// the margin for rounding. Triangles whose squared sine is below kMinSquaredSine are tested by their sides, because
/// their plane is inaccurate.
constexpr double kFartherFactor = 1.0001, kMinSquaredSine = 1e-12;

/// Long diagonal triangles (hair, stems) have boxes that overlap and are mostly empty, so a search would visit a
/// constant share of all boxes. If the total area of all boxes exceeds kMaxBoxAreaRatio times that of the triangles,
/// triangles are cut into pieces with boxes of their own. The number of a triangle's pieces is the ratio of its own
/// box's area to its area, divided by kBoxAreaRatioPerPiece, at most kMaxPieces.
constexpr double kMaxBoxAreaRatio = 6, kBoxAreaRatioPerPiece = 2;
constexpr int kMaxPieces = 12;
/// With more triangles than this, cutting takes longer than it saves.
constexpr std::size_t kMaxTrianglesToCut = 300'000;
/// Margin for rounding of a piece's box, as a share of the triangle's longest side.
constexpr float kPieceMargin = 1e-6F;

/// Number of boxes in a tree over `count` triangles. All boxes of a level contain `size` or size + 1 triangles.
std::size_t count_boxes(std::size_t count) {
  std::size_t boxes = 0, size = count, smaller_count = 1, larger_count = 0;
  while (size > kLeafSize) {
    boxes += smaller_count + larger_count;
    if (size % 2 == 0) {
      smaller_count = 2 * smaller_count + larger_count;
    } else {
      larger_count = smaller_count + 2 * larger_count;
    }
    size /= 2;
  }
  return boxes + smaller_count + (size == kLeafSize ? 3 : 1) * larger_count;
}

double squared_length(const Vec3d& v) { return dot(v, v); }

double squared_distance_to_segment(const Vec3d& offset, const Vec3d& edge) {
  const double length2 = dot(edge, edge), projection = dot(offset, edge);
  if (!(projection > 0)) return squared_length(offset);
  return squared_length(offset - (projection < length2 ? edge * (projection / length2) : edge));
}

/// True if the planes of two triangles show that both are farther away than the best.
bool both_farther(const Vec3d& p, const Vec3* one, const Vec3* other, double best) {
  const Double2 ax{one[0].x, other[0].x}, ay{one[0].y, other[0].y}, az{one[0].z, other[0].z};
  const Double2 bx = Double2{one[1].x, other[1].x} - ax, by = Double2{one[1].y, other[1].y} - ay,
                bz = Double2{one[1].z, other[1].z} - az;
  const Double2 cx = Double2{one[2].x, other[2].x} - ax, cy = Double2{one[2].y, other[2].y} - ay,
                cz = Double2{one[2].z, other[2].z} - az;
  const Double2 nx = by * cz - bz * cy, ny = bz * cx - bx * cz, nz = bx * cy - by * cx;
  const Double2 n2 = nx * nx + ny * ny + nz * nz;
  const Double2 plane_distance =
      (Double2{p.x, p.x} - ax) * nx + (Double2{p.y, p.y} - ay) * ny + (Double2{p.z, p.z} - az) * nz;
  const Double2 squared_bound = kFartherFactor * best * n2;
  const Double2 b2 = bx * bx + by * by + bz * bz, c2 = cx * cx + cy * cy + cz * cz;
  const auto farther =
      (plane_distance * plane_distance > squared_bound) & (n2 > kMinSquaredSine * b2 * c2);
  return farther[0] != 0 && farther[1] != 0;
}

}  // namespace

double squared_distance_to_triangle(const Vec3d& p, const Vec3* c, double best) {
  const Vec3d a = to_double(c[0]);
  const Vec3d ab = to_double(c[1]) - a, ac = to_double(c[2]) - a, ap = p - a;
  const Vec3d n = cross(ab, ac);
  const double n2 = dot(n, n);
  const double d00 = dot(ab, ab), d11 = dot(ac, ac);
  if (n2 > kMinSquaredSine * d00 * d11) {
    const double normal_offset = dot(ap, n);
    if (normal_offset * normal_offset > kFartherFactor * best * n2) return best;
    const double d01 = dot(ab, ac), d20 = dot(ap, ab), d21 = dot(ap, ac);
    const double v = d11 * d20 - d01 * d21;
    const double w = d00 * d21 - d01 * d20;
    if (v >= 0 && w >= 0 && v + w <= d00 * d11 - d01 * d01)
      return normal_offset * normal_offset / n2;
  }
  const double e0 = squared_distance_to_segment(ap, ab);
  const double e1 = squared_distance_to_segment(ap, ac);
  const double e2 =
      squared_distance_to_segment(p - to_double(c[1]), to_double(c[2]) - to_double(c[1]));
  return std::min(std::min(e0, e1), e2);
}

SurfaceDistance::SurfaceDistance(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles) {
  if (triangles.empty()) return;
  if (triangles.size() <= kMaxTrianglesToCut) cut_long_triangles(positions, triangles);
  std::vector<TriangleCentre> items(pieces_.empty() ? triangles.size() : pieces_.size());
  const auto each = [&](const auto& body) {
    parallel_for(items.size(), std::size_t{1} << 15, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  };
  each([&](std::size_t i) {
    if (!pieces_.empty()) {
      const Vec3 middle = to_float((to_double(pieces_[i].low) + to_double(pieces_[i].high)) * 0.5);
      items[i] = {middle, static_cast<std::uint32_t>(i)};
      return;
    }
    const Vec3& a = positions[triangles[i][0]];
    const Vec3& b = positions[triangles[i][1]];
    const Vec3& c = positions[triangles[i][2]];
    items[i] = {{(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3},
                static_cast<std::uint32_t>(i)};
  });
  nodes_.resize(count_boxes(items.size()));
  // Splits level by level until there are enough parts for all threads. The boxes of the levels above these parts are
  // fitted last.
  std::vector<Part> parts{{0, items.size(), 0}}, upper_parts;
  while (parts.size() < kMaxSubtrees && parts[0].last - parts[0].first > kMinSubtreeTriangles) {
    std::vector<std::array<Part, 2>> part_halves(parts.size());
    parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) split_part(items, parts[i], part_halves[i]);
    });
    upper_parts.insert(upper_parts.end(), parts.begin(), parts.end());
    parts.clear();
    for (const std::array<Part, 2>& part_pair : part_halves)
      parts.insert(parts.end(), part_pair.begin(), part_pair.end());
  }
  corners_.resize(items.size() * 3);
  leaf_order_.resize(items.size());
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t part_box = parts[p].box;
      const std::size_t count = parts[p].last - parts[p].first;
      build(items, parts[p]);
      for (std::size_t i = parts[p].first; i < parts[p].last; ++i) {
        leaf_order_[i] = items[i].triangle;
        const std::uint32_t t = pieces_.empty() ? leaf_order_[i] : pieces_[leaf_order_[i]].first;
        for (std::size_t k = 0; k < 3; ++k) corners_[3 * i + k] = positions[triangles[t][k]];
      }
      for (std::size_t box = part_box + count_boxes(count); box-- > part_box;) fit_box(box);
    }
  });
  for (std::size_t i = upper_parts.size(); i-- > 0;) fit_box(upper_parts[i].box);
  for (std::uint32_t& item : leaf_order_) item = pieces_.empty() ? item : pieces_[item].first;
  pieces_ = {};
}

/// Cuts triangles across their longest sides, if their boxes are mostly empty.
void SurfaceDistance::cut_long_triangles(std::span<const Vec3> positions,
                                         std::span<const Triangle> triangles) {
  // For each triangle, the ratio of its box's area to its own area
  std::vector<double> box_area_ratio(triangles.size());
  double triangle_area = 0, box_area = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    Box<Vec3> bounds;
    for (const std::uint32_t v : t) bounds.add(positions[v]);
    const Vec3d size = bounds.size(), a = to_double(positions[t[0]]);
    const double area =
        0.5 * length(cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a));
    const double box = 0.5 * (size.x * size.y + size.y * size.z + size.z * size.x);
    box_area_ratio[i] = area > 0 ? box / area : 1;
    triangle_area += area;
    box_area += box;
  }
  if (!(box_area > kMaxBoxAreaRatio * triangle_area)) return;
  pieces_.reserve(2 * triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    std::array<Vec3d, 3> p{to_double(positions[t[0]]), to_double(positions[t[1]]),
                           to_double(positions[t[2]])};
    const auto side = [&](std::size_t k) {
      const Vec3d v = p[(k + 1) % 3] - p[k];
      return dot(v, v);
    };
    const std::size_t longest = side(0) >= side(1) && side(0) >= side(2) ? 0
                                : side(1) >= side(2)                     ? 1
                                                                         : 2;
    std::rotate(p.begin(), p.begin() + static_cast<std::ptrdiff_t>(longest), p.end());
    const Vec3d longest_side = p[1] - p[0];
    const double length2 = dot(longest_side, longest_side);
    const double apex = dot(p[2] - p[0], longest_side) / length2;
    const int count = static_cast<int>(
        std::clamp(box_area_ratio[i] / kBoxAreaRatioPerPiece, 1.0, 1.0 * kMaxPieces));
    const auto margin = kPieceMargin * static_cast<float>(std::sqrt(length2));
    for (int piece = 0; piece < count; ++piece) {
      const double from = 1.0 * piece / count, to = (piece + 1.0) / count;
      Node box;
      box.first = i;
      const auto add = [&](const Vec3d& v) { box.add(to_float(v)); };
      for (const double s : {from, to}) {
        add(p[0] + longest_side * s);
        add(s < apex ? p[0] + (p[2] - p[0]) * (s / apex)
                     : p[1] + (p[2] - p[1]) * (apex < 1 ? (1 - s) / (1 - apex) : 1));
      }
      if (apex >= from && apex <= to) add(p[2]);
      box.low = {box.low.x - margin, box.low.y - margin, box.low.z - margin};
      box.high = {box.high.x + margin, box.high.y + margin, box.high.z + margin};
      pieces_.push_back(box);
    }
  }
}

/// Splits a range into halves and sets the indices of their boxes, in depth-first order with the left child next to its
/// parent. Halving the number of triangles bounds the depth by log2(n).
/// \returns false for a leaf
bool SurfaceDistance::split_part(std::span<TriangleCentre> items, const Part& part,
                                 std::array<Part, 2>& halves) {
  Node& box = nodes_[part.box];
  if (part.last - part.first <= kLeafSize) {
    box.first = static_cast<std::uint32_t>(part.first);
    box.count = static_cast<std::uint32_t>(part.last - part.first);
    return false;
  }
  Box<Vec3> centers;
  for (std::size_t i = part.first; i < part.last; ++i) centers.add(items[i].center);
  const auto& [low, high] = centers;
  const Vec3 size{high.x - low.x, high.y - low.y, high.z - low.z};
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = part.first + (part.last - part.first) / 2;
  const auto at = [&](std::size_t i) { return items.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(part.first), at(middle), at(part.last),
                   [&](const TriangleCentre& a, const TriangleCentre& b) {
                     const float ka = component(a.center, axis);
                     const float kb = component(b.center, axis);
                     return ka != kb ? ka < kb : a.triangle < b.triangle;
                   });
  const std::size_t right = part.box + 1 + count_boxes(middle - part.first);
  box.first = static_cast<std::uint32_t>(right);
  box.count = 0;
  halves = {Part{part.first, middle, part.box + 1}, Part{middle, part.last, right}};
  return true;
}

void SurfaceDistance::build(std::span<TriangleCentre> items, const Part& part) {
  std::array<Part, 2> halves;
  if (!split_part(items, part, halves)) return;
  build(items, halves[0]);
  build(items, halves[1]);
}

/// Fits a box to its leaf's corners, or to the boxes of its children, which must have been fitted before.
void SurfaceDistance::fit_box(std::size_t index) {
  Node& node = nodes_[index];
  Box<Vec3> box;
  if (node.count == 0) {
    box.join(nodes_[index + 1]);
    box.join(nodes_[node.first]);
  }
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    if (!pieces_.empty()) {
      box.join(pieces_[leaf_order_[i]]);
    } else {
      for (std::size_t k = 0; k < 3; ++k) box.add(corners_[std::size_t{3} * i + k]);
    }
  }
  node.low = box.low;
  node.high = box.high;
}

double SurfaceDistance::squared(const Vec3& point, double within) const {
  std::uint32_t leaf_index = 0;
  return search_nearest(point, leaf_index, within);
}

double SurfaceDistance::squared(const Vec3& point, double within, const Vec3*& corners) const {
  std::uint32_t leaf_index = 0;
  const double result = search_nearest(point, leaf_index, within);
  corners = result < within ? &corners_[3 * std::size_t{leaf_index}] : nullptr;
  return result;
}

bool SurfaceDistance::is_within(const Vec3& point, double squared) const {
  std::uint32_t leaf_index = 0;
  const double above = std::nextafter(squared, std::numeric_limits<double>::infinity());
  return search_nearest(point, leaf_index, above, squared) <= squared;
}

std::uint32_t SurfaceDistance::nearest(const Vec3& point, double within) const {
  std::uint32_t leaf_index = 0;
  search_nearest(point, leaf_index, within);
  return leaf_order_.empty() ? 0 : leaf_order_[leaf_index];
}

double SurfaceDistance::search_nearest(const Vec3& point, std::uint32_t& leaf_index, double best,
                                       double enough) const {
  if (nodes_.empty()) return best;
  const Vec3d at = to_double(point);
  struct PendingBox {
    std::uint32_t box;
    double distance;
  };
  std::array<PendingBox, 64> stack;  // The depth is at most 32, and each level leaves one entry
  std::size_t top = 0;
  PendingBox pending{0, squared_distances_to_boxes(at, nodes_[0], nodes_[0])[0]};
  for (;;) {
    while (!(pending.distance < best)) {
      if (top == 0) return best;
      pending = stack[--top];
    }
    const Node& box = nodes_[pending.box];
    if (box.count != 0) {
      test_leaf(at, box, leaf_index, best);
      if (best <= enough) return best;
      pending.distance = std::numeric_limits<double>::infinity();
      continue;
    }
    const std::uint32_t left = pending.box + 1, right = box.first;
    const Double2 to = squared_distances_to_boxes(at, nodes_[left], nodes_[right]);
    const bool is_right_nearer = to[1] < to[0];
    const PendingBox farther_child =
        is_right_nearer ? PendingBox{left, to[0]} : PendingBox{right, to[1]};
    pending = is_right_nearer ? PendingBox{right, to[1]} : PendingBox{left, to[0]};
    stack[top] = farther_child;
    if (farther_child.distance < best) ++top;
  }
}

/// Tests the triangles of a leaf.
void SurfaceDistance::test_leaf(const Vec3d& at, const Node& leaf, std::uint32_t& leaf_index,
                                double& best) const {
  const std::uint32_t end = leaf.first + leaf.count;
  for (std::uint32_t i = leaf.first; i < end; i += 2) {
    const std::uint32_t next = std::min(i + 1, end - 1);
    if (both_farther(at, &corners_[std::size_t{3} * i], &corners_[std::size_t{3} * next], best)) {
      continue;
    }
    for (std::uint32_t t = i; t <= next; ++t) {
      const double distance = squared_distance_to_triangle(at, &corners_[std::size_t{3} * t], best);
      if (distance >= best) continue;
      best = distance;
      leaf_index = t;
    }
  }
}

void SurfaceDistance::each_within(const Vec3& center, double squared_radius,
                                  const std::function<bool(const Vec3*)>& body) const {
  if (nodes_.empty()) return;
  const Vec3d at = to_double(center);
  std::array<std::uint32_t, 64> stack{};
  std::size_t top = 1;
  while (top != 0) {
    const std::uint32_t index = stack[--top];
    const Node& box = nodes_[index];
    if (squared_distances_to_boxes(at, box, box)[0] > squared_radius) continue;
    if (box.count == 0) {
      stack[top++] = box.first;
      stack[top++] = index + 1;
      continue;
    }
    for (std::uint32_t i = box.first; i < box.first + box.count; ++i) {
      const Vec3* corners = &corners_[std::size_t{3} * i];
      if (squared_distance_to_triangle(at, corners, std::numeric_limits<double>::infinity()) <=
          squared_radius)
        body(corners);
    }
  }
}

}  // namespace kiln
