// Groups, objects and materials of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives each triangle of a simplified mesh the group, object and material of most of the surface under it: a vote of
/// the high-poly triangles nearest to its centroid and three points around that. Names that `low` already has are
/// kept: SimplifyJob::assign_labels() sets exact names if borders between labels were held as lines on the surface.
/// \param high  kinds of names that are not defined for all triangles are skipped
void transfer_labels(const Mesh& high, Mesh& low);

}  // namespace kiln
