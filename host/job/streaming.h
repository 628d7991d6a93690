// Tells whether a high poly is larger than memory, for bakes and for `kiln simplify`.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "job/high_poly_input.h"
#include "kiln/job.h"
#include "kiln/message.h"
#include "mesh/mesh_stream.h"

namespace kiln {

class ChunkedMesh;

/// Memory that work uses if it reads the high poly whole.
struct MemoryNeed {
  std::uint64_t bytes_per_triangle;      ///< Usually
  std::uint64_t min_bytes_per_triangle;  ///< At least
  std::uint64_t other_bytes = 0;         ///< Independent of the high poly
};

/// In a bake of 10 million triangles a triangle took 130 bytes. No bake needs less than 100: the BVH takes 62; a triangle
/// and half a vertex take 18, and 18 more for the copy relative to the bake's origin.
inline constexpr MemoryNeed kMemoryToBake{140, 100};
/// Simplification of 10 million triangles to 5,000 took 240 bytes a triangle; 160 of them are its own, and the mesh takes
/// 18.
inline constexpr MemoryNeed kMemoryToSimplify{240, 178};

/// States that an option needs the whole high poly in memory, as the end of a sentence about it, with a remedy.
Message explain_whole_mesh_need(const Message& what);
/// explain_whole_mesh_need() for a low poly within an error. \param remedy  names the options to give instead
Message explain_error_bound_need(const Message& remedy);
/// explain_whole_mesh_need() for the options of reading and repairing that bakes and `kiln simplify` share; empty if none
/// is given.
Message find_reading_obstacle(const MeshFrameArguments& frame, double fill_holes);

/// Opens a high poly that is larger than memory. Null if it fits into memory, or may fit and is needed whole.
/// \param find_obstacle  returns why it is needed whole, by explain_whole_mesh_need() or the like; empty: it is not.
///                       Called only for a high poly that does not fit
/// \throws OptionError if it is needed whole and cannot fit
std::shared_ptr<const MeshStream> open_larger_than_memory(
    const std::string& path, const MemoryNeed& need, const std::function<Message()>& find_obstacle);

/// Makes a mesh in memory that stands for a larger one when a low poly of `faces` triangles is made from it.
Mesh reduce(const ChunkedMesh& mesh, std::uint32_t faces);

/// A line of the summary. \param normals  which normals are used, such as "smooth"
std::string streaming_line(const std::string& normals);

/// States which normals a streamed high poly has: those of its file, or smooth ones.
ShadingReport shading_of(const MeshStream& streamed);

}  // namespace kiln
