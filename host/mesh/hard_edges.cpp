#include "mesh/hard_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "base/parallel.h"
#include "mesh/box.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr double kSameNormalCosine = 0.99996192306;  // Cosine of 0.5 degrees
constexpr std::size_t kEdgesPerTask = 256;

struct HardSide {
  std::uint32_t a = 0, b = 0;  ///< Welded vertices of the edge, a < b
  std::uint32_t triangle = 0;
  std::uint8_t at_a = 0, at_b = 0;  ///< Corners of the triangle at the two vertices
};

/// Sides with at least one vertex that has several normals. Other sides cannot be hard.
std::vector<HardSide> hard_sides_of(const LowSurface& surface) {
  std::vector<Vec3> positions;
  positions.reserve(3 * surface.triangles.size());
  for (const auto& corners : surface.triangles) {
    for (const LowSurface::Corner& corner : corners) positions.push_back(corner.position);
  }
  const std::vector<std::uint32_t> welded = weld_vertices(positions);
  std::vector<Vec3> normal(welded.size());
  // State of each vertex. 0: no corner yet, 1: one normal, 2: several normals
  std::vector<std::uint8_t> normal_count(welded.size());
  for (const std::size_t t : surface.usable_triangles()) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t at = welded[3 * t + k];
      const Vec3& own = surface.triangles[t][k].normal;
      if (normal_count[at] == 0) normal[at] = own;
      normal_count[at] = normal_count[at] < 2 && normal[at] == own ? 1 : 2;
    }
  }
  std::vector<HardSide> triangle_sides;
  for (const std::uint32_t t : surface.usable_triangles()) {
    for (std::uint8_t k = 0; k < 3; ++k) {
      const auto next = static_cast<std::uint8_t>((k + 1) % 3);
      HardSide side{welded[3 * t + k], welded[3 * t + next], t, k, next};
      if (side.a == side.b || (normal_count[side.a] < 2 && normal_count[side.b] < 2)) continue;
      if (side.a > side.b) {
        std::swap(side.a, side.b);
        std::swap(side.at_a, side.at_b);
      }
      triangle_sides.push_back(side);
    }
  }
  std::sort(triangle_sides.begin(), triangle_sides.end(), [](const HardSide& x, const HardSide& y) {
    return std::tie(x.a, x.b, x.triangle, x.at_a) < std::tie(y.a, y.b, y.triangle, y.at_a);
  });
  return triangle_sides;
}

bool normals_differ(const Vec3& a, const Vec3& b) {
  return dot(to_double(a), to_double(b)) <
         kSameNormalCosine * length(to_double(a)) * length(to_double(b));
}

/// The bounding box of balls around the points.
Box<Vec3> widened_box(std::span<const Vec3> points, float radius) {
  Box<Vec3> box;
  for (const Vec3& p : points) {
    box.add({p.x - radius, p.y - radius, p.z - radius});
    box.add({p.x + radius, p.y + radius, p.z + radius});
  }
  return box;
}

/// A tree of boxes over edges, split at the median of the longest axis. (A sweep along one axis would take O(n^(2/3))
/// per query for edges that fill a volume.)
class EdgeBoxTree {
 public:
  explicit EdgeBoxTree(const std::vector<Box<Vec3>>& boxes)
      : boxes_(boxes), edge_order_(boxes.size()), nodes_(4 * (boxes.size() / kEdgesPerLeaf + 1)) {
    std::iota(edge_order_.begin(), edge_order_.end(), 0U);
    build(0, 0, edge_order_.size());
  }

  /// Appends the edges whose boxes overlap `box`.
  void find(const Box<Vec3>& box, std::vector<std::uint32_t>& found) const {
    find(0, 0, edge_order_.size(), box, found);
  }

 private:
  static constexpr std::size_t kEdgesPerLeaf = 8;

  void build(std::size_t node, std::size_t begin, std::size_t end) {
    Box<Vec3>& all = nodes_[node];
    for (std::size_t i = begin; i < end; ++i) all.join(boxes_[edge_order_[i]]);
    if (end - begin <= kEdgesPerLeaf) return;
    const auto side = [&](int k) { return component(all.high, k) - component(all.low, k); };
    int axis = 0;
    for (const int k : {1, 2}) {
      if (side(k) > side(axis)) axis = k;
    }
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t i) {
      return edge_order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const float low_a = component(boxes_[a].low, axis), low_b = component(boxes_[b].low, axis);
      return low_a != low_b ? low_a < low_b : a < b;
    });
    build(2 * node + 1, begin, middle);
    build(2 * node + 2, middle, end);
  }

  void find(std::size_t node, std::size_t begin, std::size_t end, const Box<Vec3>& box,
            std::vector<std::uint32_t>& found) const {
    if (!nodes_[node].overlaps(box)) return;
    if (end - begin <= kEdgesPerLeaf) {
      for (std::size_t i = begin; i < end; ++i) {
        if (boxes_[edge_order_[i]].overlaps(box)) found.push_back(edge_order_[i]);
      }
      return;
    }
    const std::size_t middle = (begin + end) / 2;
    find(2 * node + 1, begin, middle, box, found);
    find(2 * node + 2, middle, end, box, found);
  }

  const std::vector<Box<Vec3>>& boxes_;
  std::vector<std::uint32_t> edge_order_;
  std::vector<Box<Vec3>> nodes_;  // Nodes; the children of node n are 2 n + 1 and 2 n + 2
};

}  // namespace

HardEdges HardEdges::of(const LowSurface& surface) {
  const std::vector<HardSide> triangle_sides = hard_sides_of(surface);
  HardEdges result;
  const auto corner = [&](const HardSide& side, std::uint8_t k) -> const LowSurface::Corner& {
    return surface.triangles[side.triangle][k];
  };
  for (std::size_t first = 0, end = 0; first < triangle_sides.size(); first = end) {
    while (end < triangle_sides.size() && triangle_sides[end].a == triangle_sides[first].a &&
           triangle_sides[end].b == triangle_sides[first].b) {
      ++end;
    }
    const HardSide& one = triangle_sides[first];
    bool hard = false;
    for (std::size_t i = first + 1; i < end && !hard; ++i) {
      hard = normals_differ(corner(one, one.at_a).normal,
                            corner(triangle_sides[i], triangle_sides[i].at_a).normal) ||
             normals_differ(corner(one, one.at_b).normal,
                            corner(triangle_sides[i], triangle_sides[i].at_b).normal);
    }
    const Vec3 from = corner(one, one.at_a).position;
    const Vec3 along = to_float(to_double(corner(one, one.at_b).position) - to_double(from));
    // Very short edges are left out, since their squared length would underflow.
    if (hard && length(to_double(along)) > 1e-15) {
      result.edges.push_back({from, along, {one.triangle, triangle_sides[first + 1].triangle}});
    }
  }
  return result;
}

HardEdges::EdgesOfTriangles HardEdges::find_near(const LowSurface& surface,
                                                 std::span<const float> widths) const {
  std::vector<Box<Vec3>> boxes(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Vec3 to = to_float(to_double(edges[e].from) + to_double(edges[e].along));
    boxes[e] = widened_box(std::array{edges[e].from, to}, widths[e]);
  }
  const EdgeBoxTree tree(boxes);
  std::vector<std::vector<std::uint32_t>> edge_lists(surface.triangles.size());
  parallel_for(edge_lists.size(), kEdgesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      if (surface.usable[t] == 0) continue;
      const auto& [a, b, c] = surface.triangles[t];
      tree.find(widened_box(std::array{a.position, b.position, c.position}, 0), edge_lists[t]);
      std::sort(edge_lists[t].begin(), edge_lists[t].end());
    }
  });
  EdgesOfTriangles result;
  result.first.reserve(edge_lists.size() + 1);
  for (const std::vector<std::uint32_t>& list : edge_lists) {
    result.first.push_back(static_cast<std::uint32_t>(result.edge.size()));
    result.edge.insert(result.edge.end(), list.begin(), list.end());
  }
  result.first.push_back(static_cast<std::uint32_t>(result.edge.size()));
  return result;
}

}  // namespace kiln
