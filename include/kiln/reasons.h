#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// Why a sample has its point, or none.
enum class Reason : std::uint8_t {
  empty,        ///< No sample here
  found,        ///< A point, without a remark
  passed_over,  ///< A point, past a nearer face (RayRule::outermost)
  other_part,   ///< Missed: the ray hits another part only (MatchOptions::parts)
  back_face,    ///< Missed: the ray hits back faces only
  far,          ///< Missed: the ray's hits lie beyond max_distance
  /// Missed: the ray leaves through the back of the low poly's face, where the mesh is folded
  folded,
  nothing,  ///< Missed: the ray hits nothing at all
};

/// Name, description and colour of a reason, as in maps and legends.
struct ReasonInfo {
  Reason reason = Reason::empty;        ///< The reason
  std::string_view name = {};           ///< One word
  Message words = {};                   ///< Meaning and remedy, for users
  std::array<std::uint8_t, 3> color{};  ///< sRGB
};

/// All reasons, in the order of their values. Texts have static lifetime.
std::array<ReasonInfo, 8> reason_infos();

/// Samples of a bake with one reason.
struct ReasonCount {
  Reason reason = Reason::empty;     ///< The reason
  std::uint64_t samples = 0;         ///< Number of samples, above 0
  std::uint32_t column = 0;          ///< Texel of an example: column from the left
  std::uint32_t row = 0;             ///< Row from the top
  std::array<double, 3> position{};  ///< Position of the example on the low poly, world units
  double distance = 0;               ///< For Reason::far: distance of the nearest hit, world units
};

/// Why each sample of a bake by rays has its point or none.
struct Reasons {
  std::uint32_t width = 0;   ///< Texels
  std::uint32_t height = 0;  ///< Texels
  std::vector<Reason> texels =
      {};  ///< Reason of each texel, rows from the top: the highest value among its samples
  std::vector<ReasonCount> counts =
      {};  ///< Reasons that occur, apart from Reason::empty, in the order of their values
};

/// Finds the reasons by casting the missed rays again. Deterministic.
/// Lifetimes, threads and welding as bake(): no argument is kept, and several threads may use one Source.
/// No callback is called.
/// \param match    the bake's: BakeResult::match
/// \param options  those of the bake, by MatchMethod::ray without fallbacks
/// \throws Error(usage) for another method, Error(input) for a match of other meshes or size
Reasons explain(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options);

}  // namespace kiln
