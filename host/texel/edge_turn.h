// Turns the directions of texel samples: along the low poly's own normals, and at its hard edges averaged.
#pragma once

#include <span>
#include <vector>

#include "cl/context.h"
#include "mesh/hard_edges.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// As made by default it does nothing. See kernels/texel/turn.cl for the field.
class EdgeTurn {
 public:
  EdgeTurn() = default;
  /// \param widths  of each hard edge, frame units, above 0; none: directions are the mesh's own normals
  EdgeTurn(cl::Context& context, const LowSurface& surface, const HardEdges& hard,
           std::span<const float> widths);
  /// As the mesh's colours say: LowSurface::Corner::straight.
  EdgeTurn(cl::Context& context, const LowSurface& surface);

  bool turns() const { return turns_; }
  /// Turns the directions of a band that was just sampled, once.
  void apply(cl::Context& context, TexelBand& band) const;

 private:
  EdgeTurn(cl::Context& context, const LowSurface& surface, const std::vector<float>& edges,
           const std::vector<std::uint32_t>& first, bool painted);

  bool turns_ = false, painted_ = false;
  cl::Array<float> normals_, weights_, edges_;
  cl::Array<std::uint32_t> first_edges_;
};

}  // namespace kiln
