#include "mesh/face_edges.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/parallel.h"
#include "mesh/high_poly_normals.h"
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr std::size_t kTrianglesPerEdgeTask = 1 << 14;
constexpr std::size_t kVerticesPerEdgeTask = 1 << 12;

/// A triangle's side, identified by its two vertices.
struct EdgeSide {
  std::uint32_t high = 0;        ///< Higher vertex of the edge
  std::uint32_t at = 0;          ///< Corner at which the side starts, as 3 * triangle + corner
  bool starts_at_lower = false;  ///< True if the side starts at the lower vertex
};

float degrees_between(const Vec3& a, const Vec3& b) {
  const Vec3d x = to_double(a), y = to_double(b);
  return static_cast<float>(std::atan2(length(cross(x, y)), dot(x, y)) * 180 / std::numbers::pi);
}

/// Normal of a triangle, with twice the triangle's area as its length.
Vec3d area_vector(const Mesh& mesh, std::size_t triangle) {
  const Triangle& at = mesh.triangles[triangle];
  const Vec3d corner = to_double(mesh.positions[at[0]]);
  return cross(to_double(mesh.positions[at[1]]) - corner,
               to_double(mesh.positions[at[2]]) - corner);
}

class EdgeFinder {
 public:
  EdgeFinder(const Mesh& mesh, FaceEdges& result) : mesh_(mesh), result_(result) {}

  /// Finds the edges of a vertex, and its sides without a partner. Each edge belongs to its lower vertex.
  /// \param sides  [in, out] all sides whose lower vertex this is; sorted
  void add(std::uint32_t vertex, std::vector<EdgeSide>& sides, std::vector<FaceEdge>& edges,
           std::vector<std::uint32_t>& unpaired_vertices) const {
    std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
      return std::tie(a.high, a.at) < std::tie(b.high, b.at);
    });
    for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
      while (end < sides.size() && sides[end].high == sides[begin].high) ++end;
      const std::span<const EdgeSide> run(&sides[begin], end - begin);
      if (run.size() == 2 && run[0].starts_at_lower != run[1].starts_at_lower) {
        edges.push_back(edge(run[0], run[1]));
        continue;
      }
      unpaired_vertices.insert(unpaired_vertices.end(), {vertex, run[0].high});
      if (run.size() > 2 && run.size() <= kMaxFacesPerEdge) pair(run, edges);
    }
  }

 private:
  /// An edge with more faces counts as hard, since the number of its pairs of faces is quadratic.
  static constexpr std::size_t kMaxFacesPerEdge = 16;

  FaceEdge edge(const EdgeSide& a, const EdgeSide& b) const {
    FaceEdge result;
    result.sides = {a.at, b.at};
    const auto corner = [&](const EdgeSide& side, std::size_t k) {
      return mesh_.triangles[side.at / 3][(side.at % 3 + k) % 3];
    };
    const Vec3 &m = result_.normals[a.at / 3], &n = result_.normals[b.at / 3];
    result.degrees = degrees_between(m, n);
    const Vec3d across =
        to_double(mesh_.positions[corner(b, 2)]) - to_double(mesh_.positions[corner(a, 0)]);
    result.convex = dot(across, to_double(m)) < 0;
    result.split = corner(a, 0) != corner(b, 1) || corner(a, 1) != corner(b, 0);
    result.inner = !mesh_.polygons.empty() && mesh_.polygons[a.at / 3] == mesh_.polygons[b.at / 3];
    return result;
  }

  void pair(std::span<const EdgeSide> run, std::vector<FaceEdge>& edges) const {
    std::vector<FaceEdge> all;
    for (const EdgeSide& a : run) {
      for (const EdgeSide& b : run) {
        if (a.starts_at_lower && !b.starts_at_lower) all.push_back(edge(a, b));
      }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const FaceEdge& a, const FaceEdge& b) { return a.degrees < b.degrees; });
    std::vector<std::uint32_t> used;
    for (const FaceEdge& edge : all) {
      const auto is_taken = [&](std::uint32_t side) {
        return std::find(used.begin(), used.end(), side) != used.end();
      };
      if (is_taken(edge.sides[0]) || is_taken(edge.sides[1])) continue;
      used.insert(used.end(), edge.sides.begin(), edge.sides.end());
      edges.push_back(edge);
    }
  }

  const Mesh& mesh_;
  const FaceEdges& result_;
};

}  // namespace

namespace {

/// True if an edge may have an angle of `degrees` or more; false if certainly none has. At such an edge, the normal of
/// one of the two faces deviates from any given direction, such as the mean of all normals, by at least half of the
/// angle.
bool may_have_angle(const Mesh& mesh, const FaceEdges& faces, double degrees) {
  std::vector<Vec3> sums(mesh.positions.size());
  for_each_polling(mesh.triangles.size(), [&](std::size_t t) {
    const Vec3& n = faces.normals[t];
    for (const std::uint32_t v : mesh.triangles[t]) {
      Vec3& sum = sums[faces.welded[v]];
      sum = {sum.x + n.x, sum.y + n.y, sum.z + n.z};
    }
  });
  // 1e-5 is a margin for rounding.
  const double min_cosine = std::cos(degrees / 2 * std::numbers::pi / 180) + 1e-5;
  std::atomic<bool> has_angle = false;
  parallel_for(mesh.triangles.size(), kTrianglesPerEdgeTask,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t t = begin; t < end && !has_angle; ++t) {
                   const Vec3d n = to_double(faces.normals[t]);
                   if (faces.normals[t] == Vec3{}) continue;
                   for (const std::uint32_t v : mesh.triangles[t]) {
                     const Vec3d sum = to_double(sums[faces.welded[v]]);
                     if (dot(n, sum) < min_cosine * length(sum) || !(length(sum) > 0))
                       has_angle = true;
                   }
                 }
               });
  return has_angle;
}

}  // namespace

FaceEdges FaceEdges::of(const Mesh& mesh, double least_degrees) {
  FaceEdges result;
  const std::size_t triangles = mesh.triangles.size();
  result.welded = weld_vertices(mesh.positions);
  result.normals.resize(triangles);
  result.areas.resize(triangles);
  parallel_for(triangles, kTrianglesPerEdgeTask, [&](std::size_t begin, std::size_t end) {
    std::vector<CornerWeights> polygon_weights;
    for (std::size_t t = begin; t < end; ++t) {
      // A polygon is processed by the thread whose range contains the polygon's first triangle.
      const bool polygons = !mesh.polygons.empty();
      if (polygons && t > 0 && mesh.polygons[t] == mesh.polygons[t - 1]) continue;
      std::size_t last = t + 1;
      while (polygons && last < triangles && mesh.polygons[last] == mesh.polygons[t]) ++last;
      polygon_weights.assign(last - t, {});
      if (polygons) {
        corner_weights(mesh.positions, mesh.triangles, mesh.polygons, t, t + 1,
                       polygon_weights.data());
      }
      for (std::size_t i = t; i < last; ++i) {
        const Vec3d doubled_normal = area_vector(mesh, i);
        const double size = length(doubled_normal);
        if (!(size > 0) || !std::isfinite(size)) continue;
        result.normals[i] =
            to_float(polygons ? polygon_weights[i - t].normal : doubled_normal * (1 / size));
        result.areas[i] = static_cast<float>(size / 2);
      }
    }
  });
  if (least_degrees > 0 && !may_have_angle(mesh, result, least_degrees)) {
    result.left_out = true;
    return result;
  }
  const auto ends = [&](std::size_t side) {
    const Triangle& at = mesh.triangles[side / 3];
    return std::pair(result.welded[at[side % 3]], result.welded[at[(side + 1) % 3]]);
  };
  const Adjacency by_vertex =
      Adjacency::make(mesh.positions.size(), 3 * triangles, [&](std::size_t side) -> std::size_t {
        if (result.normals[side / 3] == Vec3{}) return mesh.positions.size();
        const auto [a, b] = ends(side);
        return a == b ? mesh.positions.size() : std::min(a, b);
      });
  const std::size_t pieces =
      (mesh.positions.size() + kVerticesPerEdgeTask - 1) / kVerticesPerEdgeTask;
  struct PieceEdges {
    std::vector<FaceEdge> edges;
    std::vector<std::uint32_t> unpaired_vertices;
  };
  std::vector<PieceEdges> found_edges(pieces);
  const EdgeFinder edge_finder(mesh, result);
  parallel_for(pieces, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<EdgeSide> sides;
    for (std::size_t piece = begin; piece < end; ++piece) {
      const std::size_t end_vertex =
          std::min((piece + 1) * kVerticesPerEdgeTask, mesh.positions.size());
      for (std::size_t v = piece * kVerticesPerEdgeTask; v < end_vertex; ++v) {
        sides.clear();
        for (const std::uint32_t side : by_vertex.of(v)) {
          const auto [a, b] = ends(side);
          sides.push_back({std::max(a, b), side, a < b});
        }
        edge_finder.add(static_cast<std::uint32_t>(v), sides, found_edges[piece].edges,
                        found_edges[piece].unpaired_vertices);
      }
    }
  });
  std::size_t count = 0;
  for (const PieceEdges& piece : found_edges) count += piece.edges.size();
  result.edges.reserve(count);
  result.borders.resize(mesh.positions.size());
  for (PieceEdges& piece : found_edges) {
    result.edges.insert(result.edges.end(), piece.edges.begin(), piece.edges.end());
    for (const std::uint32_t vertex : piece.unpaired_vertices) result.borders[vertex] = true;
    piece = {};
  }
  return result;
}

}  // namespace kiln
