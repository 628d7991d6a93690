#include "mesh/curvature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <tuple>
#include <vector>

#include "base/parallel.h"
#include "mesh/high_poly_normals.h"
#include "mesh/usable.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

// Limits for interpolation within a triangle: its longest edge over the radius, and the largest difference of the
// curvatures at its corners times the radius.
constexpr double kMaxEdgeShare = 1.0 / 4, kMaxCornerDifference = 1.0 / 256;
constexpr double kNotComputed = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kSumsPerTask = 256;
constexpr std::size_t kTrianglesPerTask = std::size_t{1} << 12;

Vec3d area_normal(std::span<const Vec3> positions, const Triangle& t) {
  const Vec3d first = to_double(positions[t[0]]);
  return cross(to_double(positions[t[1]]) - first, to_double(positions[t[2]]) - first);
}

/// Signed angle between the normals of two triangles, at the edge that they share.
/// \param edge_direction  direction of the edge in the first triangle
double angle_between(const Vec3d& normal, const Vec3d& other, const Vec3d& edge_direction) {
  // Adding +0 turns -0 into +0, so that faces folded back by 180 degrees count as convex.
  const double sine = dot(cross(normal, other), edge_direction) / length(edge_direction) + 0.0;
  return std::atan2(sine, dot(normal, other));
}

/// An edge of two triangles that traverse the edge in opposite directions.
struct EdgeJoint {
  /// For each triangle, the corner at which the edge starts: 3 * triangle + k
  std::array<std::uint32_t, 2> corner;
  double length;
  std::array<double, 2> height;  ///< Height of each triangle over the edge
  double angle;                  ///< Signed angle between the two triangles' normals
};

std::vector<std::uint8_t> find_usable(std::span<const Vec3> positions,
                                      std::span<const Triangle> triangles) {
  std::vector<std::uint8_t> is_usable(triangles.size());
  parallel_for(triangles.size(), kTrianglesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      is_usable[t] = has_area(positions, triangles[t]) ? 1 : 0;
    }
  });
  return is_usable;
}

/// Calls body(vertex, joint) once for each edge of two triangles, from several threads. The edges at one vertex come in
/// order, on one thread.
/// \param next_around_edge  [out] MeanCurvature::next_around_edge_, already sized; empty if it is not needed
template <typename Body>
void for_each_joint(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                    std::span<const std::uint8_t> is_usable,
                    std::span<std::uint32_t> next_around_edge, const Body& body) {
  const std::vector<std::uint32_t> welded = weld_vertices(positions);
  const Adjacency corners =
      Adjacency::make(positions.size(), triangles.size() * 3, [&](std::size_t i) {
        return is_usable[i / 3] != 0 ? std::size_t{welded[triangles[i / 3][i % 3]]}
                                     : positions.size();
      });
  struct Side {
    // `other`: position index of the edge's other end; `inward`: 0 if the side starts at the vertex, 1 if it ends
    // there; `corner`: corner at which the side starts
    std::uint32_t other, inward, corner;
    bool operator<(const Side& b) const {
      return std::tie(other, inward, corner) < std::tie(b.other, b.inward, b.corner);
    }
  };
  parallel_for(positions.size(), kSumsPerTask, [&](std::size_t begin, std::size_t end) {
    std::vector<Side> triangle_sides;
    for (std::size_t v = begin; v < end; ++v) {
      triangle_sides.clear();
      for (const std::uint32_t corner : corners.of(v)) {
        const Triangle& t = triangles[corner / 3];
        const std::uint32_t k = corner % 3;
        const std::uint32_t previous = corner - k + (k + 2) % 3;
        triangle_sides.push_back({welded[t[(k + 1) % 3]], 0, corner});
        triangle_sides.push_back({welded[t[(k + 2) % 3]], 1, previous});
      }
      std::sort(triangle_sides.begin(), triangle_sides.end());
      for (std::size_t i = 0; i < triangle_sides.size();) {
        std::size_t next = i + 1;
        while (next < triangle_sides.size() &&
               triangle_sides[next].other == triangle_sides[i].other)
          ++next;
        if (!next_around_edge.empty() && v < triangle_sides[i].other) {
          for (std::size_t k = i; k < next; ++k) {
            next_around_edge[triangle_sides[k].corner] =
                triangle_sides[k + 1 < next ? k + 1 : i].corner;
          }
        }
        const bool has_two_triangles =
            next - i == 2 && triangle_sides[i].inward == 0 && triangle_sides[i + 1].inward == 1;
        if (has_two_triangles && v < triangle_sides[i].other) {
          const Vec3d edge_direction =
              to_double(positions[triangle_sides[i].other]) - to_double(positions[v]);
          const std::uint32_t a = triangle_sides[i].corner, b = triangle_sides[i + 1].corner;
          const Vec3d n = area_normal(positions, triangles[a / 3]);
          const Vec3d m = area_normal(positions, triangles[b / 3]);
          const double edge_length = length(edge_direction);
          body(v, EdgeJoint{{a, b},
                            edge_length,
                            {length(n) / edge_length, length(m) / edge_length},
                            angle_between(n, m, edge_direction)});
        }
        i = next;
      }
    }
  });
}

/// For each triangle, the signed angles at its edges; edge k starts at corner k.
std::vector<std::array<float, 3>> find_angles(std::span<const Vec3> positions,
                                              std::span<const Triangle> triangles,
                                              std::span<const std::uint8_t> is_usable,
                                              std::span<std::uint32_t> next_around_edge) {
  std::vector<std::array<float, 3>> angles(triangles.size());
  for_each_joint(positions, triangles, is_usable, next_around_edge,
                 [&](std::size_t, const EdgeJoint& joint) {
                   for (const std::uint32_t c : joint.corner) {
                     angles[c / 3][c % 3] = static_cast<float>(joint.angle);
                   }
                 });
  return angles;
}

}  // namespace

double facet_size(std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  struct FacetSums {
    double weight = 0, size = 0;
  };
  std::vector<FacetSums> sums(
      positions.size());  // Edges by vertex, so that the order of sums does not depend on threads
  for_each_joint(positions, triangles, find_usable(positions, triangles), {},
                 [&](std::size_t vertex, const EdgeJoint& joint) {
                   if (std::abs(joint.angle) > 1 / kMinFacetsPerRadius) return;
                   const double weight = std::abs(joint.angle) * joint.length;
                   sums[vertex].weight += weight;
                   sums[vertex].size += weight * std::min(joint.height[0], joint.height[1]);
                 });
  FacetSums all;
  for (const FacetSums& chunk_sums : sums) {
    all.weight += chunk_sums.weight;
    all.size += chunk_sums.size;
  }
  return all.weight > 0 ? all.size / all.weight : 0;
}

MeanCurvature::MeanCurvature(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                             double radius)
    : positions_(positions),
      triangles_(triangles),
      radius_(radius),
      vertex_curvatures_(positions.size()) {
  const std::vector<std::uint8_t> is_usable = find_usable(positions, triangles);
  next_around_edge_.resize(3 * triangles.size());
  std::iota(next_around_edge_.begin(), next_around_edge_.end(), std::uint32_t{0});
  tree_.emplace(positions, triangles, is_usable,
                find_angles(positions, triangles, is_usable, next_around_edge_), radius);
  first_triangle_.resize(positions.size());
  for (std::size_t t = triangles.size(); t-- > 0;) {
    if (is_usable[t] == 0) continue;
    for (const std::uint32_t corner : triangles[t]) {
      first_triangle_[corner] = static_cast<std::uint32_t>(t);
    }
  }
  for (std::atomic<double>& curvature : vertex_curvatures_)
    curvature.store(kNotComputed, std::memory_order_relaxed);
}

double MeanCurvature::at(const Vec3d& point, Scratch& scratch) const {
  const BendSums sums = tree_->within(point, scratch);
  return sums.area > 0 ? sums.bend / sums.area : 0;
}

/// Finds the triangles that are connected with the point's triangle over edges within the ball.
/// \returns false if there are too many
bool MeanCurvature::find_connected(const Vec3d& point, std::uint32_t triangle,
                                   Scratch& scratch) const {
  TriangleSet& connected = scratch.connected;
  std::vector<std::uint32_t>& connected_list = scratch.connected_list;
  connected.clear();
  connected.add(triangle);
  connected_list.assign(1, triangle);
  for (std::size_t i = 0; i < connected_list.size(); ++i) {
    const std::uint32_t t = connected_list[i];
    ++scratch.steps;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Vec3d a = to_double(positions_[triangles_[t][k]]) - point;
      const Vec3d edge_direction = to_double(positions_[triangles_[t][(k + 1) % 3]]) - point - a;
      const double along =
          std::clamp(-dot(a, edge_direction) / dot(edge_direction, edge_direction), 0.0, 1.0);
      const Vec3d near = a + edge_direction * along;
      if (!(dot(near, near) < radius_ * radius_)) continue;
      for (std::uint32_t c = next_around_edge_[3 * t + k]; c != 3 * t + k;
           c = next_around_edge_[c]) {
        if (connected.contains(c / 3)) continue;
        if (connected.full()) return false;
        connected.add(c / 3);
        connected_list.push_back(c / 3);
      }
    }
  }
  return true;
}

/// Curvature of a triangle's sheet at a point of the triangle.
double MeanCurvature::curvature_on_sheet(const Vec3d& point, std::uint32_t triangle,
                                         Scratch& scratch) const {
  const Vec3d normal = area_normal(positions_, triangles_[triangle]);
  const double size = length(normal);
  if (!(size > 0)) return at(point, scratch);
  Sheet sheet{normal * (1 / size)};
  if (!tree_->may_hold_opposed(point, sheet, scratch)) return at(point, scratch);
  if (find_connected(point, triangle, scratch)) sheet.connected = &scratch.connected;
  const BendSums sums = tree_->within(point, sheet, scratch);
  return sums.area > 0 ? sums.bend / sums.area : 0;
}

/// Thread-safe without a lock: threads that compute the value of a vertex at the same time get the same value.
double MeanCurvature::curvature_at_vertex(std::uint32_t vertex, Scratch& scratch) const {
  std::atomic<double>& cached = vertex_curvatures_[vertex];
  double curvature = cached.load(std::memory_order_relaxed);
  if (std::isnan(curvature)) {
    curvature = curvature_on_sheet(to_double(positions_[vertex]), first_triangle_[vertex], scratch);
    cached.store(curvature, std::memory_order_relaxed);
  }
  return curvature;
}

double MeanCurvature::on(std::uint32_t triangle, double u, double v, Scratch& scratch) const {
  const Triangle& t = triangles_[triangle];
  const std::array<Vec3d, 3> p = {to_double(positions_[t[0]]), to_double(positions_[t[1]]),
                                  to_double(positions_[t[2]])};
  const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
  if (longest <= radius_ * kMaxEdgeShare) {
    const double a = curvature_at_vertex(t[0], scratch), b = curvature_at_vertex(t[1], scratch),
                 c = curvature_at_vertex(t[2], scratch);
    if (std::max({a, b, c}) - std::min({a, b, c}) <= kMaxCornerDifference / radius_) {
      return a + (b - a) * u + (c - a) * v;
    }
  }
  return curvature_on_sheet(p[0] * (1.0 - u - v) + p[1] * u + p[2] * v, triangle, scratch);
}

}  // namespace kiln
