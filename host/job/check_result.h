// Failures that throw nothing, patches that a match missed, and needs of a measured mesh.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace kiln {

/// A map with nothing in it is no success. \throws Error(input) that says why nothing matched
void check_result(const BakeReport& report, const Mesh& high, const Mesh& low);

/// Why a bake found no point for any texel, a sentence for people.
Message why_nothing(const BakeReport& report, const Mesh& high, const Mesh& low);

/// For bakes that miss much: a sentence, if the meshes' boxes do not fit as they are; with a space before it.
/// \param moved  whether that one lies beside the other is told, too: LOW may be of a part of HIGH
Message hint_of_boxes(const Mesh& high, const Mesh& low, bool moved);

/// A hint if boxes fit only after swapping axes or scaling. \param names  of both, for the message
void warn_of_boxes(const std::string& names, const Mesh& high, const Mesh& low,
                   std::vector<Warning>& warnings);

/// \param otherwise  what else helps, such as ", or leave LOW out" \throws Error(input) where it has no UVs
void check_has_uvs(const Mesh& low, const std::string& path, const std::string& otherwise);

/// Reads a low poly whose map is to be measured.
/// \param otherwise  ends the message: ", or ..."
/// \throws Error(input) where it has no UVs
Mesh load_low(const std::string& path, const std::string& otherwise, std::vector<Warning>& warnings,
              const LoadMeshOptions& options = {});

/// The largest connected patch of missed texels.
struct MissedPatch {
  std::uint64_t texels = 0;
  std::uint32_t column = 0, row = 0;  ///< The texel of the patch that is nearest to its mean
  Vec2 uv;                            ///< The texel's centre
  std::array<double, 3> position{};   ///< On the low poly, world units
};

/// None where no texel was missed as a whole. Texels are connected by their sides; of patches alike in size
/// the first by rows counts.
/// \param coverage  BakeResult::coverage, of width * height texels
std::optional<MissedPatch> largest_missed_patch(std::span<const std::uint8_t> coverage,
                                                std::uint32_t width, std::uint32_t height,
                                                const Mesh& low);

/// A sentence or two: how large the patch is and where it lies.
std::string describe(const std::optional<MissedPatch>& patch);

}  // namespace kiln
