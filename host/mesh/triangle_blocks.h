// The triangles of a mesh in blocks, whether they are in memory or in a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "kiln/types.h"
#include "mesh/mesh_stream.h"

namespace kiln {

/// A view of a mesh for loops over all of its triangles. Blocks are the same for a mesh in memory and in a file, so sums
/// over blocks have the same bits.
class TriangleBlocks {
 public:
  static constexpr std::size_t kTrianglesPerBlock = std::size_t{1} << 16;

  TriangleBlocks(std::span<const Vec3> positions, std::span<const Triangle> triangles)
      : positions_(positions), triangles_(triangles), triangle_count_(triangles.size()) {}
  /// \param positions  of all vertices of the streamed mesh
  TriangleBlocks(std::span<const Vec3> positions, const MeshStream& streamed)
      : positions_(positions), streamed_(&streamed), triangle_count_(streamed.triangle_count()) {}

  std::span<const Vec3> positions() const { return positions_; }
  std::size_t triangle_count() const { return triangle_count_; }
  std::size_t size() const {  ///< Number of blocks
    return (triangle_count_ + kTrianglesPerBlock - 1) / kTrianglesPerBlock;
  }

  /// Calls visit(block, triangles) for each block, on all threads.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    parallel_for(triangle_count_, kTrianglesPerBlock, [&](std::size_t begin, std::size_t end) {
      const std::size_t block = begin / kTrianglesPerBlock;
      if (streamed_ == nullptr) {
        visit(block, triangles_.subspan(begin, end - begin));
        return;
      }
      std::vector<Triangle> read(end - begin);
      streamed_->read_triangles(begin, std::span(read));
      visit(block, std::span<const Triangle>(read));
    });
  }

 private:
  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  const MeshStream* streamed_ = nullptr;
  std::size_t triangle_count_;
};

}  // namespace kiln
