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

/// \param own_turn    rotation by the file's axes; none: the file does not state its axes
/// \param own_metres  metres per unit of the file; 0: it does not state its unit
WorldFrame world_frame(const LoadMeshOptions& options, const std::optional<AffineMap>& own_turn,
                       double own_metres);

}  // namespace kiln
