// Finds UV seams on edges whose normals are smooth.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/formatted.h"
#include "kiln/normals.h"
#include "kiln/validate.h"
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr double kSameSeamCosine = 0.99996192306;  // Cosine of 0.5 degrees, as for hard edges

/// A triangle's side, identified by its welded vertices, a < b.
struct SeamSide {
  std::uint32_t a = 0, b = 0, triangle = 0;
  std::uint8_t at_a = 0, at_b = 0;  ///< Corners of the triangle at the two vertices
};

/// Two triangles that have a side in common.
struct SharedSide {
  SeamSide one, other;
  bool splits_uvs = false, hard = false;
};

struct Surface {
  explicit Surface(const Mesh& mesh)
      : welded(weld_vertices(mesh.positions)), normals(corner_normals(mesh, mesh.positions)) {
    weights.resize(mesh.triangles.size());
    corner_weights(mesh.positions, mesh.triangles, mesh.polygons, 0, mesh.triangles.size(),
                   weights.data());
  }

  const Vec3& normal(std::uint32_t triangle, std::size_t corner) const {
    return normals.normals[normals.triangles[triangle][corner]];
  }

  std::vector<std::uint32_t> welded;
  CornerNormals normals;
  std::vector<CornerWeights> weights;
};

bool same_normal(const Vec3& a, const Vec3& b) {
  return !(dot(to_double(a), to_double(b)) <
           kSameSeamCosine * length(to_double(a)) * length(to_double(b)));
}

bool corners_share_uv(const Mesh& mesh, std::uint32_t t, std::size_t i, std::uint32_t u,
                      std::size_t k) {
  const std::uint32_t a = mesh.uv_triangles[t][i], b = mesh.uv_triangles[u][k];
  return a == b || (mesh.uvs[a].x == mesh.uvs[b].x && mesh.uvs[a].y == mesh.uvs[b].y);
}

/// Pairs of adjacent triangles. At an edge of more than two triangles, each is paired with the first.
std::vector<SharedSide> shared_sides(const Mesh& mesh, const Surface& surface) {
  std::vector<SeamSide> seam_sides;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    // The triangle is degenerate or not finite
    if (length(surface.weights[t].normal) == 0) continue;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const auto next = static_cast<std::uint8_t>((k + 1) % 3);
      SeamSide side{surface.welded[mesh.triangles[t][k]], surface.welded[mesh.triangles[t][next]],
                    t, k, next};
      if (side.a > side.b) {
        std::swap(side.a, side.b);
        std::swap(side.at_a, side.at_b);
      }
      seam_sides.push_back(side);
    }
  }
  std::sort(seam_sides.begin(), seam_sides.end(), [](const SeamSide& x, const SeamSide& y) {
    return std::tie(x.a, x.b, x.triangle) < std::tie(y.a, y.b, y.triangle);
  });
  std::vector<SharedSide> shared_sides_found;
  for (std::size_t first = 0, i = 1; i < seam_sides.size(); ++i) {
    const SeamSide &one = seam_sides[first], &other = seam_sides[i];
    if (one.a != other.a || one.b != other.b) {
      first = i;
      continue;
    }
    SharedSide edge{one, other};
    const std::uint32_t t = one.triangle, u = other.triangle;
    edge.splits_uvs = !corners_share_uv(mesh, t, one.at_a, u, other.at_a) ||
                      !corners_share_uv(mesh, t, one.at_b, u, other.at_b);
    edge.hard = !same_normal(surface.normal(t, one.at_a), surface.normal(u, other.at_a)) ||
                !same_normal(surface.normal(t, one.at_b), surface.normal(u, other.at_b));
    shared_sides_found.push_back(edge);
  }
  return shared_sides_found;
}

double degrees_between(const Surface& surface, const SharedSide& edge) {
  const Vec3d &a = surface.weights[edge.one.triangle].normal,
              &b = surface.weights[edge.other.triangle].normal;
  return std::acos(std::clamp(dot(a, b) / (length(a) * length(b)), -1.0, 1.0)) * 180 /
         std::numbers::pi;
}

/// For each triangle, true if it has a neighbour in the same plane.
std::vector<bool> find_flat_triangles(const Mesh& mesh, const Surface& surface,
                                      const std::vector<SharedSide>& sides) {
  constexpr double kMaxFlatDegrees = 1;
  std::vector<bool> flat(mesh.triangles.size());
  for (const SharedSide& edge : sides) {
    if (degrees_between(surface, edge) >= kMaxFlatDegrees) continue;
    flat[edge.one.triangle] = flat[edge.other.triangle] = true;
  }
  return flat;
}

}  // namespace

SoftSeams soft_seams(const Mesh& mesh, double least_degrees) {
  if (!(least_degrees >= 0 && least_degrees <= 180)) {
    throw Error(ErrorCode::usage, "least_degrees is " + decimal(least_degrees) + ": use 0 to 180.");
  }
  validate(mesh);
  SoftSeams result;
  if (mesh.uv_triangles.empty()) return result;
  const Surface surface(mesh);
  const std::vector<SharedSide> smooth_seam_sides = shared_sides(mesh, surface);
  const std::vector<bool> flat = find_flat_triangles(mesh, surface, smooth_seam_sides);
  for (const SharedSide& edge : smooth_seam_sides) {
    if (!edge.splits_uvs) continue;
    ++result.seams;
    if (edge.hard) continue;
    const double degrees = degrees_between(surface, edge);
    if (degrees < least_degrees) continue;
    ++result.edges;
    const Vec3d a = to_double(mesh.positions[edge.one.a]),
                b = to_double(mesh.positions[edge.one.b]);
    result.length += length(b - a);
    const bool is_between_flats = flat[edge.one.triangle] && flat[edge.other.triangle];
    const bool is_first_example =
        is_between_flats ? ++result.between_flats == 1 : result.edges == 1;
    if (!is_first_example &&
        (degrees <= result.example_degrees || (!is_between_flats && result.between_flats > 0)))
      continue;
    result.example_degrees = degrees;
    result.example = to_float((a + b) * 0.5);
  }
  return result;
}

Mesh split_at_seams(const Mesh& mesh) {
  validate(mesh);
  if (mesh.uv_triangles.empty()) {
    throw Error(
        ErrorCode::input,
        "Mesh '" + mesh.name + "' has no UVs, so it has no seams to split: unwrap it first.");
  }
  const Surface surface(mesh);
  const std::vector<SharedSide> edges = shared_sides(mesh, surface);
  DisjointSets corners(3 * mesh.triangles.size());
  for (const SharedSide& edge : edges) {
    if (edge.splits_uvs) continue;
    const auto join = [&](std::uint8_t a, std::uint8_t b) {
      if (same_normal(surface.normal(edge.one.triangle, a), surface.normal(edge.other.triangle, b)))
        corners.join(3 * edge.one.triangle + a, 3 * edge.other.triangle + b);
    };
    join(edge.one.at_a, edge.other.at_a);
    join(edge.one.at_b, edge.other.at_b);
  }
  // 1 for each corner that is joined already
  std::vector<std::uint8_t> is_at_seam(3 * mesh.triangles.size());
  for (const SharedSide& edge : edges) {
    if (!edge.splits_uvs || edge.hard) continue;
    for (const SeamSide& side : {edge.one, edge.other}) {
      is_at_seam[corners.find(3 * side.triangle + side.at_a)] = 1;
      is_at_seam[corners.find(3 * side.triangle + side.at_b)] = 1;
    }
  }
  std::vector<Vec3d> sums(3 * mesh.triangles.size());
  std::vector<double> total_angles(sums.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t all = corners.find(3 * t + k);
      sums[all] += surface.weights[t].normal * surface.weights[t].angles[k];
      total_angles[all] += surface.weights[t].angles[k];
    }
  }
  Mesh result = mesh;
  result.tangents.clear();
  result.normals = surface.normals.normals;
  result.normal_triangles = surface.normals.triangles;
  // For each group of corners, the index of its normal plus 1; 0 if the group has no normal yet
  std::vector<std::uint32_t> normal_of_group(sums.size(), 0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t all = corners.find(3 * t + k);
      if (is_at_seam[all] == 0) continue;
      const Vec3 normal = normalized_sum(sums[all], total_angles[all]);
      if (!is_usable_normal(normal)) continue;
      if (normal_of_group[all] == 0) {
        result.normals.push_back(normal);
        normal_of_group[all] = static_cast<std::uint32_t>(result.normals.size());
      }
      result.normal_triangles[t][k] = normal_of_group[all] - 1;
    }
  }
  return result;
}

}  // namespace kiln
