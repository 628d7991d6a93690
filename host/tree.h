// The hierarchy of the dense mesh on the device, for all who walk it: rays and nearest points.
#pragma once

#include <cstdint>
#include <span>

#include "cl/context.h"
#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln {

/// Which traversal kernel runs. All give the same answer to the bit.
enum class Traversal {
  automatic,   ///< By the device's type
  cpu,         ///< Explicit vectors: beams of neighbouring rays, streams of any-hit rays (on PoCL)
  cpu_single,  ///< The same, but any-hit rays one by one, 8 boxes a step: `cpu` on other drivers
  gpu,         ///< Scalar, one ray a work-item
};

/// What `automatic` and `cpu` come to on a device. Never automatic.
Traversal choose_traversal(const cl::Context& context, Traversal wanted);

/// A bounding volume hierarchy, built on the host and uploaded. Immutable.
struct Tree {
  /// \param positions  in the working frame: about unit size
  /// \throws Error(device) where the device has too little memory
  Tree(cl::Context& context, std::span<const Vec3> positions, std::span<const Triangle> triangles);

  struct Stats {
    std::uint64_t triangles = 0;
    std::uint64_t skipped = 0;  ///< Non-finite or without area
    std::uint64_t nodes = 0;
    std::uint64_t bytes = 0;  ///< On the device
    double build_seconds = 0;
    double upload_seconds = 0;
  };

  Stats stats;
  cl::Array<kiln_bvh_node> nodes;
  cl::Array<kiln_bvh_block> blocks;
};

}  // namespace kiln
