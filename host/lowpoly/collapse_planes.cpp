// The planes that hold a mesh in place while its edges collapse.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "lowpoly/collapse.h"
#include "mesh/vertex_lists.h"

namespace kiln {
namespace {

/// Under a rule, weight of the planes that stand on open borders, against a triangle's own.
constexpr double kBorderWeight = 10;
/// Weight of the sum of planes so far beside planes of the mesh as it is. Without it, what a thin rim has lost is
/// forgotten, and it loses more.
constexpr double kMemory = 0.1;
/// Weight of the planes that stand on lines between labels, against those on open borders, for each unit of an edge's
/// mean length: a line is as wide as a face. So steps of dense lines do not hold what few faces are left.
constexpr double kLineWeight = 2;
/// An edge between two labels, with a triangle of each.
struct LabelLine {
  std::uint32_t a, b;
  std::array<std::uint32_t, 2> triangles;
};

/// All of them.
struct LabelLines {
  std::vector<LabelLine> lines;
  double length = 0, length_of_all = 0, edges = 0;

  void add(const std::vector<Vec3d>& points, const std::vector<std::uint32_t>& labels,
           std::uint32_t a, std::span<const SideLists::Item> of_edge) {
    if (labels.empty()) return;
    const std::uint32_t b = SideLists::higher(of_edge[0]);
    const double size = kiln::length(points[b] - points[a]);
    length_of_all += size;
    ++edges;
    for (std::size_t i = 1; i < of_edge.size(); ++i) {
      const std::uint32_t one = of_edge[i - 1].index / 3, other = of_edge[i].index / 3;
      if (labels[one] == labels[other]) continue;
      lines.push_back({a, b, {one, other}});
      length += size;
    }
  }
  double room() const { return room_for_lines(length, length_of_all); }
};

/// The triangles that are left, and their labels.
struct Left {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> labels;
  explicit Left(const CollapseMesh& mesh) {
    triangles.reserve(mesh.faces);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (mesh.alive[t] == 0) continue;
      triangles.push_back(mesh.triangles[t]);
      if (!mesh.labels.empty()) labels.push_back(mesh.labels[t]);
    }
  }
};

Vec3d normal_at(const std::vector<Vec3d>& points, const Triangle& v) {
  return cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
}

}  // namespace

/// Planes on each line, by its length. A crease is held by its faces, whose samples have a bound.
void EdgeCollapser::bound_lines(double bound) {
  lines_.clear();
  lines_bound_ = bound;
  const Left left(mesh_);
  if (left.labels.empty()) return;
  LabelLines found;
  SideLists(left.triangles, mesh_.points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> of_edge) {
        found.add(mesh_.points, left.labels, a, of_edge);
      });
  if (found.lines.empty() || !(found.room() > 0)) return;
  lines_.resize(mesh_.points.size());
  for (const LabelLine& line : found.lines) {
    const Quadric held = line_planes(mesh_.points[line.a], mesh_.points[line.b],
                                     normal_at(mesh_.points, left.triangles[line.triangles[0]]),
                                     normal_at(mesh_.points, left.triangles[line.triangles[1]]), 1);
    lines_[line.a] += held;
    lines_[line.b] += held;
  }
}

void EdgeCollapser::build_quadrics() {
  const std::vector<Vec3d>& points = mesh_.points;
  const Left left(mesh_);
  const std::vector<Triangle>& triangles = left.triangles;
  for (Quadric& sum : quadrics_) sum *= kMemory;
  next_renewal_ = std::bit_floor(std::max<std::size_t>(mesh_.faces, 1) - 1);
  const auto normal_of = [&](const Triangle& v) { return normal_at(points, v); };
  for (const Triangle& v : triangles) {
    const Vec3d normal = normal_of(v);
    const double size = length(normal);
    Quadric quadric;
    quadric.area = size / 6;  // A third of the area for each corner.
    if (size > 0) quadric.add_plane(normal * (1 / size), points[v[0]], quadric.area);
    for (const std::uint32_t vertex : v) quadrics_[vertex] += quadric;
  }
  LabelLines found;
  const SideLists sides(triangles, points.size());
  sides.each_edge([&](std::uint32_t a, std::span<const SideLists::Item> of_edge) {
    const std::uint32_t b = SideLists::higher(of_edge[0]);
    found.add(points, left.labels, a, of_edge);
    if (of_edge.size() == 2 && rule_ == nullptr) {
      const auto far = [&](const SideLists::Item& side) -> const Vec3d& {
        return points[triangles[side.index / 3][(side.index + 2) % 3]];
      };
      const auto [from, to] = SideLists::forward(of_edge[0]) ? std::pair(a, b) : std::pair(b, a);
      const Quadric bent = bent_planes(points[from], points[to], far(of_edge[0]), far(of_edge[1]));
      quadrics_[a] += bent;
      quadrics_[b] += bent;
    }
    if (of_edge.size() != 1) return;
    border_[a] = border_[b] = 1;
    const Triangle& v = triangles[of_edge[0].index / 3];
    const Vec3d edge = points[b] - points[a];
    const Quadric border = rule_ == nullptr ? border_planes(points[a], points[b], normal_of(v))
                                            : standing_plane(points[a], points[b], normal_of(v),
                                                             kBorderWeight * dot(edge, edge) / 2);
    quadrics_[a] += border;
    quadrics_[b] += border;
  });
  if (found.lines.empty()) return;
  const double share = kLineWeight * found.length_of_all / found.edges * found.room();
  for (const LabelLine& line : found.lines) {
    const Vec3d &a = points[line.a], &b = points[line.b];
    const Quadric held = line_planes(a, b, normal_of(triangles[line.triangles[0]]),
                                     normal_of(triangles[line.triangles[1]]), share);
    quadrics_[line.a] += held;
    quadrics_[line.b] += held;
  }
}

}  // namespace kiln
