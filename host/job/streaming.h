// Tells whether a high poly is larger than memory, for bakes and for `kiln simplify`.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "job/high_poly_input.h"
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

/// Opens a high poly that is larger than memory. Null if it fits into memory, or may fit and is needed whole.
/// \param obstacle  why it is needed whole, as the end of a sentence about it, with a remedy; empty: it is not
/// \throws OptionError if it is needed whole and cannot fit
std::shared_ptr<const MeshStream> open_larger_than_memory(const std::string& path,
                                                          const MemoryNeed& need, Message obstacle);

/// Makes a mesh in memory that stands for a larger one when a low poly of `faces` triangles is made from it.
Mesh reduce(const ChunkedMesh& mesh, std::uint32_t faces);

/// States which normals a streamed high poly has: those of its file, or smooth ones.
ShadingReport shading_of(const MeshStream& streamed);

}  // namespace kiln
