// Depth views of the high poly: software z-buffer with triangle ids.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/types.h"
#include "mesh/kernels_shared.h"
#include "mesh/triangle_blocks.h"
#include "mesh/vector.h"

namespace kiln {

/// Makes an orthographic view that shows everything within `radius` of a centre.
/// \param toward  unit, from the mesh to the viewer
/// \param size    pixels a side, 1 to KILN_RASTER_LARGEST
kiln_view make_view(const Vec3d& toward, double radius, std::uint32_t size,
                    const Vec3d& center = {});

/// Keys that combine depth and triangle, on the device: one per pixel, stored tile by tile
/// (kernels/shared/raster.h).
struct DepthKeys {
  DepthKeys() = default;
  /// \param count  number of keys: a multiple of KILN_RASTER_TILE_PIXELS
  DepthKeys(cl::Context& context, std::uint64_t count)
      : keys(context, count), drawn(context, count / KILN_RASTER_TILE_PIXELS) {}

  /// Number of keys of a depth view: its pixels, rounded up to whole tiles.
  static std::uint64_t count(std::uint32_t width, std::uint32_t height) {
    return std::uint64_t{KILN_RASTER_TILES(width)} * KILN_RASTER_TILES(height) *
           KILN_RASTER_TILE_PIXELS;
  }
  /// One view's keys, row by row from the top.
  std::vector<std::uint64_t> picture(cl::Context& context, const kiln_view& view) const;

  cl::Array<std::uint64_t> keys;
  cl::Array<std::uint8_t> drawn;  ///< Per tile: 0 if it is empty and its keys are undefined
};

/// The triangles to which the keys of depth views refer.
struct ShownTriangles {
  cl::Array<std::uint32_t> triangles;  ///< [3 * triangles]
  cl::Array<float> positions;          ///< [3 * vertices]
  cl::Array<std::uint32_t> ids;        ///< Index in the mesh of each triangle; empty: its own index
};

/// A surface of which depth views are drawn. The triangle of a pixel depends on mesh and view alone: it is the nearest
/// one, or among equally near ones the lowest.
class ViewedSurface {
 public:
  ViewedSurface() = default;
  ViewedSurface(const ViewedSurface&) = delete;
  ViewedSurface& operator=(const ViewedSurface&) = delete;
  virtual ~ViewedSurface() = default;

  /// Radius around the origin that contains all finite vertices of triangles that views can show.
  virtual double radius() const = 0;
  /// Clears the views' pixels within `keys` and draws. Back faces are culled without
  /// KILN_RASTER_TWO_SIDED. Threads may draw at the same time, each into its own keys.
  /// \param views  all of one size, side by side within `keys`
  virtual void draw(std::span<const kiln_view> views, const DepthKeys& keys) = 0;
  /// Provides the triangles of drawn keys. It may change the keys' triangles to indices of what it returns; their order
  /// stays. \param keys  all of them drawn
  virtual std::shared_ptr<const ShownTriangles> show(DepthKeys& keys) = 0;
  /// Number of views of this size that should be drawn at once, at most: above 0. Each draw() may read the surface.
  virtual std::uint32_t views_at_once(std::uint32_t /*size*/) const {
    return std::numeric_limits<std::uint32_t>::max();
  }
};

/// Radius around the origin of the part of a mesh that views can show.
double radius_in_views(const TriangleBlocks& mesh);

/// Variants of the rasterisation kernel. All write identical keys.
enum class RasterPath {
  automatic,   ///< The path that is fastest on the device
  tiles,       ///< One work-item per tile: CPUs
  atomics,     ///< One work-item per triangle; 64-bit atomics, on devices with them
  two_passes,  ///< One work-item per triangle and two passes, on devices without 64-bit atomics
};

/// Draws keys of depth and triangle (kernels/accel/raster.cl, tiles.cl).
class Rasterizer : public ViewedSurface {
 public:
  /// Uploads the mesh. Faces with a non-finite vertex are not drawn.
  /// \param positions  in the working frame (within 0.5 of the origin)
  Rasterizer(cl::Context& context, std::span<const Vec3> positions,
             std::span<const Triangle> triangles, RasterPath path = RasterPath::automatic);

  void draw(std::span<const kiln_view> views, const DepthKeys& keys) override;
  /// All triangles of the mesh.
  std::shared_ptr<const ShownTriangles> show(DepthKeys& /*keys*/) override { return mesh_; }

  std::uint64_t triangle_count() const { return triangle_count_; }
  double radius() const override { return radius_; }
  const cl::Array<std::uint32_t>& triangles() const { return mesh_->triangles; }
  const cl::Array<float>& positions() const { return mesh_->positions; }

 private:
  void upload_chunks(std::span<const Vec3> positions, std::span<const Triangle> triangles);
  void draw_tiles(std::span<const kiln_view> views, const DepthKeys& keys);
  void draw_triangles(const kiln_view& view, const DepthKeys& keys);

  cl::Context& context_;
  std::mutex
      drawing_mutex_;  ///< Held while commands that use the mutable arrays below are enqueued
  std::uint32_t vertex_count_ = 0;
  std::uint32_t triangle_count_ = 0;
  double radius_ = 0;
  RasterPath path_;
  std::shared_ptr<ShownTriangles> mesh_ = std::make_shared<ShownTriangles>();
  // Arrays of RasterPath::tiles.
  cl::Array<kiln_raster_chunk> chunks_;
  cl::Array<kiln_raster_bounds> bounds_;      // one per 16 chunks
  cl::Array<kiln_raster_boxes> boxes_;        // [views of a batch * bounds]
  cl::Array<kiln_raster_boxes> group_boxes_;  // [views of a batch * bounds / 16]
  // Arrays that only the raster paths other than RasterPath::tiles use.
  cl::Array<std::int32_t> projected_;    // [4 * vertices]
  cl::Array<std::uint32_t> queue_size_;  // [1]
  cl::Array<std::uint32_t> queue_;       // [4 * triangles]
};

}  // namespace kiln
