// A cage mesh as the low poly's triangles take it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kiln/match.h"
#include "kiln/mesh.h"
#include "mesh/frame.h"

namespace kiln {

/// Any closed mesh around the low poly, in its frame.
struct CageHull {
  std::string name;
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  std::size_t low_triangles = 0;  ///< Triangles that a copy of the low poly would have
  std::string
      misfit;  ///< In words, why it is no copy of the low poly though it seems to be; or empty
};

/// See CageKind. Positions are in the frame, three a triangle of the low poly.
struct CageCorners {
  CageKind kind = CageKind::offsets;
  std::vector<Vec3> outer;               ///< Set for CageKind::offsets and shells
  std::vector<Vec3> inner;               ///< Set for CageKind::shells
  std::shared_ptr<const CageHull> hull;  ///< Set for CageKind::hull
};

/// A mesh whose triangles are those of the low poly, in order and with no vertex torn apart, has offsets; one
/// with twice as many has shells where both halves are so; any other is a hull. Objects, or else groups, of the
/// two meshes pair by their names, with or without endings such as _low and _cage. Where not all do, those of as
/// many triangles pair whose boxes have the nearest corners; where that is not clear, all are taken in order.
/// Without names all are taken in order, too, unless vertices then lie far from those that they stand for, and parts
/// that share no vertex pair by their places so that fewer do.
/// In a piece, faces may be cut otherwise where its vertices are those of the low poly in order.
/// \throws Error(input) for a mesh that is no mesh
CageCorners read_cage(const Mesh& low, const Mesh& cage, const Frame& frame);

}  // namespace kiln
