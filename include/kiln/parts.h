#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// By which names of a mesh's triangles parts are told apart.
enum class PartsBy {
  name,      ///< Groups (Mesh::groups; without any, objects), by patterns of their names
  group,     ///< Groups of the same name
  object,    ///< Objects (Mesh::objects) of the same name
  material,  ///< Materials of the same name
  list,      ///< Groups, as a list of pairs says
};

/// A pair of a list. Names are patterns, in which `*` is any text.
struct PartPair {
  std::string low;                ///< Of the low poly's groups
  std::vector<std::string> high;  ///< Of the high poly's groups: any of these
};

/// Which parts of two meshes belong together, by their names. A pattern is text with `*` for any
/// text, also none; its first `*`, which must stand for some text, is the part's name. Of its other text
/// upper and lower case are the same. Where no pattern fits, a number at the end as Blender gives it to
/// copies (`.001`) is left out.
struct PartNames {
  /// For PartsBy::name: the low poly's
  std::vector<std::string> low = {"*_low", "*_lp", "*_lo", "*_lowpoly"};
  /// For PartsBy::name: the high poly's
  std::vector<std::string> high = {"*_high", "*_high_*", "*_hp",       "*_hp_*",
                                   "*_hi",   "*_hi_*",   "*_highpoly", "*_highpoly_*"};
  PartsBy by = PartsBy::name;       ///< Which names
  std::vector<PartPair> list = {};  ///< For PartsBy::list: the first that fits counts
};

/// Pairs of parts: samples on a part of the low poly find points of its part of the high poly alone.
struct Parts {
  std::uint32_t count = 0;          ///< Parts are 0 to count - 1
  std::vector<std::string> names;   ///< Of each part; the last one may be "", what has no pair
  std::vector<std::uint32_t> low;   ///< Part of each triangle of the low poly
  std::vector<std::uint32_t> high;  ///< Part of each triangle of the high poly
  /// unmatched-parts: groups without a pair, and the nearest name; by PartsBy::name also the patterns by which
  /// most would have one
  std::vector<Warning> warnings;
};

/// Pairs the parts of two meshes. By PartsBy::name `X_low` takes `X_high`, `X_high.001` and `X_high_...`, or
/// what patterns say; a name that fits no pattern is a part's name itself, so `X` takes `X`, too. All that
/// has no pair is one part of its own. Time: that of reading the names and triangles, but for patterns of a list
/// with `*`, each of which is tried on each name. Names alone count: nothing is welded. The result is the caller's own and
/// fits these two meshes as long as their triangles stay. Thread safety: may be called from several threads.
/// \throws Error(input) where a mesh has no such names, or none of them has a pair
/// \throws Error(usage) for a pattern without `*`, or an empty list
Parts pair_parts(const Mesh& high, const Mesh& low, const PartNames& names = {});

}  // namespace kiln
