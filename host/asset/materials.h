// Parses materials in memory: Wavefront MTL, and the pictures that a PLY names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "asset/file_finder.h"
#include "asset/mesh_reader.h"
#include "kiln/material.h"

namespace kiln {

/// Parses an MTL. It does not read outside of the bytes; memory and time are linear in their
/// number.
/// \param folder  folder at which relative paths of pictures start
/// \param finder  searches for missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_materials(const MeshInput& input, const std::filesystem::path& folder,
                                     FileFinder* finder = nullptr);

/// Makes a material with a colour picture for each line "comment TextureFile NAME" in the header of
/// a PLY.
/// \param input   the file; its header suffices
/// \param folder  base of relative paths of pictures
/// \param finder  finds missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_ply_materials(const MeshInput& input,
                                         const std::filesystem::path& folder,
                                         FileFinder* finder = nullptr);

/// For each of the names, the first material that has it, or a default one if there is none.
std::vector<Material> materials_by_name(const std::vector<Material>& materials,
                                        const std::vector<std::string>& names);

/// Sets Material::vertex_opacity by the colours of the mesh.
/// \param materials  one for each material name of the mesh
void set_vertex_opacity(const Mesh& mesh, std::vector<Material>& materials);

}  // namespace kiln
