// PLY files that are read piece by piece.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "mesh/mesh_stream.h"

namespace kiln {

/// A binary PLY whose elements have constant sizes: vertices without lists, then triangles without further properties.
struct PlyLayout {
  std::uint64_t triangles = 0;
  bool has_uvs = false, has_normals = false;
  bool has_pictures = false;  ///< The header names pictures, and the vertices have UVs
  /// Why the file cannot be read piece by piece, as the end of a sentence about it; empty: it can.
  std::string obstacle;
};

/// Reads a PLY's header. \throws Error(input) as load_mesh()
PlyLayout ply_layout(const std::filesystem::path& path);

/// Opens a PLY whose layout has no obstacle. \throws Error(input)
std::shared_ptr<const MeshStream> stream_ply(const std::filesystem::path& path);

}  // namespace kiln
