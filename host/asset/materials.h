// Parses materials in memory: Wavefront MTL, and pictures that a PLY names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "asset/file_finder.h"
#include "asset/mesh_reader.h"
#include "kiln/material.h"

namespace kiln {

/// Parses an MTL. It never reads outside the bytes; memory and time are linear in their number.
/// \param folder  base of relative paths of pictures
/// \param finder  finds missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_materials(const MeshInput& input, const std::filesystem::path& folder,
                                     FileFinder* finder = nullptr);

/// Reads the pictures that the header of a PLY names by "comment TextureFile NAME", and returns one material for each,
/// with a colour picture.
/// \param input   the file; its header suffices
/// \param folder  base of relative paths of pictures
/// \param finder  finds missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_ply_materials(const MeshInput& input,
                                         const std::filesystem::path& folder,
                                         FileFinder* finder = nullptr);

/// One material for each name, in the order of the names: the first of that name, or a default one.
std::vector<Material> materials_by_name(const std::vector<Material>& materials,
                                        const std::vector<std::string>& names);

/// Sets Material::vertex_opacity from the mesh's colours. \param materials  one for each of the mesh's material names
void set_vertex_opacity(const Mesh& mesh, std::vector<Material>& materials);

}  // namespace kiln
