// Cuts a mesh into chunks for kernels/accel/tiles.cl.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln {

/// A part of a mesh, to be stored one after the other.
struct RasterChunks {
  std::vector<kiln_raster_chunk> chunks;  ///< 16 for each of `bounds`; the last may be empty
  std::vector<kiln_raster_bounds> bounds;
  double area = 0;       ///< Of its triangles
  double diagonals = 0;  ///< Squared, of its chunks' boxes
};

/// Cuts a mesh so that every triangle whose vertices are finite is in one chunk: in the mesh's own
/// order where that keeps neighbours together. Else along a Morton curve of the triangles'
/// centroids (Morton 1966, "A computer oriented geodetic data base"). The same mesh gives the same
/// chunks on any number of threads.
/// \param positions  within 0.5 of the origin; what lies beyond is cut, too, but not as well
std::vector<RasterChunks> make_raster_chunks(std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles);

}  // namespace kiln
