// The BVH of the high poly on the device, shared by rays and nearest-point queries.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "accel/bvh.h"
#include "cl/context.h"
#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln {

/// Variants of the traversal kernels. All give the same results to the bit.
enum class Traversal {
  automatic,   ///< By the device's type
  cpu,         ///< Explicit vectors: beams of neighbouring rays, streams of any-hit rays (on PoCL)
  cpu_single,  ///< The same, but single any-hit rays, 8 boxes a step: `cpu` on other drivers
  gpu,         ///< Scalar, one ray per work-item
};

/// Resolves `automatic` and `cpu` for a device. Never automatic.
Traversal choose_traversal(const cl::Context& context, Traversal wanted);

/// A bounding volume hierarchy, built on the host and uploaded. Immutable except for refit().
struct Tree {
  /// \param positions  in the working frame: about unit size
  /// \throws Error(device) if the device has too little memory
  /// \param keep  true: keep the data for refit() on the host, as many bytes as on the device
  Tree(cl::Context& context, std::span<const Vec3> positions, std::span<const Triangle> triangles,
       bool keep = false);

  /// Refits boxes and leaves to moved positions; the topology is kept. Searches give the same
  /// results as with a new tree, but slow down as triangles of a leaf move apart. The same
  /// triangles must have an area as before. Takes a tenth of the build time.
  void refit(cl::Context& context, std::span<const Vec3> positions,
             std::span<const Triangle> triangles);

  /// The -D options of programs that traverse this tree only, followed by `more`.
  std::string defines(const std::string& more = {}) const;

  struct Stats {
    std::uint64_t triangles = 0;
    std::uint64_t skipped = 0;     ///< Triangles that are non-finite or without area
    std::uint64_t duplicates = 0;  ///< Triangles equal to another one, which represents them
    std::uint64_t nodes = 0;
    std::uint64_t bytes = 0;     ///< Size on the device
    double leaves_per_line = 0;  ///< Copy of Bvh::leaves_per_line
    double build_seconds = 0;
    double upload_seconds = 0;
  };

  Stats stats;
  cl::Array<kiln_bvh_node> nodes;
  cl::Array<kiln_bvh_block> blocks;

 private:
  std::unique_ptr<Bvh> kept_;
  bool has_prisms_ = false;
};

}  // namespace kiln
