// Ray casts and nearest-point searches on a high poly in chunks: each chunk is searched separately, and the results are
// merged by the rules that a search follows within one BVH. The result equals that of a search of the whole mesh, bit
// by bit.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "accel/closest.h"
#include "accel/ray.h"
#include "source/chunked_mesh.h"

namespace kiln {

/// The chunks in memory, each with its BVH. Chunks stay in memory as long as they occupy at most half of the memory
/// limit.
class LoadedChunks {
 public:
  struct Chunk {
    ChunkTriangles triangles;
    std::shared_ptr<const Tree> tree;  ///< Null if there are no triangles
  };

  LoadedChunks(cl::Context& context, std::shared_ptr<const ChunkedMesh> mesh)
      : context_(context), mesh_(std::move(mesh)), kept_(mesh_->size()) {}

  cl::Context& context() const { return context_; }
  const ChunkedMesh& mesh() const { return *mesh_; }
  const std::shared_ptr<const ChunkedMesh>& shared_mesh() const { return mesh_; }
  /// Loads a chunk, and builds its BVH.
  std::shared_ptr<const Chunk> load(std::size_t chunk) const;
  /// Loads only those triangles of a chunk that lie near one of the boxes, and builds their BVH. This is much faster if
  /// they are few. The result may have no triangles. \param boxes for each search, a box that contains all points that
  /// it can reach
  std::shared_ptr<const Chunk> load_near(std::size_t chunk, std::span<const Box<Vec3>> boxes) const;
  /// Frees all chunks that no search is using.
  void forget() const;
  /// Seconds spent so far on loading chunks and building BVHs.
  double seconds() const;

 private:
  cl::Context& context_;
  std::shared_ptr<const ChunkedMesh> mesh_;
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const Chunk>> kept_;
  mutable double seconds_ = 0;
};

class ChunkedRays : public RaySearch {
 public:
  ChunkedRays(std::shared_ptr<const LoadedChunks> chunks, Traversal traversal)
      : chunks_(std::move(chunks)), traversal_(traversal) {}
  void intersect(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                 const RayQuery& query, DeviceCorrespondence& result) const override;
  /// The parts are the chunks.
  void for_each_part(const std::function<void(const RayCaster&)>& use) const override;

 private:
  std::shared_ptr<const LoadedChunks> chunks_;
  Traversal traversal_;
};

class ChunkedClosest : public ClosestSearch {
 public:
  ChunkedClosest(std::shared_ptr<const LoadedChunks> chunks, Traversal traversal)
      : chunks_(std::move(chunks)), traversal_(traversal) {}
  void find(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
            const ClosestQuery& query, DeviceCorrespondence& result) const override;

 private:
  std::shared_ptr<const LoadedChunks> chunks_;
  Traversal traversal_;
};

}  // namespace kiln
