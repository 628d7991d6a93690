#include "mesh/curvature.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "mesh/bend_tree.h"
#include "mesh/dense_normals.h"
#include "mesh/usable.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kGrainOfSums = 256;
constexpr std::size_t kGrainOfTriangles = std::size_t{1} << 12;
constexpr std::size_t kGroup = 16;  // places that look for their balls' boxes together

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

/// Mean curvature at places that lie close together.
void bend_at(const BendTree& tree, std::span<const Vec3> positions,
             std::span<const std::uint32_t> places, std::span<const double> shortest, double radius,
             BendTree::Room& room, std::vector<double>& result) {
  Vec3d low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  double widest = radius;
  for (const std::uint32_t v : places) {
    const Vec3d at(positions[v]);
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
    widest = std::max(widest, shortest[v]);
  }
  tree.begin(low, high, widest, room);
  for (const std::uint32_t v : places) {
    const BendSums sums = tree.within(Vec3d(positions[v]), std::max(radius, shortest[v]), room);
    if (sums.area > 0) result[v] = sums.bend / sums.area;
  }
}

}  // namespace

std::vector<double> mean_curvature(std::span<const Vec3> positions,
                                   std::span<const Triangle> triangles, double radius,
                                   std::uint64_t* steps) {
  const std::vector<std::uint32_t> place = weld_vertices(positions);
  std::vector<std::uint8_t> usable(triangles.size());
  parallel_for(triangles.size(), kGrainOfTriangles, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      usable[t] = has_area(positions, triangles[t]) ? 1 : 0;
    }
  });
  const Edges edges = find_edges(positions, triangles, place, usable);
  const BendTree tree(positions, triangles, usable, edges.angle);
  std::vector<double> result(positions.size(), 0.0);
  const std::vector<std::uint32_t> places = tree.places(place);
  std::atomic<std::uint64_t> all_steps{0};
  parallel_for((places.size() + kGroup - 1) / kGroup, kGrainOfSums / kGroup,
               [&](std::size_t begin, std::size_t end) {
                 BendTree::Room room;
                 for (std::size_t group = begin; group < end; ++group) {
                   const std::size_t first = group * kGroup;
                   const std::size_t count = std::min(kGroup, places.size() - first);
                   bend_at(tree, positions, std::span(places).subspan(first, count), edges.shortest,
                           radius, room, result);
                 }
                 all_steps += room.steps;
               });
  if (steps != nullptr) *steps = all_steps;
  for (std::size_t v = 0; v < result.size(); ++v) result[v] = result[place[v]];
  return result;
}

}  // namespace kiln
