// The BVH of the high poly on the device, shared by rays and nearest-point queries.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "accel/bvh.h"
#include "cl/context.h"
#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln {

/// Variants of the traversal kernels. All give the same bits.
enum class Traversal {
  automatic,  ///< One of the others, chosen by the type of the device and its driver
  cpu,  ///< Kernels of explicit vectors, for PoCL: trace neighbouring rays as beams, any-hit rays as streams
  /// As `cpu`, for drivers other than PoCL: traces any-hit rays one by one, testing 8 boxes at a time
  cpu_single,
  gpu,  ///< Scalar, one ray per work-item
};

/// Resolves `automatic` and `cpu` for a device; never returns `automatic`.
Traversal choose_traversal(const cl::Context& context, Traversal requested);

/// A bounding volume hierarchy in the device's memory. Immutable except for refit(). The host builds it, or the device
/// where Tuning says so; results of searches do not depend on it.
struct Tree {
  /// \param positions  in the working frame: about unit size
  /// \throws Error(device) if the device has too little memory
  /// \param keep keep the data that refit() needs on the host: as many bytes as on the device
  Tree(cl::Context& context, std::span<const Vec3> positions, std::span<const Triangle> triangles,
       bool keep = false);

  struct Stats {
    std::uint64_t triangles = 0;
    std::uint64_t skipped = 0;  ///< Triangles that are non-finite or without area
    /// Triangles equal to one of a lower index, which represents them
    std::uint64_t duplicates = 0;
    std::uint64_t nodes = 0;
    std::uint64_t bytes = 0;     ///< Size on the device
    double leaves_per_line = 0;  ///< Copy of Bvh::leaves_per_line
    bool built_on_device = false;
    double build_seconds = 0;
    double upload_seconds = 0;
  };

  /// Creates a tree that was built before. \param fill writes all nodes and leaves into the device's
  /// arrays
  Tree(cl::Context& context, const Stats& stats, bool has_prisms, std::size_t node_count,
       std::size_t block_count,
       const std::function<void(std::span<kiln_bvh_node>, std::span<kiln_bvh_block>)>& fill);

  /// Refits boxes and leaves to moved positions; the topology is kept. Searches give the same
  /// results as with a new tree, but slow down as triangles of a leaf move apart. Degenerate
  /// triangles must stay degenerate, and all others must keep an area above 0. Takes a tenth of
  /// the build time.
  void refit(cl::Context& context, std::span<const Vec3> positions,
             std::span<const Triangle> triangles);

  /// The -D options of programs that traverse this tree only, followed by `extra_defines`.
  std::string defines(const std::string& extra_defines = {}) const;

  /// True if some nodes have bounding prisms.
  bool has_prisms() const { return has_prisms_; }

  Stats stats;
  cl::Array<kiln_bvh_node> nodes;
  cl::Array<kiln_bvh_block> blocks;

 private:
  std::unique_ptr<Bvh> refit_copy_;
  bool has_prisms_ = false;
};

}  // namespace kiln
