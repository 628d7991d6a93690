// A high poly that is larger than memory: its triangles are stored in chunks of a file, the positions of its vertices
// in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mesh/frame.h"
#include "mesh/mesh_stream.h"
#include "mesh/normals.h"
#include "source/chunk_file.h"

namespace kiln {

/// How a mesh is divided into chunks.
struct ChunkOptions {
  /// Maximum number of triangles in a chunk. With the default, a chunk takes about 200 MB with its BVH, which two
  /// processors build in about a second.
  std::size_t triangles = std::size_t{1} << 20;
  /// Folder of the file; empty: chunk_folder()
  std::filesystem::path folder;
};

/// The folder of chunks and joined vertices: `chunks`, beside that of Kiln's compiled kernels.
std::filesystem::path chunk_folder();

/// Triangles of a chunk, or the triangles that samples have matched, by ascending id.
struct ChunkTriangles {
  std::vector<Triangle> triangles;  ///< Vertices of the whole mesh
  std::vector<std::uint32_t> ids;   ///< Index of each triangle in the whole mesh
};

/// A subset of the mesh's triangles with all attributes that maps read; vertices and triangles keep the mesh's order.
struct MeshPart {
  std::vector<Vec3> positions;  ///< In the working frame
  std::vector<Triangle> triangles;
  /// Normals, equal to those that corner_normals() computes for the whole mesh
  CornerNormals normals;
  std::vector<MeshStream::Color> colors;
};

/// Positions and triangles of a subset of a mesh; vertices and triangles keep the mesh's order.
struct MeshShape {
  std::vector<Vec3> positions;  ///< In the working frame
  std::vector<Triangle> triangles;
};

/// Sorts the triangles by position when it is created, and reads chunks and subsets of triangles. Immutable and
/// thread-safe.
class ChunkedMesh {
 public:
  /// Opens the file of chunks. If there is none, creates it in two passes over the triangles.
  /// \throws Error(input) if nothing can be baked from the mesh, or if its coordinates need more than single precision;
  ///         Error(output) if the file cannot be written
  explicit ChunkedMesh(std::shared_ptr<const MeshStream> mesh, const ChunkOptions& options = {});

  const MeshStream& mesh() const { return *mesh_; }
  const Frame& frame() const { return frame_; }
  std::span<const Vec3> positions() const { return positions_; }  ///< In the working frame
  const ChunkSummary& summary() const { return file_.summary(); }
  bool was_sorted_before() const { return reused_; }
  const Mesh& sample() const { return sample_; }  ///< sample_of()

  std::size_t size() const { return file_.size(); }  ///< Number of chunks
  const Box<Vec3>& box(std::size_t chunk) const { return file_.box(chunk); }
  std::uint64_t records(std::size_t chunk) const { return file_.records(chunk); }
  ChunkTriangles read(std::size_t chunk) const;
  /// Reads the triangles of the given ids, which must ascend.
  std::vector<Triangle> triangles(std::span<const std::uint32_t> ids) const;

  /// Reads consecutive triangles of the mesh, also those that searches ignore.
  MeshShape shape(std::size_t first, std::size_t count) const;
  /// Reads the triangles of the given ids, which must ascend.
  MeshShape shape(std::span<const std::uint32_t> ids) const;
  /// See ChunkOptions::triangles
  std::size_t triangles_per_chunk() const { return triangles_per_chunk_; }

  /// Replaces each triangle id in a list by its rank among the list's distinct ids. KILN_NO_TRIANGLE stays. \returns
  /// the distinct ids, ascending
  std::vector<std::uint32_t> renumber(std::span<std::uint32_t> triangles) const;
  /// Reads the triangles of the given ids with all attributes that maps read. If the mesh has no normals, all of its
  /// triangles are read to compute them.
  MeshPart part(std::span<const std::uint32_t> ids) const;

  /// Reduces one chunk without changing its border. The result's triangles use a subset of the chunk's vertices, whose
  /// positions may have changed.
  using ReduceChunk =
      std::function<void(std::vector<Vec3>& positions, std::vector<Triangle>& triangles)>;
  /// Reduces each chunk, and joins the results to one mesh in memory, in the units of the mesh, with its colours and
  /// without normals. `reduce` is called by several threads with positions in the working frame.
  Mesh reduced(const ReduceChunk& reduce) const;

 private:
  struct ReducedChunk;
  ReducedChunk reduce_one(std::size_t chunk, const ReduceChunk& reduce) const;
  void to_frame();
  void sort(const std::filesystem::path& folder, const std::string& key, std::size_t most);
  std::vector<Vec3> smooth_normals(std::span<const std::uint32_t> vertices,
                                   std::span<const Vec3> places, bool welded) const;

  std::shared_ptr<const MeshStream> mesh_;
  Frame frame_;
  std::vector<Vec3> positions_;
  Mesh sample_;
  ChunkFile file_;
  bool reused_ = false;
  std::size_t triangles_per_chunk_;
};

}  // namespace kiln
