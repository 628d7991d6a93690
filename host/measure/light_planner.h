// Plans of low polys that share what they simplify.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "kiln/light_plan.h"
#include "lowpoly/simplify_levels.h"

namespace kiln {

/// A low poly with UVs.
struct LaidOut {
  Mesh mesh;
  UnwrapReport report;
};

/// Low polys of all numbers of faces, and those that were made: fitting one takes longest.
struct KnownLevels {
  std::shared_ptr<const SimplifyLevels> levels;                       ///< Null until they are made
  std::map<std::size_t, Mesh> meshes;                                 ///< By level
  std::map<std::size_t, Mesh> glances;                                ///< The same, fitted roughly
  std::map<std::pair<std::size_t, std::uint32_t>, LaidOut> laid_out;  ///< By level and size
};

/// Low polys of one high poly, by the faces of the finest.
using LevelCache = std::map<std::uint32_t, KnownLevels>;

/// bake_light(), its options checked.
/// \param most_faces  of the low poly; 0: any
LightBake plan_light(const Source& source, const Mesh& high, const LightPlanOptions& options,
                     LevelCache& cache, std::uint64_t most_faces = 0);

}  // namespace kiln
