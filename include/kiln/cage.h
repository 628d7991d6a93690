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
  /// Cage of two shells of the low poly's triangles (CageKind::shells): group "outer" first, then
  /// "inner". For MatchOptions::cage_mesh; save_obj() and load_mesh() preserve it to the bit.
  Mesh mesh = {};
  std::uint64_t samples = 0;  ///< Number of points of the low poly from which rays were cast
  /// Number of points at which the outer shell lies beyond a further face of the high poly, since
  /// other points of the same triangles need this height. Most of these points lie where parts
  /// touch, out of sight.
  std::uint64_t conflicts = 0;
  /// The warning `cage-flat` counts the vertices that the cage leaves in place, since both sides of a flat card share
  /// them.
  std::vector<Warning> warnings = {};
};

/// Finds a cage: the distances per vertex at which rays start outside and end inside.
///
/// From about 2^18 points spread over the low poly, rays along the directions of the bake (`ray.direction`)
/// find the outermost matching face (RayRule::outermost), within `max_distance` in both directions; none
/// given: 4% of the high poly's diagonal. The outer shell lies 25% beyond the farthest hit on the faces around
/// a vertex. It stays below the next face outside of it, whether of the high poly or of another part of the
/// low poly. The inner shell ends before the next face inside: the opposite side of a thin wall, or another
/// part. Both distances change gradually from vertex to vertex, and neither exceeds what the faces around a
/// vertex need.
///
/// `max_distance` is the largest height above the low poly at which a solid may begin; the cage then encloses
/// the whole solid, however high it is. A face is assigned to another point of the low poly if its distance to
/// that point is smaller by half of the ray's length.
///
/// Of the options it uses `method` (rays of a fallback are not blended at hard edges), `ray.direction`,
/// `ray.edge_width`, `max_distance`, `two_sided` and `parts`. Deterministic on any number of threads.
/// Rules for lifetimes and threads are those of bake().
/// \throws Error(usage) for an option out of its range; Error(input) for a low poly without UVs; Error(device)
FoundCage find_cage(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// Makes the cage that corresponds to MatchOptions::cage: the low poly, without UVs, with each
/// vertex moved along the direction of the rays that leave there. Vertices whose faces have no
/// common direction stay in place.
/// \param distance  world units
/// \throws Error(usage) for a distance that is not finite; Error(input) for an invalid mesh
Mesh offset_cage(const Mesh& low, double distance);

}  // namespace kiln
