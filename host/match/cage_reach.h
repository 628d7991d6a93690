// Distances from samples to a cage mesh, on which their rays start.
#pragma once

#include <memory>
#include <vector>

#include "accel/ray.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

/// Writes the reach of samples (TexelBand::points, the last plane): the distance along their direction to the
/// outer shell or to the hull. Without a cage mesh it does nothing.
class CageReach {
 public:
  CageReach() = default;
  /// \param surface LowSurface::cage_length is set if the cage is a hull
  /// \throws Error(input) if a hull does not enclose the low poly
  CageReach(cl::Context& context, const Frame& frame, LowSurface& surface);

  bool has_cage_mesh() const { return has_cage_mesh_; }
  /// Writes the reach of a band whose directions are final. \throws Error(input) if a hull does not enclose
  /// the band's samples
  void write_sample_reach(cl::Context& context, TexelBand& band) const;
  /// Distances in world units; nullopt without a cage mesh.
  std::optional<CageReport> report(const LowSurface& surface) const;

 private:
  std::vector<float> write_hull_distances(cl::Context& context, const cl::Array<float>& points,
                                          std::uint32_t count, std::uint32_t capacity) const;

  bool has_cage_mesh_ = false;
  Frame frame_;
  cl::Array<float> outer_shell_heights_;  ///< Heights of the outer shell; see LowSurface::shell
  std::shared_ptr<const CageHull> hull_;
  std::unique_ptr<RayCaster> rays_;
  std::vector<float> hull_distances_;  ///< Distances to a hull, from points all over the low poly
};

}  // namespace kiln
