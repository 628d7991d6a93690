// The edges between a mesh's faces, with the angle between the normals of both faces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// An edge between two faces.
struct FaceEdge {
  /// The side of each of the two triangles at the edge, as 3 * triangle + corner; a side runs from this corner to the
  /// next
  std::array<std::uint32_t, 2> sides{};
  float degrees = 0;    ///< Angle between the faces' normals, 0 to 180 degrees
  bool convex = false;  ///< True if the edge is convex
  /// True if the faces have separate vertices, at the same position, at one end of the edge or at both
  bool split = false;
  bool inner = false;  ///< True if both triangles belong to one polygon
};

/// The edges of a mesh whose vertices are welded by exact position. Degenerate triangles have no edges. If more than
/// two faces share an edge, the pairs with the smallest angles are matched first. Two sides in the same direction form
/// no edge, since their faces have opposite orientation.
struct FaceEdges {
  /// For each triangle, the unit normal of its polygon; zero if it is degenerate
  std::vector<Vec3> normals;
  std::vector<float> areas;           ///< Area of each triangle
  std::vector<std::uint32_t> welded;  ///< Representative of each vertex, see weld_vertices()
  std::vector<FaceEdge> edges;        ///< Edges, sorted by the lower vertex of the first side
  std::vector<bool> borders;          ///< For each welded vertex, true if it lies on an open border

  /// True if no edge has the requested smallest angle, so that `edges` was not built
  bool left_out = false;

  /// Finds the edges in linear time: about 0.3 processor seconds for a million triangles; 0.03 if `edges` is not built.
  /// \param least_degrees  `edges` is not built if no edge has at least this angle; with 0, it is always built
  static FaceEdges of(const Mesh& mesh, double least_degrees = 0);
};

}  // namespace kiln
