// Checks of a bake's result: empty maps, patches of misses, mismatched bounding boxes, and missing UVs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace kiln {

/// Checks that a bake matched at least one sample. \throws Error(input) with the reason
void check_result(const BakeReport& report, const Mesh& high, const Mesh& low);

/// Explains in one sentence why a bake matched no texel.
Message explain_empty_result(const BakeReport& report, const Mesh& high, const Mesh& low);

/// Explains many misses by a mismatch of the bounding boxes, as a sentence with a leading space; empty if they match.
/// \param check_position  true: a displacement counts, too; false if LOW may cover only a part of HIGH
Message bounds_mismatch_hint(const Mesh& high, const Mesh& low, bool check_position);

/// Warns if the bounding boxes match only after axes are swapped or one mesh is scaled.
/// \param names  of both meshes, for the message
void warn_of_bounds_mismatch(const std::string& names, const Mesh& high, const Mesh& low,
                             std::vector<Warning>& warnings);

/// Checks that a low poly has UVs.
/// \param otherwise  an alternative remedy that ends the message, such as ", or leave LOW out"
/// \throws Error(input) if it has none
void check_has_uvs(const Mesh& low, const std::string& path, const std::string& otherwise);

/// Reads a low poly whose map will be measured.
/// \param otherwise  an alternative remedy that ends the message: ", or ..."
/// \throws Error(input) if it has no UVs
Mesh load_low(const std::string& path, const std::string& otherwise, std::vector<Warning>& warnings,
              const LoadMeshOptions& options = {});

/// The largest connected patch of missed texels.
struct MissedPatch {
  std::uint64_t texels = 0;
  std::uint32_t column = 0, row = 0;  ///< The texel nearest to the patch's mean position
  Vec2 uv;                            ///< UV of the centre of the texel at `column` and `row`
  std::array<double, 3> position{};   ///< The point of the low poly at `uv`, world units
};

/// The largest connected patch of texels without any matched sample; nullopt if there is none. Texels connect by their
/// sides; the first patch in row order wins ties.
/// \param coverage  BakeResult::coverage, of width * height texels
std::optional<MissedPatch> largest_missed_patch(std::span<const std::uint8_t> coverage,
                                                std::uint32_t width, std::uint32_t height,
                                                const Mesh& low);

/// States the patch's size and position in one or two sentences.
std::string describe(const std::optional<MissedPatch>& patch);

/// Describes the largest missed patch of a bake that has maps, by describe().
std::string describe_missed_place(const BakeResult& result, const Mesh& low);

}  // namespace kiln
