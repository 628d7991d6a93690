// The hierarchy of the high poly on the device, for all who walk it: rays and nearest points.
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

/// Which traversal kernel runs. All give the same answer to the bit.
enum class Traversal {
  automatic,   ///< By the device's type
  cpu,         ///< Explicit vectors: beams of neighbouring rays, streams of any-hit rays (on PoCL)
  cpu_single,  ///< The same, but any-hit rays one by one, 8 boxes a step: `cpu` on other drivers
  gpu,         ///< Scalar, one ray a work-item
};

/// Resolves `automatic` and `cpu` for a device. Never automatic.
Traversal choose_traversal(const cl::Context& context, Traversal wanted);

/// A bounding volume hierarchy, built on the host and uploaded. Immutable but for refit().
struct Tree {
  /// \param positions  in the working frame: about unit size
  /// \throws Error(device) where the device has too little memory
  /// \param keep  what refit() needs stays on the host: as many bytes as on the device
  Tree(cl::Context& context, std::span<const Vec3> positions, std::span<const Triangle> triangles,
       bool keep = false);

  /// Fits boxes and leaves to moved positions; the topology stays. Searches give the same answers
  /// as with a tree built anew. They take longer the farther triangles of a leaf have parted. The
  /// same triangles must have an area as before. A tenth of the time of building it.
  void refit(cl::Context& context, std::span<const Vec3> positions,
             std::span<const Triangle> triangles);

  /// The -D options of programs that walk this tree alone, in front of `more`.
  std::string defines(const std::string& more = {}) const;

  struct Stats {
    std::uint64_t triangles = 0;
    std::uint64_t skipped = 0;     ///< Non-finite or without area
    std::uint64_t duplicates = 0;  ///< The same as another, which answers for them
    std::uint64_t nodes = 0;
    std::uint64_t bytes = 0;   ///< On the device
    double leaves_a_line = 0;  ///< See Bvh
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
