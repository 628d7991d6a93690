// The mesh of a saved source (.kilnsrc), which is a high poly that an earlier run has read, with
// its search structures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "asset/mesh_reader.h"
#include "base/lower_case.h"
#include "io/file/atomic_file.h"
#include "kiln/error.h"

namespace kiln {

inline bool is_saved_source_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".kilnsrc";
}

/// The warning that a saved source has only the names of its materials.
Warning warning_of_unsaved_materials(const Mesh& mesh, const std::string& file);

/// Writes the first part of a saved source: the mesh, in the byte order of this machine.
/// \throws Error(output)
void write_saved_mesh(const Mesh& mesh, AtomicFile& file);

/// Offset in the file of the part after the mesh.
/// \throws Error(input)
std::uint64_t saved_mesh_end(const std::filesystem::path& path);

/// Reads the mesh of a saved source; bytes after it are ignored. Its axes and units are those of
/// the run that saved it.
Mesh read_saved_mesh(const MeshInput& input);

}  // namespace kiln
