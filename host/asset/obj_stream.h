// OBJ files that are read piece by piece.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "asset/parsed_mesh.h"
#include "mesh/mesh_stream.h"

namespace kiln {

/// Facts about an OBJ that follow from samples of its lines.
struct ObjLayout {
  std::uint64_t triangles = 0;  ///< Estimated
  bool has_normals = false;     ///< Faces refer to normals
  bool has_pictures = false;    ///< Faces refer to UVs, and the first lines to material files
  /// Why the file cannot be read piece by piece, as the end of a sentence about it; empty: nothing in its first bytes
  /// prevents it.
  std::string obstacle;
};

/// Reads an OBJ's size and a few pieces of it. \throws Error(input) if it cannot be opened
ObjLayout obj_layout(const std::filesystem::path& path);

/// Opens an OBJ whose layout has no obstacle. The file is parsed once, and its binary form is written to a file in
/// `folder` (CacheFileWriter): 12 bytes a triangle and a vertex, as much again for normals, and 8 bytes a vertex with a
/// colour. Later calls use that file while the OBJ's path, size and time are the same. Parsing takes 24 bytes of memory
/// a vertex. Its progress names the piece; it can be cancelled.
///
/// Positions, triangles, normals and colours are those of load_mesh(). What a piece does not tell is refused, by line
/// where there is one: faces before their vertices, corners with and without normals in one file, polygons or several
/// smoothing groups without normals, and colours of ZBrush. UVs, groups and materials are not stored: no map of a mesh
/// that is larger than memory reads them.
/// \throws Error(input), for what is refused, too; Error(output) if the file cannot be written
std::shared_ptr<const MeshStream> stream_obj(const std::filesystem::path& path,
                                             const std::filesystem::path& folder,
                                             const ParsingRules& rules = {});

}  // namespace kiln
