#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Which groups of two meshes are parts of one thing, by their names. A pattern is text with `*` for any
/// text, also none; its first `*` is the part's name.
struct PartNames {
  std::vector<std::string> low = {"*_low"};                ///< Of the light mesh's groups
  std::vector<std::string> high = {"*_high", "*_high_*"};  ///< Of the dense mesh's groups
};

/// Pairs of parts: samples on a part of the light mesh find points of its part of the dense mesh alone.
struct Parts {
  std::uint32_t count = 0;          ///< Parts are 0 to count - 1
  std::vector<std::string> names;   ///< Of each part; the last one may be "", what has no pair
  std::vector<std::uint32_t> low;   ///< Part of each triangle of the light mesh
  std::vector<std::uint32_t> high;  ///< Part of each triangle of the dense mesh
  std::vector<Warning> warnings;  ///< unmatched-parts: groups without a pair, and the nearest name
};

/// Pairs the groups (Mesh::groups) of two meshes. The light `X_low` takes the dense `X_high` and `X_high_...`,
/// whatever patterns say; a name that fits no pattern is a part's name itself, so `X` takes `X`, too. All that
/// has no pair is one part of its own.
/// \throws Error(input) where a mesh has no groups, or none of them has a pair
/// \throws Error(usage) for a pattern without `*`
Parts pair_parts(const Mesh& high, const Mesh& low, const PartNames& names = {});

}  // namespace kiln
