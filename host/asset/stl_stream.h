// STL files that are read piece by piece.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "asset/parsed_mesh.h"
#include "mesh/mesh_stream.h"

namespace kiln {

struct StlLayout {
  std::uint64_t triangles = 0;  ///< Estimated for a text; 0: the file is damaged
  bool is_text = false;
  /// Why the file cannot be read piece by piece, as the end of a sentence about it; empty: it can.
  std::string obstacle;
};

/// Reads an STL's size and first bytes. \throws Error(input) if it cannot be opened
StlLayout stl_layout(const std::filesystem::path& path);

/// Opens an STL whose layout has no obstacle.
///
/// A binary file: corners of equal positions are joined to vertices, as load_mesh() joins
/// them, and written to a file in `folder` (CacheFileWriter): 12 bytes a triangle and a vertex. Later calls use that file
/// while the STL's path, size and time are the same. Joining takes 12 bytes of memory a vertex, and a hash table of 8 to
/// 16 bytes a vertex. Its progress names the piece; it can be cancelled.
///
/// A text is parsed once, into such a file, too (stream_parsed()). Corners are joined in double precision, as load_mesh()
/// joins them: 24 bytes of memory a vertex, and the hash table. Refused by line: facets of more than three corners, and
/// collision hulls.
/// \param rules  of texts
/// \throws Error(input), also for an STL with colours; Error(output) if the file cannot be written
std::shared_ptr<const MeshStream> stream_stl(const std::filesystem::path& path,
                                             const std::filesystem::path& folder,
                                             const ParsingRules& rules = {});

}  // namespace kiln
