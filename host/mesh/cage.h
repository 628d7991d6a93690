// Reads a cage mesh and pairs it with the low poly's triangles.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kiln/match.h"
#include "kiln/mesh.h"
#include "mesh/frame.h"

namespace kiln {

/// A closed mesh around the low poly, in the low poly's working frame.
struct CageHull {
  std::string name;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  /// Number of triangles of the low poly, which a cage with the same topology would have
  std::size_t low_triangles = 0;
  /// Why the mesh does not count as a copy of the low poly, if it resembles one; else empty
  std::string mismatch;
};

/// A cage mesh in the form that its CageKind requires. Positions are in the working frame, three per triangle of the
/// low poly.
struct CageCorners {
  CageKind kind = CageKind::offsets;
  std::vector<Vec3> outer_corners;       ///< Outer corners, for CageKind::offsets and shells
  std::vector<Vec3> inner_corners;       ///< Inner corners, for CageKind::shells
  std::shared_ptr<const CageHull> hull;  ///< The hull's mesh, for CageKind::hull
};

/// Classifies a cage mesh. If its triangles correspond to those of the low poly, in order and without splitting a
/// vertex, it is a cage of offsets. If it has twice as many triangles and both halves correspond, it consists of two
/// shells. Any other mesh is a hull.
///
/// Objects (or groups, if there are no objects) are paired by name, with or without suffixes such as _low and _cage. If
/// some have no partner, objects with equal numbers of triangles are paired by the distance of their bounding boxes. If
/// that is ambiguous, all are paired in order. Without names, triangles are paired in order. If many vertices then lie
/// far from their partners, components are paired by distance instead, provided that fewer vertices are far. Within an
/// object, polygons may be triangulated differently, if the vertices are those of the low poly, in the same order.
/// \throws Error(input) for an invalid mesh
CageCorners read_cage(const Mesh& low, const Mesh& cage, const Frame& frame);

}  // namespace kiln
