// Draws depth and triangle ids by OpenGL, off screen through EGL, as the peer of the rasteriser.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln::bench {

/// A surfaceless OpenGL 3.3 core context, with the mesh in buffers, and a picture of 32-bit depth and unsigned ids.
class GlPeer {
 public:
  /// Creates the context. \throws std::runtime_error if that fails
  GlPeer(std::span<const Vec3> positions, std::span<const Triangle> triangles, std::uint32_t size);
  ~GlPeer();
  GlPeer(GlPeer&&) noexcept;

  std::string renderer() const;
  /// Clears and draws all views, one after the other, and waits until they are finished.
  void draw(const std::vector<kiln_view>& views);
  /// Triangle ids of the last view, rows from the top: 0 for the background, else triangle + 1.
  std::vector<std::uint32_t> ids() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln::bench
