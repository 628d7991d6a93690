#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/match.h"
#include "kiln/mesh.h"
#include "kiln/source.h"

namespace KILN_PUBLIC kiln {

/// The result of find_cage().
struct FoundCage {
  /// Two shells of the low poly's triangles (CageKind::shells): group "outer" first, then "inner". For
  /// MatchOptions::cage_mesh; save_obj() and load_mesh() preserve it to the bit.
  Mesh mesh = {};
  std::uint64_t samples = 0;  ///< Number of places of the low poly that were probed
  /// Places over which the outer shell cannot stay below the next face, since places elsewhere on
  /// the same triangles need more height. Mostly they lie where parts touch, out of sight.
  std::uint64_t conflicts = 0;
  std::vector<Warning> warnings =
      {};  ///< `cage-flat`: vertices that stay, since both sides of a card share them
};

/// Finds a cage: the distances per vertex at which rays start outside and end inside.
///
/// From about 2^18 places all over the low poly, rays along the bake's own directions (`ray.direction`) find
/// the outermost matching face (RayRule::outermost), up to `max_distance` both ways; none given: 4% of the
/// high poly's diagonal. The outer shell lies 25% beyond the farthest hit on the faces around a vertex. It
/// stays below the next face above, of the high poly or of another part of the low poly. The inner shell ends
/// above the next face below: a thin wall's other sheet, or another part. Both distances change gradually from
/// vertex to vertex, and neither exceeds what the faces around a vertex need.
///
/// `max_distance` is the largest height above the low poly at which a solid may begin; the cage then encloses
/// the whole solid, however high it is. A face counts for another place of the low poly if it lies closer to
/// that one by half of the ray's length.
///
/// Uses of the options `method` (rays as a fallback do not turn), `ray.direction`, `ray.edge_width`,
/// `max_distance`, `two_sided` and `parts`.
/// Deterministic on any number of threads. Lifetimes and threads as bake().
/// \throws Error(usage) for an option out of its range; Error(input) for a low poly without UVs; Error(device)
FoundCage find_cage(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// The low poly, each vertex moved along the direction in which rays leave there: the cage that
/// MatchOptions::cage stands for. Vertices whose faces share no direction stay. The UVs are left
/// out.
/// \param distance  world units
/// \throws Error(usage) for a distance that is not finite; Error(input) for an invalid mesh
Mesh offset_cage(const Mesh& low, double distance);

}  // namespace kiln
