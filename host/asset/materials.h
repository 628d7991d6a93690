// Parsing of materials in memory: Wavefront MTL, and pictures named by a PLY.
#pragma once

#include <filesystem>
#include <vector>

#include "asset/file_finder.h"
#include "asset/mesh_reader.h"
#include "kiln/material.h"

namespace kiln {

/// Never reads outside the bytes; memory and time are linear in their number.
/// \param folder  pictures' names are relative to it
/// \param finder  finds missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_materials(const MeshInput& input, const std::filesystem::path& folder,
                                     FileFinder* finder = nullptr);

/// The pictures that a PLY's header names, "comment TextureFile NAME": one material each, with a colour picture.
/// \param input   the file; its header suffices
/// \param folder  pictures' names are relative to it
/// \param finder  finds missing pictures; may be null
/// \throws Error(input)
std::vector<Material> read_ply_materials(const MeshInput& input,
                                         const std::filesystem::path& folder,
                                         FileFinder* finder = nullptr);

/// Sets Material::vertex_opacity.
/// \param materials  one for each of the mesh's names
void set_vertex_opacity(const Mesh& mesh, std::vector<Material>& materials);

}  // namespace kiln
