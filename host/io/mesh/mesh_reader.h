// What the mesh readers share: the file as bytes, and how a failure is reported.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

enum class MeshFormat { ply, obj, stl, off, assimp };

/// A mesh file that has been read into memory whole.
struct MeshInput {
  std::string file;                          ///< Path as the caller gave it; used in messages.
  std::string_view bytes;                    ///< The content.
  std::vector<Warning>* warnings = nullptr;  ///< Where to append what was imperfect; may be null.
  Triangulation triangulation = Triangulation::automatic;

  /// Throws Error(input): "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const std::string& remedy) const;
  void warn(std::string code, const std::string& message, std::uint64_t count) const;
};

/// Reads a mesh from memory: the readers below behind a check that the content is what `format`
/// says. Never reads outside `bytes`; memory and time are linear in their number.
/// \throws Error(input)
Mesh parse_mesh(const MeshInput& input, MeshFormat format);

/// Each throws Error(input) for what it cannot use, and appends to input.warnings for the rest.
Mesh read_ply(const MeshInput& input);
Mesh read_obj(const MeshInput& input);
Mesh read_stl(const MeshInput& input);
Mesh read_off(const MeshInput& input);

}  // namespace kiln
