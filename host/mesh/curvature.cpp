#include "mesh/curvature.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "mesh/ball_clip.h"
#include "mesh/dense_normals.h"
#include "mesh/usable.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kGrainOfSums = 256;
constexpr std::size_t kGrainOfTriangles = std::size_t{1} << 12;
constexpr std::size_t kGroup = 16;    // places that look for their balls' boxes together
constexpr std::size_t kLeaf = 4;      // triangles
constexpr double kFinest = 1.0 / 16;  // of the radius: half the diagonal of boxes not opened
// A box whose diagonal is so many radii lies in no ball: 2, and what rounding could take.
constexpr double kSurelyWider = 2.001;
constexpr float kFlat = 0;

/// What a part of the surface adds to a ball's sums.
struct Sums {
  double area = 0;
  double bend = 0;  // angle * length / 2 of edges; each triangle has one half of its edges
  Sums& operator+=(const Sums& other) {
    area += other.area;
    bend += other.bend;
    return *this;
  }
};

/// The mesh's edges: angles, and what is short at each place.
struct Edges {
  std::vector<std::array<float, 3>> angle;  ///< Of each triangle, edge k from corner k; signed
  std::vector<double> shortest;             ///< At each place; infinite where there is no edge
};

Vec3d area_normal(std::span<const Vec3> positions, const Triangle& t) {
  const Vec3d first(positions[t[0]]);
  return cross(Vec3d(positions[t[1]]) - first, Vec3d(positions[t[2]]) - first);
}

/// The angle at an edge of one triangle to another. \param way  along the edge, as the first one
/// runs
double angle_between(const Vec3d& normal, const Vec3d& other, const Vec3d& way) {
  // Folded flat is convex, whatever the sign of the 0.
  const double sine = dot(cross(normal, other), way) / length(way) + 0.0;
  return std::atan2(sine, dot(normal, other));
}

Edges find_edges(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                 std::span<const std::uint32_t> place, std::span<const std::uint8_t> usable) {
  Edges edges{std::vector<std::array<float, 3>>(triangles.size()),
              std::vector<double>(positions.size(), kInfinity)};
  const Adjacency corners =
      Adjacency::make(positions.size(), triangles.size() * 3, [&](std::size_t i) {
        return usable[i / 3] != 0 ? std::size_t{place[triangles[i / 3][i % 3]]} : positions.size();
      });
  struct Side {
    std::uint32_t other, inward,
        corner;  // the place at its end; 1: runs from there; where it starts
    bool operator<(const Side& b) const {
      return std::tie(other, inward, corner) < std::tie(b.other, b.inward, b.corner);
    }
  };
  parallel_for(positions.size(), kGrainOfSums, [&](std::size_t begin, std::size_t end) {
    std::vector<Side> sides;
    for (std::size_t v = begin; v < end; ++v) {
      sides.clear();
      for (const std::uint32_t corner : corners.of(v)) {
        const Triangle& t = triangles[corner / 3];
        const std::uint32_t k = corner % 3;
        const std::uint32_t previous = corner - k + (k + 2) % 3;
        sides.push_back({place[t[(k + 1) % 3]], 0, corner});
        sides.push_back({place[t[(k + 2) % 3]], 1, previous});
      }
      std::sort(sides.begin(), sides.end());
      for (std::size_t i = 0; i < sides.size();) {
        std::size_t next = i + 1;
        while (next < sides.size() && sides[next].other == sides[i].other) ++next;
        const Vec3d way = Vec3d(positions[sides[i].other]) - Vec3d(positions[v]);
        edges.shortest[v] = std::min(edges.shortest[v], length(way));
        const bool joined = next - i == 2 && sides[i].inward == 0 && sides[i + 1].inward == 1;
        if (joined && v < sides[i].other) {
          const std::uint32_t a = sides[i].corner, b = sides[i + 1].corner;
          const auto angle =
              static_cast<float>(angle_between(area_normal(positions, triangles[a / 3]),
                                               area_normal(positions, triangles[b / 3]), way));
          edges.angle[a / 3][a % 3] = edges.angle[b / 3][b % 3] = angle;
        }
        i = next;
      }
    }
  });
  return edges;
}

/// Triangles in a balanced tree of boxes, with the sums of each.
class Tree {
 public:
  Tree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
       std::span<const std::uint8_t> usable, std::span<const std::array<float, 3>> angle)
      : positions_(positions), triangles_(triangles), angle_(angle) {
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      if (usable[t] == 0) continue;
      Vec3d sum;
      for (const std::uint32_t corner : triangles[t]) sum += Vec3d(positions[corner]);
      const Vec3 centre = to_float(sum * (1.0 / 3));
      order_.push_back({{centre.x, centre.y, centre.z}, t});
    }
    while (order_.size() >> levels_ > kLeaf) ++levels_;
    for (std::uint32_t level = 0; level < levels_; ++level) {
      for_each_of(level, [&](std::size_t i) { split(level, i); });
    }
    nodes_.resize((std::size_t{2} << levels_) - 1);
    whole_.resize(order_.size());
    for_each_of(levels_, [&](std::size_t i) { fill_leaf(i); });
    for (std::uint32_t level = levels_; level-- > 0;) {
      for_each_of(level, [&](std::size_t i) { join(first_of(level) + i); });
    }
  }

  /// Corners of triangles, each once: neighbours in space are neighbours here.
  std::vector<std::uint32_t> places(std::span<const std::uint32_t> place) const {
    std::vector<std::uint32_t> found;
    std::vector<std::uint8_t> seen(place.size());
    for (const Item& item : order_) {
      for (const std::uint32_t corner : triangles_[item.triangle]) {
        if (std::exchange(seen[place[corner]], 1) == 0) found.push_back(place[corner]);
      }
    }
    return found;
  }

  /// Where balls of this radius or less around points of a box may begin: boxes too large to lie in one
  /// of them are opened, boxes beyond all of them left out.
  void begin(const Vec3d& low, const Vec3d& high, double radius,
             std::vector<std::size_t>& boxes) const {
    boxes.clear();
    if (order_.empty()) return;
    std::array<std::size_t, 66> stack{};  // one level leaves one behind
    std::size_t height = 1;
    while (height != 0) {
      const std::size_t at = stack[--height];
      const Node& node = nodes_[at];
      // Rounded as within() rounds, so what is left out here is left out there.
      if (nearest(Vec3d(node.low) - high, Vec3d(node.high) - low) >= radius * radius) continue;
      const bool opens = length(Vec3d(node.high) - Vec3d(node.low)) > radius * kSurelyWider;
      if (!opens || at >= first_of(levels_)) {
        boxes.push_back(at);
        continue;
      }
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
    }
  }

  /// The surface's sums in a ball. \param boxes  of begin(), for a box that its centre is in
  Sums within(std::span<const std::size_t> boxes, const Vec3d& centre, double radius) const {
    Sums sums;
    const double squared = radius * radius;
    std::array<std::size_t, 66> stack{};  // one level leaves one behind
    std::size_t height = 0;
    for (std::size_t box = 0; height != 0 || box < boxes.size();) {
      const std::size_t at = height != 0 ? stack[--height] : boxes[box++];
      const Node& node = nodes_[at];
      const Vec3d low = Vec3d(node.low) - centre, high = Vec3d(node.high) - centre;
      if (nearest(low, high) >= squared) continue;
      if (farthest(low, high) <= squared) {
        sums += node.sums;
        continue;
      }
      const double half = length(high - low) / 2;
      if (half < radius * kFinest) {
        const double away = length(low + high) / 2;
        const double share = std::clamp((radius + half - away) / (2 * half), 0.0, 1.0);
        sums += {node.sums.area * share, node.sums.bend * share};
      } else if (at >= first_of(levels_)) {
        const std::size_t leaf = at - first_of(levels_);
        for (std::size_t i = begin_of(levels_, leaf); i < begin_of(levels_, leaf + 1); ++i) {
          sums += clipped(i, centre, squared);
        }
      } else {
        stack[height++] = 2 * at + 2;
        stack[height++] = 2 * at + 1;
      }
    }
    return sums;
  }

 private:
  struct Node {
    Vec3 low, high;
    Sums sums;
  };
  struct Item {
    std::array<float, 3> centre;
    std::uint32_t triangle;
  };

  static std::size_t first_of(std::uint32_t level) { return (std::size_t{1} << level) - 1; }
  std::size_t begin_of(std::uint32_t level, std::size_t i) const {
    return static_cast<std::size_t>(std::uint64_t{order_.size()} * i >> level);
  }
  template <typename Body>
  void for_each_of(std::uint32_t level, const Body& body) const {
    // Some thousand triangles a piece, so that threads are worth it.
    const std::size_t grain = 1 + (std::size_t{1} << 13) / (1 + (order_.size() >> level));
    parallel_for(std::size_t{1} << level, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    });
  }

  /// Halves a node's triangles along the widest side of their centres' box.
  void split(std::uint32_t level, std::size_t i) {
    const auto at = [&](std::size_t item) {
      return order_.begin() + static_cast<std::ptrdiff_t>(item);
    };
    const auto begin = at(begin_of(level, i)), end = at(begin_of(level, i + 1));
    const auto middle = at(begin_of(level + 1, 2 * i + 1));
    std::array<float, 3> low = begin->centre, high = low;
    for (auto item = begin; item != end; ++item) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], item->centre[k]);
        high[k] = std::max(high[k], item->centre[k]);
      }
    }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    }
    std::nth_element(begin, middle, end, [axis](const Item& a, const Item& b) {
      return std::tie(a.centre[axis], a.triangle) < std::tie(b.centre[axis], b.triangle);
    });
  }

  void fill_leaf(std::size_t leaf) {
    Node& node = nodes_[first_of(levels_) + leaf];
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(begin_of(levels_, leaf));
    const auto end = order_.begin() + static_cast<std::ptrdiff_t>(begin_of(levels_, leaf + 1));
    // The order of sums is not left to nth_element.
    std::sort(begin, end, [](const Item& a, const Item& b) { return a.triangle < b.triangle; });
    constexpr float kFar = std::numeric_limits<float>::infinity();
    node.low = {kFar, kFar, kFar};
    node.high = {-kFar, -kFar, -kFar};
    for (auto item = begin; item != end; ++item) {
      for (const std::uint32_t corner : triangles_[item->triangle]) {
        widen(node, positions_[corner], positions_[corner]);
      }
      const auto number = static_cast<std::size_t>(item - order_.begin());
      whole_[number] = whole(item->triangle);
      node.sums += whole_[number];
    }
  }

  void join(std::size_t at) {
    const Node& left = nodes_[2 * at + 1];
    const Node& right = nodes_[2 * at + 2];
    nodes_[at] = left;
    widen(nodes_[at], right.low, right.high);
    nodes_[at].sums += right.sums;
  }

  static void widen(Node& node, const Vec3& low, const Vec3& high) {
    node.low = {std::min(node.low.x, low.x), std::min(node.low.y, low.y),
                std::min(node.low.z, low.z)};
    node.high = {std::max(node.high.x, high.x), std::max(node.high.y, high.y),
                 std::max(node.high.z, high.z)};
  }

  /// Squared distances from 0 to a box.
  static double nearest(const Vec3d& low, const Vec3d& high) {
    const Vec3d way{std::max({low.x, -high.x, 0.0}), std::max({low.y, -high.y, 0.0}),
                    std::max({low.z, -high.z, 0.0})};
    return dot(way, way);
  }
  static double farthest(const Vec3d& low, const Vec3d& high) {
    const Vec3d way{std::max(-low.x, high.x), std::max(-low.y, high.y), std::max(-low.z, high.z)};
    return dot(way, way);
  }

  std::array<Vec3d, 3> corners(std::uint32_t triangle, const Vec3d& from) const {
    const Triangle& t = triangles_[triangle];
    return {Vec3d(positions_[t[0]]) - from, Vec3d(positions_[t[1]]) - from,
            Vec3d(positions_[t[2]]) - from};
  }

  Sums whole(std::uint32_t triangle) const {
    const std::array<Vec3d, 3> p = corners(triangle, {});
    Sums sums{length(cross(p[1] - p[0], p[2] - p[0])) / 2, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      sums.bend += angle_[triangle][k] * length(p[(k + 1) % 3] - p[k]) / 4;
    }
    return sums;
  }

  Sums clipped(std::size_t item, const Vec3d& centre, double squared) const {
    const std::uint32_t triangle = order_[item].triangle;
    const std::array<Vec3d, 3> p = corners(triangle, centre);
    const auto [x_low, x_high] = std::minmax({p[0].x, p[1].x, p[2].x});
    const auto [y_low, y_high] = std::minmax({p[0].y, p[1].y, p[2].y});
    const auto [z_low, z_high] = std::minmax({p[0].z, p[1].z, p[2].z});
    if (nearest({x_low, y_low, z_low}, {x_high, y_high, z_high}) >= squared) return {};
    if (std::all_of(p.begin(), p.end(), [&](const Vec3d& c) { return dot(c, c) <= squared; })) {
      return whole_[item];
    }
    Sums sums{area_within(p, squared), 0};
    for (std::size_t k = 0; k < 3; ++k) {
      if (angle_[triangle][k] == kFlat) continue;
      const Vec3d& q = p[(k + 1) % 3];
      const auto [begin, end] = part_within(p[k], q, squared);
      if (end > begin) sums.bend += angle_[triangle][k] * (end - begin) * length(q - p[k]) / 4;
    }
    return sums;
  }

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  std::span<const std::array<float, 3>> angle_;
  std::vector<Item> order_;
  std::uint32_t levels_ = 0;
  std::vector<Sums> whole_;  // of each item
  std::vector<Node> nodes_;  // level by level; children of i are 2 i + 1 and 2 i + 2
};

/// Mean curvature at places that lie close together. \param boxes  room
void bend_at(const Tree& tree, std::span<const Vec3> positions,
             std::span<const std::uint32_t> places, std::span<const double> shortest, double radius,
             std::vector<std::size_t>& boxes, std::vector<double>& result) {
  Vec3d low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  double widest = radius;
  for (const std::uint32_t v : places) {
    const Vec3d at(positions[v]);
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
    widest = std::max(widest, shortest[v]);
  }
  tree.begin(low, high, widest, boxes);
  for (const std::uint32_t v : places) {
    const Sums sums = tree.within(boxes, Vec3d(positions[v]), std::max(radius, shortest[v]));
    if (sums.area > 0) result[v] = sums.bend / sums.area;
  }
}

}  // namespace

std::vector<double> mean_curvature(std::span<const Vec3> positions,
                                   std::span<const Triangle> triangles, double radius) {
  const std::vector<std::uint32_t> place = weld_vertices(positions);
  std::vector<std::uint8_t> usable(triangles.size());
  parallel_for(triangles.size(), kGrainOfTriangles, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      usable[t] = has_area(positions, triangles[t]) ? 1 : 0;
    }
  });
  const Edges edges = find_edges(positions, triangles, place, usable);
  const Tree tree(positions, triangles, usable, edges.angle);
  std::vector<double> result(positions.size(), 0.0);
  const std::vector<std::uint32_t> places = tree.places(place);
  parallel_for((places.size() + kGroup - 1) / kGroup, kGrainOfSums / kGroup,
               [&](std::size_t begin, std::size_t end) {
                 std::vector<std::size_t> boxes;
                 for (std::size_t group = begin; group < end; ++group) {
                   const std::size_t first = group * kGroup;
                   const std::size_t count = std::min(kGroup, places.size() - first);
                   bend_at(tree, positions, std::span(places).subspan(first, count), edges.shortest,
                           radius, boxes, result);
                 }
               });
  for (std::size_t v = 0; v < result.size(); ++v) result[v] = result[place[v]];
  return result;
}

}  // namespace kiln
