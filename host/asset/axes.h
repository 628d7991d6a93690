// Axes and units of files: all that say theirs meet in metres with Y up.
#pragma once

#include <optional>

#include "asset/hierarchy.h"
#include "kiln/mesh.h"

namespace kiln {

/// Turns `up` to Y; nothing for UpAxis::as_given.
AffineMap turn_of(UpAxis up);

/// From a file's coordinates to those of Mesh.
struct WorldFrame {
  std::optional<AffineMap> map;  ///< None: they stay as they are
  double metres = 0;             ///< Metres in a unit of the Mesh; 0: unknown
};

/// \param own_turn    that the file asks for; none: it does not say its axes
/// \param own_metres  of the file's unit; 0: it does not say it
WorldFrame world_frame(const LoadMeshOptions& options, const std::optional<AffineMap>& own_turn,
                       double own_metres);

}  // namespace kiln
