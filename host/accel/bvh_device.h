// Builds a BVH on the device.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "accel/bvh_prisms.h"
#include "cl/context.h"
#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln::bvh {

/// A tree in the device's memory, in the layout of Bvh. It has no bounding prisms.
struct DeviceParts {
  cl::Array<kiln_bvh_node> nodes;
  cl::Array<kiln_bvh_block> blocks;
  std::uint64_t triangles = 0, skipped = 0, duplicates = 0;  ///< Numbers of triangles, as in Bvh
  std::uint32_t depth = 0;
  double leaves_per_line = 0;  ///< As in Bvh, in single precision
  double upload_seconds = 0;   ///< Time to copy positions and triangles to the device
};

/// Limits beyond which the host must build the BVH. Only tests set others than the defaults.
struct DeviceLimits {
  std::uint32_t depth = KILN_BVH_MAX_DEPTH;
  double leaves_per_line = kMinCrowdedLeaves;
  std::uint64_t bytes =
      ~std::uint64_t{0};  ///< Memory of the device that may be used, besides its own limits
};

/// Builds by kernels/accel/bvh.cl. The tree differs from that of build_bvh(), but holds the same triangles, and its
/// bytes are the same on each run.
///
/// \returns nullopt if the host has to build: no triangle is usable, the tree would be too deep, its leaves are so
/// crowded that it needs bounding prisms, or the device has too little memory (about 180 B per triangle)
/// \throws Error(input) as build_bvh()
/// Cost: O(n); about 400 launches, 40 of which are followed by a read of 4 B.
std::optional<DeviceParts> build_on_device(cl::Context& context, std::span<const Vec3> positions,
                                           std::span<const Triangle> triangles,
                                           const DeviceLimits& limits = {});

}  // namespace kiln::bvh
