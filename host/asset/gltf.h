// glTF 2.0: meshes, hierarchy and materials.
#pragma once

#include <string>
#include <vector>

#include "asset/gltf_file.h"
#include "kiln/asset.h"

namespace kiln {

/// Reads .glb or .gltf whole; parse_mesh() gives its mesh alone. Files beside it are read where input.folder is
/// given. Memory is linear in the file and its buffers, but for meshes that several nodes place.
/// \throws Error(input)
/// \param materials  whether to read them, too
Asset read_gltf(const MeshInput& input, bool materials);

/// Its materials, each with a name of its own, in the file's order; behind them "default", that of primitives without
/// one. Pictures of their own files must be there: else a warning "picture-missing", and the factor alone.
std::vector<Material> read_gltf_materials(const MeshInput& input);
std::vector<Material> read_gltf_materials(const GltfFile& file);

/// Names of a file's materials as the mesh has them, each another; the last is that of primitives without one.
std::vector<std::string> gltf_material_names(const GltfFile& file);

}  // namespace kiln
