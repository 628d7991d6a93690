// Vertex normals in the field's way: corner normals weighted by the corner's angle.
#pragma once

#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Angle-weighted unit normals, one per vertex (Thürmer and Wüthrich 1998), summed in double
/// precision in triangle order, so that the result does not depend on threads. Degenerate and
/// non-finite triangles add nothing; a vertex without any gets (0, 0, 1).
std::vector<Vec3> vertex_normals(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles);

/// Normals per corner: the mesh's own where it has them (zero or non-finite ones replaced by the
/// computed ones), else vertex_normals. Returned as pool and indices.
struct CornerNormals {
  std::vector<Vec3> normals;
  std::vector<Triangle> triangles;
};
CornerNormals corner_normals(const Mesh& mesh, std::span<const Vec3> frame_positions);

/// One direction per vertex, equal for all corners that share a position (exactly equal position,
/// also where the file has split vertices): the angle-weighted average. Rays that leave along it
/// leave no gaps at hard edges.
std::vector<Vec3> continuous_directions(std::span<const Vec3> positions,
                                        std::span<const Triangle> triangles);

}  // namespace kiln
