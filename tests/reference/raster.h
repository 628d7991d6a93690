// Oracle for depth views: every pixel against every triangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kernels_shared.h"

namespace kiln::test {

struct ReferencePixel {
  std::uint32_t triangle = KILN_NO_TRIANGLE;
  double depth = 0;      ///< KILN_RASTER_FAR - dot(toward, p)
  double second = 1e30;  ///< Depth of the next nearest triangle at the pixel
};

/// Vertices are snapped to 1/256 of a pixel as kernels/shared/raster.h says; coverage is exact in integers;
/// depths are in double precision. Back faces are left out but with KILN_RASTER_TWO_SIDED.
std::vector<ReferencePixel> reference_raster(const kiln_view& view, std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles);

}  // namespace kiln::test
