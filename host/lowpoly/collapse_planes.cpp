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

}  // namespace

void EdgeCollapser::build_quadrics() {
  const std::vector<Vec3d>& points = mesh_.points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> labels;
  triangles.reserve(mesh_.faces);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (mesh_.alive[t] == 0) continue;
    triangles.push_back(mesh_.triangles[t]);
    if (!mesh_.labels.empty()) labels.push_back(mesh_.labels[t]);
  }
  for (Quadric& sum : quadrics_) sum *= kMemory;
  next_renewal_ = std::bit_floor(std::max<std::size_t>(mesh_.faces, 1) - 1);
  const auto normal_of = [&](const Triangle& v) {
    return cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
  };
  for (const Triangle& v : triangles) {
    const Vec3d normal = normal_of(v);
    const double size = length(normal);
    Quadric quadric;
    quadric.area = size / 6;  // A third of the area for each corner.
    if (size > 0) quadric.add_plane(normal * (1 / size), points[v[0]], quadric.area);
    for (const std::uint32_t vertex : v) quadrics_[vertex] += quadric;
  }
  std::vector<LabelLine> lines;
  double length_of_all = 0, length_of_lines = 0, edges = 0;
  const SideLists sides(triangles, points.size());
  sides.each_edge([&](std::uint32_t a, std::span<const SideLists::Item> of_edge) {
    const std::uint32_t b = SideLists::higher(of_edge[0]);
    if (!labels.empty()) {
      const double size = length(points[b] - points[a]);
      length_of_all += size;
      ++edges;
      for (std::size_t i = 1; i < of_edge.size(); ++i) {
        const std::uint32_t one = of_edge[i - 1].index / 3, other = of_edge[i].index / 3;
        if (labels[one] == labels[other]) continue;
        lines.push_back({a, b, {one, other}});
        length_of_lines += size;
      }
    }
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
  if (lines.empty()) return;
  const double share =
      kLineWeight * length_of_all / edges * room_for_lines(length_of_lines, length_of_all);
  for (const LabelLine& line : lines) {
    const Vec3d &a = points[line.a], &b = points[line.b];
    const Quadric held = line_planes(a, b, normal_of(triangles[line.triangles[0]]),
                                     normal_of(triangles[line.triangles[1]]), share);
    quadrics_[line.a] += held;
    quadrics_[line.b] += held;
  }
}

}  // namespace kiln
