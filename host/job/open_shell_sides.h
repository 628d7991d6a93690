// Makes materials of open shells double-sided.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "kiln/asset.h"
#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

/// Makes a material double-sided if views from outside see many back faces of its open shells; see find_open_shells().
/// \param is_stated  per material, true if a file states whether back faces are shown: such materials are unchanged
/// \param materials  materials of the mesh, in the order of Mesh::material_names
/// \returns the warning `double-sided`; nullopt if no material changed
std::optional<Warning> show_backs_of_shells(const Mesh& mesh, const std::vector<bool>& is_stated,
                                            std::span<AssetMaterial> materials);

}  // namespace kiln
