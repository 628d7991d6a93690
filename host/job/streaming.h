// Detects high polys that are larger than memory, for bakes and for `kiln simplify`.
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

/// Memory that an operation needs if it reads the whole high poly.
struct MemoryNeed {
  std::uint64_t bytes_per_triangle;      ///< Typical number of bytes per triangle
  std::uint64_t min_bytes_per_triangle;  ///< Lower bound of the bytes per triangle
  std::uint64_t other_bytes = 0;         ///< Bytes that do not depend on the high poly
};

/// In a bake of 10 million triangles a triangle took 130 bytes. No bake needs less than 100: 62 for the BVH, 18 for a
/// triangle and half a vertex, and another 18 for their copy relative to the bake's origin.
inline constexpr MemoryNeed kMemoryToBake{140, 100};
/// Simplification of 10 million triangles to 5,000 took 240 bytes per triangle: 160 for the data of the simplification
/// itself, 18 for the mesh.
inline constexpr MemoryNeed kMemoryToSimplify{240, 178};
/// Simplification within an error is refused unless 320 bytes per triangle are left, and 80 more for each of the first
/// 300,000 triangles.
inline constexpr MemoryNeed kMemoryToSimplifyWithinError{420, 178};

/// Ends a sentence about the high poly: states that an option needs the whole mesh in memory, with a remedy.
Message explain_whole_mesh_need(const Message& what);
/// Variant of explain_whole_mesh_need() for the options of reading and repairing that bakes and `kiln simplify` share;
/// empty if none is given.
Message find_reading_obstacle(const MeshFrameArguments& frame, double fill_holes);

/// Facts about a mesh file that follow from its first bytes and its size.
struct LargeFile {
  std::uint64_t triangles = 0;  ///< 0 if the number is unknown
  bool has_normals = false, has_pictures = false;
  std::string obstacle;  ///< Why the file cannot be read in pieces; see PlyLayout::obstacle
};

/// How a high poly that is larger than memory is read.
struct StreamedReading {
  Triangulation triangulation = Triangulation::automatic;  ///< Rule for polygons
  bool keep_hulls = false;  ///< Keeps what drop_hidden_hulls() would remove
};

/// Opens a high poly that is larger than memory. Null if it fits into memory, or if it may fit and the whole mesh is
/// needed.
/// \param find_obstacle  returns why the whole mesh is needed, as explain_whole_mesh_need() does; empty if it is not
///                       needed. Called only for a high poly that does not fit; called again when the file has been
///                       read, if its first bytes do not say what LargeFile holds
/// \throws OptionError if the whole mesh is needed and cannot fit
std::shared_ptr<const MeshStream> open_larger_than_memory(
    const std::string& path, const MemoryNeed& need, const StreamedReading& reading,
    const std::function<Message(const LargeFile& high)>& find_obstacle);

/// Reduces a mesh that is larger than memory to a mesh in memory from which a low poly of `faces` triangles can be
/// made.
Mesh reduce(const ChunkedMesh& mesh, std::uint32_t faces);

/// A line of the summary. \param normals  which normals are used, such as "smooth"
std::string streaming_line(const std::string& normals);

/// States which normals a streamed high poly has: those of its file, or smooth ones.
ShadingReport shading_of(const MeshStream& streamed);

}  // namespace kiln
