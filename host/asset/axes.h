// Converts axes and units. Files that give theirs are converted to metres with Y up.
#pragma once

#include <optional>

#include "asset/hierarchy.h"
#include "kiln/mesh.h"

namespace kiln {

/// The rotation that turns the given up axis to Y; the identity for UpAxis::as_given.
AffineMap rotation_to_y_up(UpAxis up);

/// Transform from the coordinates of a file to those of Mesh.
struct WorldFrame {
  std::optional<AffineMap> map;  ///< Rotation and scale; nullopt if coordinates stay unchanged
  double metres = 0;             ///< Metres per unit of the Mesh; 0: unknown
};

/// Derives the transform from the options and from what the file says.
/// \param axis_rotation    rotation from the axes that the file gives; nullopt if it gives none
/// \param metres_per_unit  unit that the file gives; 0 if it gives none
WorldFrame world_frame(const LoadMeshOptions& options,
                       const std::optional<AffineMap>& axis_rotation, double metres_per_unit);

}  // namespace kiln
