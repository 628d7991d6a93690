// Groups, objects and materials of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives each triangle of a simplified mesh the group, object and material that most of the surface under it has. The
/// vote is taken from the high-poly triangles nearest to the centroid and to three points around it. Names that `low`
/// already has are kept: SimplifyJob::assign_labels() sets exact names if borders between labels were held as lines on
/// the surface.
/// \param high  its groups, objects or materials are skipped if they are not defined for all triangles
void transfer_labels(const Mesh& high, Mesh& low);

}  // namespace kiln
