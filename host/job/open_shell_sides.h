// Makes the materials of open shells double-sided.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "kiln/asset.h"
#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

/// Makes each material double-sided whose open shells show many back faces to views from outside (find_open_shells()).
/// \param is_stated  per material, true if a file states whether back faces are shown: such materials stay as they are
/// \param materials  of the mesh, in the order of Mesh::material_names
/// \returns the warning `double-sided`; nullopt if no material changed
std::optional<Warning> show_backs_of_shells(const Mesh& mesh, const std::vector<bool>& is_stated,
                                            std::span<AssetMaterial> materials);

}  // namespace kiln
