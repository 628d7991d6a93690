// Edges between a mesh's faces, with the angle between the faces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// An edge between two faces.
struct FaceEdge {
  /// The edge's side in both triangles, as 3 * triangle + corner; it runs from this corner to the next one.
  std::array<std::uint32_t, 2> sides{};
  float turn = 0;       ///< Angle between the faces' normals, 0 to 180 degrees
  bool convex = false;  ///< The faces bend away from their outside
  bool split = false;   ///< True if the faces have separate vertices of one position at an end
  bool inner = false;   ///< True within a polygon: both triangles belong to it
};

/// Edges of a mesh whose vertices are welded by exact position. Degenerate triangles have no edges. If more than two
/// faces share an edge, the pairs of the smallest angles are matched first. Sides of the same direction are no edge,
/// since their faces have opposite orientation.
struct FaceEdges {
  std::vector<Vec3> normals;          ///< Per triangle, its polygon's unit normal; zero: degenerate
  std::vector<float> areas;           ///< Area of each triangle
  std::vector<std::uint32_t> welded;  ///< Per vertex, its representative: see weld_vertices()
  std::vector<FaceEdge> edges;        ///< Sorted by the lower end of the first side
  std::vector<bool> borders;  ///< Per welded vertex: true at the ends of sides without a partner

  /// True if no edge turns by the smallest requested angle, so that `edges` was not built
  bool left_out = false;

  /// Linear time: about 0.3 processor seconds for a million triangles; 0.03 if `edges` is not built.
  /// \param least_degrees  skips `edges` if no edge turns by this angle or more; 0: never
  static FaceEdges of(const Mesh& mesh, double least_degrees = 0);
};

}  // namespace kiln
