#include "mesh/smoothing_groups.h"

#include <algorithm>
#include <array>
#include <vector>

#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"
#include "mesh/fan_normals.h"
#include "mesh/weld.h"

namespace kiln {

CornerNormals group_normals(const Mesh& mesh, std::span<const std::uint32_t> groups) {
  const std::vector<std::uint32_t> welded = weld_vertices(mesh.positions);
  // Key of a corner: its position, whether it is flat, and its group (or its polygon, if it is flat). Corners with
  // equal keys share a normal.
  using Key = std::array<std::uint32_t, 3>;
  std::vector<Key> keys(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const bool flat = groups[t] == kFlatGroup;
    const auto polygon = mesh.polygons.empty() ? static_cast<std::uint32_t>(t) : mesh.polygons[t];
    for (std::size_t k = 0; k < 3; ++k) {
      keys[3 * t + k] = {welded[mesh.triangles[t][k]], flat ? 1U : 0U, flat ? polygon : groups[t]};
    }
  }
  std::vector<Key> distinct_keys = keys;
  std::sort(distinct_keys.begin(), distinct_keys.end());
  distinct_keys.erase(std::unique(distinct_keys.begin(), distinct_keys.end()), distinct_keys.end());
  std::vector<Vec3> positions_of_keys;
  for (const Key& key : distinct_keys) positions_of_keys.push_back(mesh.positions[key[0]]);
  CornerNormals result;
  result.triangles.resize(mesh.triangles.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto at = std::lower_bound(distinct_keys.begin(), distinct_keys.end(), keys[i]) -
                    distinct_keys.begin();
    result.triangles[i / 3][i % 3] = static_cast<std::uint32_t>(at);
  }
  result.normals = vertex_normals(positions_of_keys, result.triangles, mesh.polygons);
  return result;
}

void give_group_normals(Mesh& mesh, std::span<const std::uint32_t> masks) {
  const FaceEdges faces = FaceEdges::of(mesh);
  const Creases creases = creases_between(mesh, faces, masks);
  mesh.normals.clear();
  mesh.normal_triangles.assign(mesh.triangles.size(), {});
  give_fan_normals(faces, creases, std::vector<bool>(mesh.triangles.size(), true), mesh);
}

}  // namespace kiln
