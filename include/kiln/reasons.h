#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// Why a sample has a point of the high poly, or none.
enum class Reason : std::uint8_t {
  empty,        ///< The low poly does not cover the sample
  found,        ///< A point was found
  passed_over,  ///< A point was found beyond a nearer face (RayRule::outermost)
  other_part,   ///< Missed: the ray hits another part only (MatchOptions::parts)
  back_face,    ///< Missed: the ray hits back faces only
  far,          ///< Missed: the ray's hits lie beyond max_distance
  /// Missed: the ray leaves its own face on the back, where the low poly is folded
  folded,
  nothing,  ///< Missed: the ray hits nothing at all
};

/// Name, description and colour of a reason, as in maps and legends.
struct ReasonInfo {
  Reason reason = Reason::empty;        ///< Reason that this entry is about
  std::string_view name = {};           ///< Name of the reason, one word
  Message words = {};                   ///< Meaning of the reason, and a remedy, for users
  std::array<std::uint8_t, 3> color{};  ///< Colour, sRGB-encoded
};

/// All reasons, in the order of their values. Texts have static lifetime.
std::array<ReasonInfo, 8> reason_infos();

/// The samples of a bake that have the same reason.
struct ReasonCount {
  Reason reason = Reason::empty;     ///< Reason that this entry is about
  std::uint64_t samples = 0;         ///< Number of samples with this reason, above 0
  std::uint32_t column = 0;          ///< Column of the example's texel, from the left
  std::uint32_t row = 0;             ///< Row of the example's texel, from the top
  std::array<double, 3> position{};  ///< Position of the example on the low poly, world units
  double distance = 0;               ///< For Reason::far: distance of the nearest hit, world units
};

/// Why each sample of a bake by rays has a point of the high poly, or none.
struct Reasons {
  std::uint32_t width = 0;   ///< Texels
  std::uint32_t height = 0;  ///< Texels
  /// Reason of each texel, rows from the top; of a texel's samples, the reason with the highest
  /// value
  std::vector<Reason> texels = {};
  std::vector<ReasonCount> counts =
      {};  ///< Reasons that occur, apart from Reason::empty, in the order of their values
};

/// Finds the reasons by casting the missed rays again. Deterministic.
/// Rules for lifetimes, threads and welding are those of bake(): no argument is kept, and several threads may use
/// one Source.
/// No callback is called.
/// \param match    the match of the bake: BakeResult::match
/// \param options  options of the bake, which must match by MatchMethod::ray without fallbacks
/// \throws Error(usage) for another method, Error(input) for a match of other meshes or size
Reasons explain(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options);

}  // namespace kiln
