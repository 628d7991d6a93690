// The detail family's oracle: one sample in double precision, by matrix inversion.
#pragma once

#include <array>

#include "kiln/map.h"
#include "mesh/low_surface.h"

namespace kiln::test {

struct DetailSample {
  std::array<LowSurface::Corner, 3> low;
  double low_u = 0, low_v = 0;
  bool hit = false;
  std::array<Vec3, 3> high_normals;
  double u = 0, v = 0;
};

/// The normal that a sample's map value stands for, components in [-1, 1].
std::array<double, 3> reference_normal(const DetailSample& sample, NormalMapSpace space,
                                       bool flip_y);

}  // namespace kiln::test
