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

/// A cage that was found, and what there is to say of it.
struct FoundCage {
  /// Two shells of the low poly's triangles (CageKind::shells): group "outer" first, then "inner". For
  /// MatchOptions::cage_mesh; save_obj() and load_mesh() give it back to the bit.
  Mesh mesh = {};
  std::uint64_t samples = 0;  ///< Places of the low poly that were looked at
  /// Places among these over which the outer shell cannot stay below the next face: needs elsewhere
  /// on their triangles come first. Mostly they lie where parts touch, and nobody sees them.
  std::uint64_t conflicts = 0;
  std::vector<Warning> warnings =
      {};  ///< `cage-flat`: vertices that stay, since both sides of a card share them
};

/// Finds a cage: per vertex, how far out rays start and how far in they end.
///
/// Places all over the low poly, about 2^18, look along the bake's own directions (`ray.direction`). They
/// look for the outermost face that fits them (RayRule::outermost), up to `max_distance` both ways; none
/// given: 4% of the high poly's diagonal. The outer shell takes in what the faces around a vertex need
/// anywhere, and a quarter more. It stays below the next face above, of the high poly or of another part
/// of the low poly. The inner shell ends above the next face below: a thin wall's other sheet, or another
/// part. Both change gradually from vertex to vertex, and neither asks more of one than its faces do.
///
/// `max_distance` says how far above the low poly a solid may begin; it is taken in as a whole, however high
/// it is. A face that lies nearer to another place of the low poly, by half of the ray's way, belongs there.
///
/// Takes of the options `method` (rays as a fallback do not turn), `ray.direction`, `ray.edge_width`,
/// `max_distance`, `two_sided` and `parts`.
/// Deterministic on any number of threads. Lifetimes and threads as bake().
/// \throws Error(usage) for an option out of its range; Error(input) for a low poly without UVs; Error(device)
FoundCage find_cage(const Source& source, const Mesh& low, const BakeOptions& options = {});

/// The low poly, each vertex moved along the direction in which rays leave there: the cage that
/// MatchOptions::cage stands for. Vertices without a direction in common stay. The UVs are left out.
/// \param distance  world units
/// \throws Error(usage) for a distance that is not finite; Error(input) for a mesh that is no mesh
Mesh offset_cage(const Mesh& low, double distance);

}  // namespace kiln
