// Cuts a mesh into chunks for kernels/accel/tiles.cl.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln {

/// False for vertices that views leave out, with their triangles: such as are not finite, or lie farther from the frame's
/// middle than those of any source, but for what Frame leaves out of its box.
inline bool is_in_views(const Vec3& p) {
  constexpr float kReach = 4;
  return std::abs(p.x) <= kReach && std::abs(p.y) <= kReach && std::abs(p.z) <= kReach;
}

/// A part of a mesh, to be stored one after the other.
struct RasterChunks {
  std::vector<kiln_raster_chunk> chunks;  ///< 16 for each of `bounds`; the last may be empty
  std::vector<kiln_raster_bounds> bounds;
  double area = 0;       ///< Sum over its triangles
  double diagonals = 0;  ///< Squared, of its chunks' boxes
};

/// Cuts a mesh so that every triangle whose vertices are all in views is in one chunk: in the mesh's own
/// order where that keeps neighbours together. Else along a Morton curve of the triangles'
/// centroids (Morton 1966, "A computer oriented geodetic data base"). The same mesh gives the same
/// chunks on any number of threads.
/// \param positions  within 0.5 of the origin; what lies beyond is cut, too, but not as well
std::vector<RasterChunks> make_raster_chunks(std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles);

}  // namespace kiln
