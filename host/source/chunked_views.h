// Depth views of a high poly that is larger than memory.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "accel/raster.h"
#include "source/chunked_mesh.h"

namespace kiln {

/// Draws the mesh in parts of as many consecutive triangles as a chunk has. A pixel's key is the least of all parts' keys
/// (kernels/accel/keys.cl), so views equal those of the whole mesh, bit by bit. Parts follow the order of the file, since
/// every view shows all of the mesh, and since views also draw triangles that chunks lack: those whose area vanishes in
/// space may have one on the screen, where vertices are snapped.
///
/// Each draw() reads the triangles once, whatever the number of views. Views whose keys and triangles fit into half of
/// the memory that is left are drawn at once (views_at_once()), which is the least reading.
class ChunkedViews : public ViewedSurface {
 public:
  ChunkedViews(cl::Context& context, std::shared_ptr<const ChunkedMesh> mesh);

  double radius() const override { return radius_; }
  void draw(std::span<const kiln_view> views, const DepthKeys& keys) override;
  /// The triangles that views show, and no others.
  std::shared_ptr<const ShownTriangles> show(DepthKeys& keys) override;
  std::uint32_t views_at_once(std::uint32_t size) const override;

 private:
  cl::Context& context_;
  std::shared_ptr<const ChunkedMesh> mesh_;
  double radius_ = 0;
};

}  // namespace kiln
