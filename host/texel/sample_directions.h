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

/// Sets the directions of samples: the low poly's normals, blended near hard edges;
/// kernels/texel/turn.cl describes the blending. A default-constructed object leaves directions
/// unchanged.
class SampleDirections {
 public:
  SampleDirections() = default;
  /// \param widths blend width of each hard edge, in frame units, above 0. If empty, directions are the mesh's own
  ///     normals
  SampleDirections(cl::Context& context, const LowSurface& surface, const HardEdges& hard,
                   std::span<const float> widths);
  /// Blends directions by weights that are painted in the mesh's colours (LowSurface::Corner::straight).
  SampleDirections(cl::Context& context, const LowSurface& surface);

  bool blends_directions() const { return blends_directions_; }
  /// Sets the directions of a newly sampled band; must be called once.
  void set_directions(cl::Context& context, TexelBand& band) const;

 private:
  SampleDirections(cl::Context& context, const LowSurface& surface, const std::vector<float>& edges,
                   const std::vector<std::uint32_t>& first, bool painted);

  bool blends_directions_ = false, painted_ = false;
  cl::Array<float> normals_, weights_, edges_;
  cl::Array<std::uint32_t> first_edge_of_triangle_;
};

}  // namespace kiln
