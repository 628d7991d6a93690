// Turns the directions of texel samples: along the light mesh's own normals, and at its hard edges averaged.
#pragma once

#include "cl/context.h"
#include "kiln/match.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Does nothing for RayDirection::averaged, for meshes without hard edges, and with a cage mesh. See
/// kernels/texel/turn.cl for the field.
class EdgeTurn {
 public:
  EdgeTurn() = default;
  /// \param width  frame units, above 0
  EdgeTurn(cl::Context& context, const LowSurface& surface, RayDirection direction, double width);

  bool turns() const { return width_ > 0; }
  /// Of a band that was just sampled, once.
  void apply(cl::Context& context, TexelBand& band) const;

 private:
  float width_ = 0;  ///< 0: nothing turns
  cl::Array<float> normals_, edges_;
  cl::Array<std::uint32_t> first_edges_;
};

}  // namespace kiln
