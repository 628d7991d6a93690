#pragma once

#include <cstdint>
#include <optional>

#include "kiln/export.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Which of the faces that a ray meets counts.
enum class RayRule {
  /// The outermost one that faces the sample, but no farther out than where the ray meets the low poly
  /// again: what lies beyond belongs to that part or fold of it. A sample inside another part of the low
  /// poly takes the nearest one.
  outermost,
  nearest,  ///< The nearest outward, else the nearest inward (Tarini et al., section 3.2)
};

/// Where rays leave the low poly to.
enum class RayDirection {
  /// Along its own normal, as shaded; near hard edges turned towards the averaged one, which both sides of
  /// an edge share. So details stand straight and edges have no gaps. Without hard edges: as averaged.
  automatic,
  averaged,  ///< Along the average of all normals at a vertex, interpolated
  face,      ///< Along its own normal everywhere: the two sides of a hard edge part
  /// As the low poly's vertices are coloured (Mesh::colors): where red is 255 along its own normal, where
  /// it is 0 averaged, between them blended. Without colours: Error(input).
  painted,
};

/// Which face a ray takes, and where rays leave the low poly to.
struct RayOptions {
  RayRule rule = RayRule::outermost;  ///< Without a cage; from a cage the first face counts
  RayDirection direction =
      RayDirection::automatic;  ///< With a cage, too; not with one of CageKind::offsets
  /// For RayDirection::automatic: from this far off a hard edge rays follow the mesh's own normal. Above 0.
  /// None given: for each edge by what the high poly has there. Two lengths compete, and the larger counts: two
  /// fifths of its bevel's width, and twice how much farther out the high poly lies beside it; 0.05% to 4% of
  /// the diagonal. Edges that do not tell take the median of the others; 1% of the diagonal where none tells.
  std::optional<Length> edge_width = {};
};

/// What a cage mesh (MatchOptions::cage_mesh) says, by its triangles.
enum class CageKind {
  /// The low poly's triangles: rays start there and run towards the low poly, whatever RayOptions::direction.
  offsets,
  /// Twice these, an outer shell and an inner one: rays start on their triangle's plane in the outer shell and
  /// end on that in the inner one. Where to is RayOptions::direction, with the way to the outer shell's vertices
  /// as the averaged direction. The outer shell comes first, unless the first half's group is "inner".
  shells,
  /// Any other: a closed hull around the low poly, wound as that is. Rays start where their directions leave
  /// it. Error(input) where one does not.
  hull,
};

/// How far a cage mesh lies off the low poly. Lengths in world units, over the low poly's corners; of a
/// hull over places spread over its faces, too.
struct CageReport {
  CageKind kind = CageKind::offsets;  ///< What the cage mesh was taken for
  double outward_least = 0;           ///< Rays start so far out
  double outward_median = 0;          ///< The one in the middle
  double outward_most = 0;            ///< The farthest
  double inward_least =
      0;  ///< Rays end so far in; 0 where the cage does not say (not CageKind::shells)
  double inward_median = 0;  ///< The one in the middle
  double inward_most = 0;    ///< The deepest
};

/// How far off the low poly's hard edges rays turn. Lengths in world units.
struct EdgeReport {
  std::uint64_t edges = 0;  ///< Hard edges
  std::uint64_t found = 0;  ///< Whose width was found on the high poly; 0 where it was given
  double least = 0;         ///< The narrowest
  double median = 0;        ///< The one in the middle
  double most = 0;          ///< The widest
};

}  // namespace kiln
