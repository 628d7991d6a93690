// Part of EdgeCollapser: builds the quadrics of vertices.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "mesh/vertex_lists.h"
#include "simplify/collapse.h"

namespace kiln {
namespace {

/// With a constraint: weight of the planes through open borders, which stand perpendicular to the surface, relative to
/// a triangle's own plane.
constexpr double kBorderWeight = 10;
/// Weight with which a vertex's previous quadric is added to its rebuilt quadric. Without it, each rebuild would
/// discard the error at thin rims, and the errors of all rebuilds would add up.
constexpr double kPreviousQuadricWeight = 0.1;
/// Weight of the perpendicular planes through lines between labels, relative to those through open borders. Planes are
/// weighted per mean edge length, so that a line counts like a strip as wide as a face. Otherwise areas with many lines
/// would keep too many faces.
constexpr double kLineWeight = 2;
/// An edge between triangles with two different labels, with one triangle of each label.
struct LabelLine {
  std::uint32_t a, b;
  std::array<std::uint32_t, 2> triangles;
};

/// All edges between triangles with different labels, and the lengths of these edges.
struct LabelLines {
  std::vector<LabelLine> lines;
  double length = 0, length_of_all = 0, edges = 0;

  void add(const std::vector<Vec3d>& points, const std::vector<std::uint32_t>& labels,
           std::uint32_t a, std::span<const SideLists::Item> edge_sides) {
    if (labels.empty()) return;
    const std::uint32_t b = SideLists::higher(edge_sides[0]);
    const double size = glm::length(points[b] - points[a]);
    length_of_all += size;
    ++edges;
    for (std::size_t i = 1; i < edge_sides.size(); ++i) {
      const std::uint32_t one = edge_sides[i - 1].index / 3, other = edge_sides[i].index / 3;
      if (labels[one] == labels[other]) continue;
      lines.push_back({a, b, {one, other}});
      length += size;
    }
  }
  double max_weight() const { return max_line_weight(length, length_of_all); }
};

/// Holds copies of the triangles of a mesh that have not been removed, and of their labels.
class LiveTriangles {
  std::vector<Triangle> live_triangles_;
  std::vector<std::uint32_t> live_labels_;

 public:
  const std::vector<Triangle>& triangles;
  const std::vector<std::uint32_t>& labels;
  explicit LiveTriangles(const CollapseMesh& mesh)
      : triangles(has_no_dead_triangles(mesh) ? mesh.triangles : live_triangles_),
        labels(has_no_dead_triangles(mesh) ? mesh.labels : live_labels_) {
    if (has_no_dead_triangles(mesh)) return;
    live_triangles_.reserve(mesh.faces);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (mesh.alive[t] == 0) continue;
      live_triangles_.push_back(mesh.triangles[t]);
      if (!mesh.labels.empty()) live_labels_.push_back(mesh.labels[t]);
    }
  }

 private:
  static bool has_no_dead_triangles(const CollapseMesh& mesh) {
    return mesh.faces == mesh.triangles.size();
  }
};

Vec3d normal_at(const std::vector<Vec3d>& points, const Triangle& v) {
  return cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
}

}  // namespace

/// Sets the planes that hold lines between labels: each plane contains a line and stands perpendicular to the surface,
/// with the line's length as its weight. Creases need no such planes, since the bound on the deviation of
/// samples already keeps the faces on both of their sides in place.
void EdgeCollapser::limit_line_error(double bound) {
  line_quadrics_.clear();
  max_line_error_ = bound;
  const LiveTriangles left(mesh_);
  if (left.labels.empty()) return;
  LabelLines label_lines;
  SideLists(left.triangles, mesh_.points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> edge_sides) {
        label_lines.add(mesh_.points, left.labels, a, edge_sides);
      });
  if (label_lines.lines.empty() || !(label_lines.max_weight() > 0)) return;
  line_quadrics_.resize(mesh_.points.size());
  for (const LabelLine& line : label_lines.lines) {
    const Quadric line_quadric =
        line_planes(mesh_.points[line.a], mesh_.points[line.b],
                    normal_at(mesh_.points, left.triangles[line.triangles[0]]),
                    normal_at(mesh_.points, left.triangles[line.triangles[1]]), 1);
    line_quadrics_[line.a] += line_quadric;
    line_quadrics_[line.b] += line_quadric;
  }
}

/// Computes values in parallel, in batches that fit in a cache, and passes the values to `give` in their order.
template <class Value, class Make, class Give>
void compute_in_batches(std::size_t count, const Make& make, const Give& give) {
  constexpr std::size_t kValuesPerBatch = std::size_t{1} << 15,
                        kValuesPerTask = std::size_t{1} << 13;
  std::vector<Value> batch_values(std::min(count, kValuesPerBatch));
  for (std::size_t first = 0; first < count; first += kValuesPerBatch) {
    const std::size_t part = std::min(kValuesPerBatch, count - first);
    // A mesh that is a piece of a larger one fits in a single batch. It is processed by one thread, because pieces
    // already run in parallel.
    parallel_for(part, count <= kValuesPerBatch ? kValuesPerBatch : kValuesPerTask,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t i = begin; i < end; ++i) batch_values[i] = make(first + i);
                 });
    for (std::size_t i = 0; i < part; ++i) give(first + i, batch_values[i]);
  }
}

/// Builds the quadrics of all vertices from the current triangles.
/// \returns all edges without duplicates, in the form that CollapseMesh::edges() returns
std::vector<std::uint64_t> EdgeCollapser::build_quadrics() {
  const std::vector<Vec3d>& points = mesh_.points;
  const LiveTriangles left(mesh_);
  const std::vector<Triangle>& triangles = left.triangles;
  for (Quadric& sum : quadrics_) sum *= kPreviousQuadricWeight;
  next_rebuild_ = std::bit_floor(std::max<std::size_t>(mesh_.faces, 1) - 1);
  const auto normal_of = [&](const Triangle& v) { return normal_at(points, v); };
  compute_in_batches<Quadric>(
      triangles.size(),
      [&](std::size_t t) {
        const Vec3d normal = normal_of(triangles[t]);
        const double size = length(normal);
        Quadric quadric;
        quadric.area = size / 6;  // Each corner gets a third of the triangle's area
        if (size > 0) quadric.add_plane(normal * (1 / size), points[triangles[t][0]], quadric.area);
        return quadric;
      },
      [&](std::size_t t, const Quadric& quadric) {
        for (const std::uint32_t vertex : triangles[t]) quadrics_[vertex] += quadric;
      });
  LabelLines label_lines;
  const SideLists triangle_sides(triangles, points.size());
  std::vector<std::uint64_t> edges;
  std::vector<std::span<const SideLists::Item>> sides_by_edge;
  edges.reserve(triangles.size() * 3 / 2 + 1);
  sides_by_edge.reserve(edges.capacity());
  triangle_sides.each_edge([&](std::uint32_t a, std::span<const SideLists::Item> edge_sides) {
    edges.push_back(std::uint64_t{a} << 32 | SideLists::higher(edge_sides[0]));
    sides_by_edge.push_back(edge_sides);
    label_lines.add(points, left.labels, a, edge_sides);
  });
  const auto ends_of = [&](std::size_t i) {
    return std::pair(static_cast<std::uint32_t>(edges[i] >> 32),
                     static_cast<std::uint32_t>(edges[i]));
  };
  compute_in_batches<Quadric>(
      edges.size(),
      [&](std::size_t i) {
        const std::span<const SideLists::Item> edge_sides = sides_by_edge[i];
        const auto [a, b] = ends_of(i);
        if (edge_sides.size() == 2 && rule_ == nullptr) {
          const auto opposite_corner = [&](const SideLists::Item& side) -> const Vec3d& {
            return points[triangles[side.index / 3][(side.index + 2) % 3]];
          };
          const bool forward = SideLists::forward(edge_sides[0]);
          return bent_planes(points[forward ? a : b], points[forward ? b : a],
                             opposite_corner(edge_sides[0]), opposite_corner(edge_sides[1]));
        }
        if (edge_sides.size() != 1) return Quadric();
        const Vec3d normal = normal_of(triangles[edge_sides[0].index / 3]);
        if (rule_ == nullptr) return border_planes(points[a], points[b], normal);
        const Vec3d edge = points[b] - points[a];
        return perpendicular_plane(points[a], points[b], normal,
                                   kBorderWeight * dot(edge, edge) / 2);
      },
      [&](std::size_t i, const Quadric& quadric) {
        const auto [a, b] = ends_of(i);
        if (sides_by_edge[i].size() == 1) {
          is_on_border_[a] = is_on_border_[b] = 1;
        } else if (sides_by_edge[i].size() != 2 || rule_ != nullptr) {
          return;
        }
        quadrics_[a] += quadric;
        quadrics_[b] += quadric;
      });
  if (label_lines.lines.empty()) return edges;
  const double share =
      kLineWeight * label_lines.length_of_all / label_lines.edges * label_lines.max_weight();
  for (const LabelLine& line : label_lines.lines) {
    const Vec3d &a = points[line.a], &b = points[line.b];
    const Quadric line_quadric = line_planes(a, b, normal_of(triangles[line.triangles[0]]),
                                             normal_of(triangles[line.triangles[1]]), share);
    quadrics_[line.a] += line_quadric;
    quadrics_[line.b] += line_quadric;
  }
  return edges;
}

}  // namespace kiln
