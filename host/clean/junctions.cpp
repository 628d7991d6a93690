// Repairs T-junctions: open edges on which vertices of other open edges lie.
#include <algorithm>
#include <limits>

#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Smallest piece of a split edge as a share of the edge's length, and number of rounds. In each round, a triangle is
/// split at one of its edges.
constexpr double kMinPieceShare = 0.02;
constexpr int kSplitRounds = 3;
/// A vertex with more open edges is not tested as a junction: sheets touch there, and testing all pairs of edges would
/// take quadratic time.
constexpr std::size_t kMaxOpenEdgesAtVertex = 256;

/// Open edges, which can be found by each of their two vertices.
class OpenEdges {
 public:
  OpenEdges(const Mesh& mesh, std::span<const Triangle> corners)
      : mesh_(mesh),
        triangles_(corners),
        open_sides_(open_sides(corners, mesh.positions.size())),
        sides_at_vertex_(
            mesh.positions.size(), 2 * open_sides_.size(),
            [&](std::size_t i) { return end_vertex(i); }, [](std::size_t i) { return i; }) {}

  const std::vector<std::uint32_t>& sides() const { return open_sides_; }

  /// The vertices that lie on a side, in order. They form a chain of other open edges from the side's first to its last
  /// vertex. Empty if there is no such chain.
  std::vector<VertexOnEdge> vertices_on_side(std::uint32_t side, double distance) const {
    const std::uint32_t a = vertex_of_side(side, 0), b = vertex_of_side(side, 1);
    const Vec3d from = point_of(mesh_, a), edge_vector = point_of(mesh_, b) - from;
    const double squared = dot(edge_vector, edge_vector);
    const double min_end_distance = std::min(distance, kMinPieceShare * std::sqrt(squared));
    std::vector<VertexOnEdge> found;
    std::uint32_t at = a;
    for (double share = 0;;) {
      VertexOnEdge next{b, 2};
      if (sides_at_vertex_.of(at).size() > kMaxOpenEdgesAtVertex) return {};
      for (const VertexLists::Item& item : sides_at_vertex_.of(at)) {
        const std::uint32_t other = open_sides_[item.index / 2];
        if (other / 3 == side / 3) continue;
        const std::uint32_t v = end_vertex(item.index ^ 1U);
        if (v == a || triangles_[side / 3][0] == v || triangles_[side / 3][1] == v ||
            triangles_[side / 3][2] == v) {
          if (v != b) continue;
        }
        const Vec3d to = point_of(mesh_, v) - from;
        const double s = v == b ? 1 : dot(to, edge_vector) / squared;
        if (!(s >= share + kMinPieceShare && s < next.share) || (v != b && s > 1 - kMinPieceShare))
          continue;
        if (v == b || length(to - edge_vector * s) <= min_end_distance) next = {v, s};
      }
      if (next.share > 1) return {};
      if (next.vertex == b) return found;
      found.push_back(next);
      at = next.vertex;
      share = next.share;
    }
  }

 private:
  std::uint32_t vertex_of_side(std::uint32_t side, std::uint32_t which) const {
    return triangles_[side / 3][(side + which) % 3];
  }
  std::uint32_t end_vertex(std::size_t i) const {
    return vertex_of_side(open_sides_[i / 2], i % 2);
  }

  const Mesh& mesh_;
  std::span<const Triangle> triangles_;
  std::vector<std::uint32_t> open_sides_;
  VertexLists sides_at_vertex_;
};

}  // namespace

Cleaned cut_at_junctions(Mesh& mesh, double distance) {
  Cleaned cut_edges;
  for (int round = 0; round < kSplitRounds; ++round) {
    const std::uint64_t cuts_before = cut_edges.count;
    const std::vector<Triangle> corners = welded_triangles(mesh);
    const OpenEdges open(mesh, corners);
    std::vector<std::uint8_t> was_split(corners.size(), 0);
    for (const std::uint32_t side : open.sides()) {
      const std::uint32_t t = side / 3;
      if (was_split[t] != 0) continue;
      const std::vector<VertexOnEdge> points = open.vertices_on_side(side, distance);
      if (points.empty()) continue;
      was_split[t] = 1;
      if (cut_edges.count++ == 0) cut_edges.example = mesh.positions[points[0].vertex];
      cut_triangle(mesh, t, side % 3, points);
    }
    if (cut_edges.count == cuts_before) break;
  }
  return cut_edges;
}

}  // namespace kiln
