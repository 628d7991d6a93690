// Reads PLY files in pieces.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "mesh/mesh_stream.h"

namespace kiln {

/// A binary PLY whose elements have constant sizes: vertices without lists, then faces that are
/// triangles and have no other properties.
struct PlyLayout {
  std::uint64_t triangles = 0;
  bool has_uvs = false, has_normals = false;
  bool has_pictures = false;  ///< True if the header names pictures, and the vertices have UVs
  /// Why the file cannot be read in pieces, as the end of a sentence about it; empty if it can
  std::string obstacle;
};

/// Reads the header of a PLY.
/// \throws Error(input) as load_mesh()
PlyLayout ply_layout(const std::filesystem::path& path);

/// Opens a PLY that can be read in pieces (PlyLayout::obstacle is empty).
/// \throws Error(input)
std::shared_ptr<const MeshStream> stream_ply(const std::filesystem::path& path);

}  // namespace kiln
