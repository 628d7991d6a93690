// Cuts a mesh into chunks for kernels/accel/tiles.cl.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln {

/// False for vertices that depth views ignore, together with their triangles: non-finite ones, and those that Frame
/// excludes from its box as outliers. All others of a source lie within kMaxCoordinate of the frame's centre.
inline bool is_in_views(const Vec3& p) {
  constexpr float kMaxCoordinate = 4;
  return std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate &&
         std::abs(p.z) <= kMaxCoordinate;
}

/// Some of a mesh's chunks, cut by one task; the results of all tasks are concatenated.
struct RasterChunks {
  /// 16 chunks per element of `bounds`; unused chunks at the end are empty
  std::vector<kiln_raster_chunk> chunks;
  std::vector<kiln_raster_bounds> bounds;
  double area = 0;       ///< Sum of its triangles' areas
  double diagonals = 0;  ///< Sum of the squared diagonals of its chunks' boxes
};

/// Cuts a mesh so that every triangle whose vertices are all in views is in one chunk: in the mesh's own
/// order if that keeps neighbours together, else along a Morton curve of the triangles' centroids
/// (Morton 1966, "A computer oriented geodetic data base"). The same mesh gives the same chunks on any
/// number of threads.
/// \param positions within 0.5 of the origin; triangles outside are cut, too, but into less compact chunks
std::vector<RasterChunks> make_raster_chunks(std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles);

}  // namespace kiln
