// Normals that are split at hard edges.
#pragma once

#include <vector>

#include "kiln/mesh.h"
#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"

namespace kiln {

/// Computes triangles' corner normals that are shared across smooth edges: angle-weighted, summed in triangle order.
/// In parts without hard edges, all corners at a position share one normal.
///
/// A planar region of several triangles keeps its own normal at vertices whose other faces have less than a quarter
/// of its area: at the border between a plane and a rounded edge, the normal is the plane's. At sharp tips (cones),
/// where a shared normal deviates far from its faces, each face has its own normal.
/// \param triangles  true for triangles that get normals; the others keep their normals
/// \param mesh  [in, out] the mesh of `faces`; its normal_triangles are parallel to its triangles
void give_fan_normals(const FaceEdges& faces, const Creases& creases,
                      const std::vector<bool>& triangles, Mesh& mesh);

}  // namespace kiln
