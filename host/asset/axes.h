// Axes and units of files: files that state theirs are converted to metres with Y up.
#pragma once

#include <optional>

#include "asset/hierarchy.h"
#include "kiln/mesh.h"

namespace kiln {

/// Rotates `up` to Y; identity for UpAxis::as_given.
AffineMap turn_of(UpAxis up);

/// Transform from a file's coordinates to those of Mesh.
struct WorldFrame {
  std::optional<AffineMap> map;  ///< None: coordinates are unchanged
  double metres = 0;             ///< Metres per unit of the Mesh; 0: unknown
};

/// \param axis_rotation    rotation from the axes that the file declares; none if it declares none
/// \param metres_per_unit  declared by the file; 0 if it declares none
WorldFrame world_frame(const LoadMeshOptions& options,
                       const std::optional<AffineMap>& axis_rotation, double metres_per_unit);

}  // namespace kiln
