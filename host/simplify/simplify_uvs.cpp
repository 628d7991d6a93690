#include "simplify/simplify_uvs.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "base/counted.h"
#include "mesh/surface_distance.h"
#include "mesh/uv_grid.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// A vertex and UV index without a finite UV, although other corners of the triangles that use it have finite UVs.
struct CornerWithoutUv {
  double u = 0, v = 0, count = 0;  ///< Sum and number of the finite UVs of its triangles
  /// The UV that the chart has at this vertex in an adjacent triangle; kNone if there is no such UV
  std::uint32_t given = kNone;

  Vec2 mean() const { return {static_cast<float>(u / count), static_cast<float>(v / count)}; }
};

/// Corners without a finite UV, by vertex and UV index.
using CornersWithoutUv = std::map<std::array<std::uint32_t, 2>, CornerWithoutUv>;

/// Number of a triangle's corners without a finite UV.
int corners_without_uv(const Mesh& mesh, std::size_t t) {
  const Triangle& uv = mesh.uv_triangles[t];
  return static_cast<int>(std::count_if(uv.begin(), uv.end(),
                                        [&](std::uint32_t v) { return !is_finite(mesh.uvs[v]); }));
}

/// True if two triangles share a vertex other than `at` with the same finite UV there. They then belong to one chart.
bool continues_chart(const Mesh& mesh, std::size_t t, std::size_t other, std::uint32_t at) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t vertex = mesh.triangles[t][i], uv = mesh.uv_triangles[t][i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (vertex != at && mesh.triangles[other][k] == vertex && mesh.uv_triangles[other][k] == uv &&
          is_finite(mesh.uvs[uv])) {
        return true;
      }
    }
  }
  return false;
}

CornersWithoutUv find_corners_without_uv(const Mesh& mesh,
                                         std::span<const std::uint32_t> partial_triangles) {
  CornersWithoutUv found;
  // For each vertex, the triangles that have no finite UV at it
  std::map<std::uint32_t, std::vector<std::uint32_t>> at;
  for (const std::uint32_t t : partial_triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh.triangles[t][k], uv = mesh.uv_triangles[t][k];
      if (is_finite(mesh.uvs[uv])) continue;
      at[vertex].push_back(t);
      CornerWithoutUv& corner = found[{vertex, uv}];
      for (const std::uint32_t from : mesh.uv_triangles[t]) {
        const Vec2& other = mesh.uvs[from];
        if (is_finite(other)) corner.u += other.x, corner.v += other.y, corner.count += 1;
      }
    }
  }
  for (std::uint32_t s = 0; s < mesh.triangles.size(); ++s) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto incomplete_corner = at.find(mesh.triangles[s][k]);
      if (incomplete_corner == at.end() || !is_finite(mesh.uvs[mesh.uv_triangles[s][k]])) continue;
      for (const std::uint32_t t : incomplete_corner->second) {
        if (!continues_chart(mesh, t, s, incomplete_corner->first)) continue;
        const auto corner_position =
            std::find(mesh.triangles[t].begin(), mesh.triangles[t].end(), incomplete_corner->first);
        const std::uint32_t uv_to_replace = mesh.uv_triangles[t][static_cast<std::size_t>(
            corner_position - mesh.triangles[t].begin())];
        const auto corner = found.find({incomplete_corner->first, uv_to_replace});
        if (corner != found.end() && corner->second.given == kNone)
          corner->second.given = mesh.uv_triangles[s][k];
      }
    }
  }
  return found;
}

}  // namespace

std::optional<Mesh> with_finite_uvs(const Mesh& mesh, std::vector<Warning>& warnings) {
  std::vector<std::uint32_t> partial_triangles;
  for (std::uint32_t t = 0; t < mesh.uv_triangles.size(); ++t) {
    const int missing_count = corners_without_uv(mesh, t);
    if (missing_count == 1 || missing_count == 2) partial_triangles.push_back(t);
  }
  if (partial_triangles.empty()) return std::nullopt;
  const std::size_t repaired_count = partial_triangles.size();
  warnings.push_back(
      {"non-finite-uvs",
       counted(repaired_count, "triangle") + (repaired_count == 1 ? " has" : " have") +
           " a corner with a missing or non-finite UV, which was replaced by the UV of "
           "adjacent triangles there, or by the mean of the other UVs of its triangle",
       repaired_count});
  Mesh result = mesh;
  CornersWithoutUv corners = find_corners_without_uv(mesh, partial_triangles);
  for (auto& [key, corner] : corners) {
    if (corner.given != kNone) continue;
    corner.given = static_cast<std::uint32_t>(result.uvs.size());
    result.uvs.push_back(corner.mean());
  }
  for (const std::uint32_t t : partial_triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& uv = result.uv_triangles[t][k];
      if (!is_finite(mesh.uvs[uv])) uv = corners.at({mesh.triangles[t][k], uv}).given;
    }
  }
  return result;
}

std::uint64_t count_outside(const Mesh& mesh) {
  std::uint64_t count = 0;
  for (std::size_t t = 0; t < mesh.uv_triangles.size(); ++t) {
    const Triangle& corners = mesh.uv_triangles[t];
    count += corners_without_uv(mesh, t) == 0 &&
             std::any_of(corners.begin(), corners.end(), [&](std::uint32_t v) {
               const Vec2& uv = mesh.uvs[v];
               return uv.x < 0 || uv.x > 1 || uv.y < 0 || uv.y > 1;
             });
  }
  return count;
}

namespace {

/// The UV triangles of a mesh in the plane z = 0, without duplicates. A search would otherwise visit thousands of
/// copies at one place, whose distances only differ by rounding.
struct UvTriangles {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  explicit UvTriangles(const Mesh& mesh) {
    for (const Vec2& uv : mesh.uvs) positions.push_back({uv.x, uv.y, 0});
    std::set<std::array<std::pair<float, float>, 3>> known;
    for (std::size_t t = 0; t < mesh.uv_triangles.size(); ++t) {
      if (corners_without_uv(mesh, t) != 0) continue;
      const Triangle& corners = mesh.uv_triangles[t];
      const auto uv = [&](std::size_t k) {
        return std::pair(mesh.uvs[corners[k]].x, mesh.uvs[corners[k]].y);
      };
      if (known.insert({uv(0), uv(1), uv(2)}).second) triangles.push_back(corners);
    }
  }
};

}  // namespace

double uv_deviation(const Mesh& low, const Mesh& high) {
  const UvTriangles from(low), to(high);
  if (from.triangles.empty() || to.triangles.empty()) return 0;
  return low_to_high_distance(SurfaceDistance(to.positions, to.triangles), from.positions,
                              from.triangles)
      .largest;
}

}  // namespace kiln
