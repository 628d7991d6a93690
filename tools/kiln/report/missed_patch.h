// Patches in which a match found nothing.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "kiln/mesh.h"
#include "kiln/types.h"

namespace kiln::cli {

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

}  // namespace kiln::cli
