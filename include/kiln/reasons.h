#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// Why a sample has the point that it has, or none.
enum class Reason : std::uint8_t {
  empty,        ///< No sample here
  found,        ///< A point, and nothing to say
  passed_over,  ///< A point, past a nearer face (RayRule::outermost)
  other_part,   ///< None: what the ray meets is of another part (MatchOptions::parts)
  back_face,    ///< None: what the ray meets looks away
  far,          ///< None: what the ray meets lies beyond max_distance
  folded,       ///< None: rays leave the low poly's face on its back, where the mesh is folded
  nothing,      ///< None: the ray meets nothing at all
};

/// Name, words and colour of a reason, as maps and legends show it.
struct ReasonInfo {
  Reason reason = Reason::empty;        ///< Which
  std::string_view name = {};           ///< One word
  Message words = {};                   ///< For people: what it means, and what helps
  std::array<std::uint8_t, 3> color{};  ///< sRGB
};

/// All of them, in the order of their values. The names live as long as the program.
std::array<ReasonInfo, 8> reason_infos();

/// One reason's share of a bake.
struct ReasonCount {
  Reason reason = Reason::empty;     ///< Which
  std::uint64_t samples = 0;         ///< Number of samples, above 0
  std::uint32_t column = 0;          ///< Texel of an example: from the left,
  std::uint32_t row = 0;             ///< ... and from the top
  std::array<double, 3> position{};  ///< Position of the example on the low poly, world units
  double distance = 0;               ///< For Reason::far: of the nearest one found, world units
};

/// Why each sample of a bake by rays has its point or none.
struct Reasons {
  std::uint32_t width = 0;   ///< Texels
  std::uint32_t height = 0;  ///< Texels
  std::vector<Reason> texels =
      {};  ///< Reason of each texel, rows from the top: the highest of its samples' values
  std::vector<ReasonCount> counts =
      {};  ///< Those there are but Reason::empty, in the order of their values
};

/// Looks for why: rays again, where a bake found nothing. Deterministic.
/// Lifetimes, threads and welding as bake(): nothing is kept, and several threads may ask of one Source. No
/// callback comes.
/// \param match    of the bake: BakeResult::match
/// \param options  those of the bake, by MatchMethod::ray without fallbacks
/// \throws Error(usage) for another method, Error(input) for a match of other meshes or size
Reasons explain(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options);

}  // namespace kiln
