// Checks of a bake's result: empty maps, patches of misses, mismatched bounding boxes, and missing UVs.
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

/// Fails if a bake matched nothing. \throws Error(input) with the reason
void check_result(const BakeReport& report, const Mesh& high, const Mesh& low);

/// The reason why a bake matched no texel, as a sentence.
Message why_nothing(const BakeReport& report, const Mesh& high, const Mesh& low);

/// A sentence for bakes with large misses if the meshes' bounding boxes do not match, with a leading space.
/// \param moved  true to report a displacement, too; false if LOW may cover only a part of HIGH
Message hint_of_boxes(const Mesh& high, const Mesh& low, bool moved);

/// Warns if the bounding boxes match only after swapping axes or scaling. \param names of both meshes, for the message
void warn_of_boxes(const std::string& names, const Mesh& high, const Mesh& low,
                   std::vector<Warning>& warnings);

/// \param otherwise  alternative remedy, such as ", or leave LOW out" \throws Error(input) if it has no UVs
void check_has_uvs(const Mesh& low, const std::string& path, const std::string& otherwise);

/// Reads a low poly whose map is to be measured.
/// \param otherwise  ends the message: ", or ..."
/// \throws Error(input) if it has no UVs
Mesh load_low(const std::string& path, const std::string& otherwise, std::vector<Warning>& warnings,
              const LoadMeshOptions& options = {});

/// The largest connected patch of missed texels.
struct MissedPatch {
  std::uint64_t texels = 0;
  std::uint32_t column = 0, row = 0;  ///< The texel of the patch that is nearest to its mean
  Vec2 uv;                            ///< The texel's centre
  std::array<double, 3> position{};   ///< On the low poly, world units
};

/// The largest patch of completely missed texels; nullopt if there is none. Texels are connected by their sides; the
/// first by rows wins ties.
/// \param coverage  BakeResult::coverage, of width * height texels
std::optional<MissedPatch> largest_missed_patch(std::span<const std::uint8_t> coverage,
                                                std::uint32_t width, std::uint32_t height,
                                                const Mesh& low);

/// One or two sentences with the patch's size and position.
std::string describe(const std::optional<MissedPatch>& patch);

/// The same for the largest patch of a bake that has maps.
std::string missed_place(const BakeResult& result, const Mesh& low);

}  // namespace kiln
