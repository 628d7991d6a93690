// Depth views of the dense mesh: software z-buffer with triangle ids.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "geometry/vector.h"
#include "kernels_shared.h"
#include "kiln/types.h"

namespace kiln {

/// An orthographic view that shows everything within `radius` of the frame's origin.
/// \param toward  unit, from the mesh to the viewer
/// \param size    pixels a side, 1 to KILN_RASTER_LARGEST
kiln_view make_view(const Vec3d& toward, double radius, std::uint32_t size);

/// Draws keys of depth and triangle (kernels/raster.cl). Which triangle a pixel shows is a function of
/// mesh and view alone: the nearest; of equally near ones the lowest.
class Rasterizer {
 public:
  /// Uploads the mesh. Faces with a vertex that is not finite are not drawn.
  /// \param positions  in the working frame (within 0.5 of the origin)
  /// \param two_passes  as where the device has no 64-bit atomics: the same picture, slower
  Rasterizer(cl::Context& context, std::span<const Vec3> positions,
             std::span<const Triangle> triangles, bool two_passes = false);

  /// Clears the view's pixels within `keys` and draws. Back faces are left out but with
  /// KILN_RASTER_TWO_SIDED.
  void draw(const kiln_view& view, const cl::Array<std::uint64_t>& keys);

  std::uint64_t triangle_count() const { return triangle_count_; }
  /// Radius around the origin of all finite vertices that triangles use.
  double radius() const { return radius_; }
  const cl::Array<std::uint32_t>& triangles() const { return triangles_; }
  const cl::Array<float>& positions() const { return positions_; }

 private:
  cl::Context& context_;
  std::uint32_t vertex_count_ = 0;
  std::uint32_t triangle_count_ = 0;
  double radius_ = 0;
  bool atomic64_ = false;
  cl::Array<float> positions_;           // [3 * vertices]
  cl::Array<std::uint32_t> triangles_;   // [3 * triangles]
  cl::Array<std::int32_t> projected_;    // [4 * vertices]
  cl::Array<std::uint32_t> queue_size_;  // [1]
  cl::Array<std::uint32_t> queue_;       // [4 * triangles]
};

}  // namespace kiln
