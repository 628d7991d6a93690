// The hierarchy of the low poly, for rays that may meet it and for nearest points on it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "accel/device_bvh.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"

namespace kiln {

/// The usable triangles of a low poly, each with corners of its own, and their hierarchy.
struct LowTree {
  std::vector<Vec3> positions;      ///< Three a triangle
  std::vector<Triangle> triangles;  ///< Indices of these positions
  std::vector<std::uint32_t> of;    ///< The surface's triangle of each
  std::vector<Vec3d> normals;       ///< Unit
  std::shared_ptr<const Tree> tree;

  /// The tree of a surface: made when first asked for, and kept with it (LowSurface::made). May be called from
  /// several threads.
  static std::shared_ptr<const LowTree> of_surface(cl::Context& context, const LowSurface& surface);
};

}  // namespace kiln
