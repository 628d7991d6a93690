// Cages as files: meshes, or distances and directions in an image.
#pragma once

#include <filesystem>
#include <vector>

#include "kiln/kiln.h"

namespace kiln::cli {

/// Writes the two shells of a found cage: as OBJ. Where the name ends in .exr, as an image: a pixel a vertex of
/// LOW in its order, 4096 a row. The upper half is the outer shell, the lower one the inner shell. Red, green
/// and blue are the direction outward, alpha is the distance from the vertex, world units (-1: no vertex).
/// \throws Error(output)
void save_cage(const Mesh& cage, const Mesh& low, const std::filesystem::path& path);

/// Reads a cage of any kind. Images give back what save_cage() had, within a float's last bit.
/// \throws Error(input) as load_mesh(), and for an image of another number of vertices, or with a value that is no
///         number
Mesh load_cage(const std::filesystem::path& path, const Mesh& low, const LoadMeshOptions& options,
               std::vector<Warning>* warnings);

/// The same of an image that is read already. \param path  names it in messages
Mesh cage_of(const Image& image, const std::filesystem::path& path, const Mesh& low);

}  // namespace kiln::cli
