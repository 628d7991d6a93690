#pragma once

#include <optional>

#include "kiln/export.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Which of the faces that a ray meets counts.
enum class RayRule {
  /// The outermost one that faces the sample, but no farther out than where the ray meets the light mesh
  /// again: what lies beyond belongs to that part or fold of it. A sample inside another part of the light
  /// mesh takes the nearest one.
  outermost,
  nearest,  ///< The nearest outward, else the nearest inward (Tarini et al., section 3.2)
};

/// Where rays leave the light mesh to.
enum class RayDirection {
  /// Along its own normal, as shaded; near hard edges turned towards the averaged one, which both sides of
  /// an edge share. So details stand straight and edges have no gaps. Without hard edges: as averaged.
  automatic,
  averaged,  ///< Along the average of all normals at a vertex, interpolated
  face,      ///< Along its own normal everywhere: the two sides of a hard edge part
};

/// Which face a ray takes, and where rays leave the light mesh to.
struct RayOptions {
  RayRule rule = RayRule::outermost;  ///< Without a cage; from a cage the first face counts
  RayDirection direction = RayDirection::automatic;  ///< With a cage, too; not with a cage mesh
  /// For RayDirection::automatic: from this far off a hard edge rays follow the mesh's own normal. Above 0.
  /// None given: 1% of the diagonal.
  std::optional<Length> edge_width = {};
};

}  // namespace kiln
