// Normals that part at hard edges.
#pragma once

#include <vector>

#include "kiln/mesh.h"
#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"

namespace kiln {

/// Gives triangles normals that corners share where smooth edges connect them: angle-weighted, summed in the order of
/// triangles. Corners of parts without hard edges share one at each place.
///
/// A plane of several triangles gives its normal to vertices that it shares with faces of less than a quarter of its
/// area: at the border of a flat and a rounded edge, the surface has the flat's normal. At tips, as of cones, where
/// the shared normal is far off its faces, each has its own.
/// \param triangles  those that get normals; others keep what they have
/// \param mesh  that the edges are of; its normal_triangles are parallel to its triangles. Changed
void give_fan_normals(const FaceEdges& faces, const Creases& creases,
                      const std::vector<bool>& triangles, Mesh& mesh);

}  // namespace kiln
