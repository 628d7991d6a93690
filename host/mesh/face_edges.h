// Edges between a mesh's faces, with the angle by which the faces turn there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// An edge of two faces.
struct FaceEdge {
  /// The side in either triangle, as 3 * triangle + corner; it runs from this corner to the next one.
  std::array<std::uint32_t, 2> sides{};
  float turn = 0;       ///< Angle between the faces' normals, degrees, 0 to 180
  bool convex = false;  ///< The faces bend away from their outside
  bool split = false;   ///< At an end at least, the faces have vertices of their own at one place
  bool inner = false;   ///< Both triangles are of one polygon
};

/// Edges by exactly equal positions. A triangle without area has none. Where more than two faces meet, those that
/// turn least are paired first. Sides that run the same way in both faces are no edge, since the faces look opposite
/// ways.
struct FaceEdges {
  std::vector<Vec3>
      normals;  ///< Per triangle its polygon's unit normal; zero: the triangle has no area
  std::vector<float> areas;           ///< Per triangle
  std::vector<std::uint32_t> welded;  ///< Per vertex, see weld_vertices()
  std::vector<FaceEdge> edges;        ///< In order of their first side's lower end
  std::vector<bool> borders;          ///< Per welded vertex: a side without a partner ends there

  bool left_out = false;  ///< There is no edge that turns by the least angle: none was looked for

  /// Linear time: about 0.3 processor seconds for a million triangles, a tenth of it where edges are left out.
  /// \param least_degrees  if no edge turns by this or more, the edges are left out; 0: never
  static FaceEdges of(const Mesh& mesh, double least_degrees = 0);
};

}  // namespace kiln
