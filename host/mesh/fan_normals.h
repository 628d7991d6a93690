// Normals that are shared across smooth edges and split at hard ones.
#pragma once

#include <vector>

#include "kiln/mesh.h"
#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"

namespace kiln {

/// Computes corner normals that are shared across smooth edges: weighted by angles, and summed in triangle order. In
/// parts without hard edges, all corners at a position share one normal.
///
/// At the border between a plane and a rounded edge, the normal is the plane's: a planar region of several triangles
/// keeps its own normal at each vertex whose other faces have less than a quarter of the region's area. At sharp tips
/// (of cones), where a shared normal would deviate far from its faces, each face has its own normal.
/// \param triangles  true for each triangle that gets normals; the others keep theirs
/// \param mesh  [in, out] the mesh that `faces` was made from; its normal_triangles are parallel to its triangles
void give_fan_normals(const FaceEdges& faces, const Creases& creases,
                      const std::vector<bool>& triangles, Mesh& mesh);

}  // namespace kiln
