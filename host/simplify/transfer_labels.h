// Groups, objects and materials of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives each triangle of a simplified mesh the group, object and material that most of it lies on: of the
/// nearest dense triangles to its middle and to three places around that. What `low` has already stays: where
/// borders are lines (SimplifyJob::name), it has the names of the triangles that it came from.
/// \param high  names of one kind that are not there for all triangles are left out
void transfer_labels(const Mesh& high, Mesh& low);

}  // namespace kiln
