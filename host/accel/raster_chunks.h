// Cuts a mesh into chunks for kernels/accel/tiles.cl.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln {

/// False for vertices that views ignore, with their triangles: non-finite, or farther from the frame's centre than any
/// source's, except for vertices that Frame excludes from its box.
inline bool is_in_views(const Vec3& p) {
  constexpr float kReach = 4;
  return std::abs(p.x) <= kReach && std::abs(p.y) <= kReach && std::abs(p.z) <= kReach;
}

/// A part of a mesh's chunks; parts are concatenated.
struct RasterChunks {
  std::vector<kiln_raster_chunk> chunks;  ///< 16 per element of `bounds`; padding chunks are empty
  std::vector<kiln_raster_bounds> bounds;
  double area = 0;       ///< Sum of its triangles' areas
  double diagonals = 0;  ///< Sum of the squared diagonals of its chunks' boxes
};

/// Cuts a mesh so that every triangle whose vertices are all in views is in one chunk: in the mesh's own
/// order if that keeps neighbours together, else along a Morton curve of the triangles' centroids
/// (Morton 1966, "A computer oriented geodetic data base"). The same mesh gives the same chunks on any
/// number of threads.
/// \param positions  within 0.5 of the origin; triangles beyond are cut, too, but less compactly
std::vector<RasterChunks> make_raster_chunks(std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles);

}  // namespace kiln
