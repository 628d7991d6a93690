// Sets the directions of texel samples: the low poly's own normals, blended with averaged normals near hard
// edges.
#pragma once

#include <span>
#include <vector>

#include "cl/context.h"
#include "mesh/hard_edges.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// The default-constructed object leaves directions unchanged. kernels/texel/turn.cl describes the field of directions.
class EdgeTurn {
 public:
  EdgeTurn() = default;
  /// \param widths blend width of each hard edge, frame units, above 0; empty: directions are the mesh's own
  /// normals
  EdgeTurn(cl::Context& context, const LowSurface& surface, const HardEdges& hard,
           std::span<const float> widths);
  /// Blends directions by weights that are painted in the mesh's colours (LowSurface::Corner::straight).
  EdgeTurn(cl::Context& context, const LowSurface& surface);

  bool turns() const { return turns_; }
  /// Sets the directions of a newly sampled band; must be called once.
  void apply(cl::Context& context, TexelBand& band) const;

 private:
  EdgeTurn(cl::Context& context, const LowSurface& surface, const std::vector<float>& edges,
           const std::vector<std::uint32_t>& first, bool painted);

  bool turns_ = false, painted_ = false;
  cl::Array<float> normals_, weights_, edges_;
  cl::Array<std::uint32_t> first_edges_;
};

}  // namespace kiln
