// The BVH of the low poly, for rays and nearest-point queries.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "accel/device_bvh.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"

namespace kiln {

/// The usable triangles of a low poly, each with its own corners, and their BVH.
struct LowTree {
  std::vector<Vec3> positions;      ///< Three per triangle
  std::vector<Triangle> triangles;  ///< Corners as indices into `positions`
  std::vector<std::uint32_t> of;    ///< Index of each triangle in the surface
  std::vector<Vec3d> normals;       ///< Unit normals
  std::shared_ptr<const Tree> tree;

  /// The tree of a surface, built at the first call and stored in it (LowSurface::made). May be called from
  /// several threads.
  static std::shared_ptr<const LowTree> of_surface(cl::Context& context, const LowSurface& surface);
};

}  // namespace kiln
