// Packs the low poly's polygons as charts of one texture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/mesh.h"
#include "shared/volume.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

struct Atlas {
  std::vector<kiln_volume_chart> charts;
  /// The low poly with UVs and smooth normals; the triangles of each chart are contiguous
  Mesh mesh;
  std::uint64_t texels = 0;  ///< Texels of all charts, including their padding
  /// Texels along the sides of all charts (kiln_volume_chart::first_ring)
  std::uint64_t ring_texels = 0;
  double texels_per_unit = 0;  ///< Texels per world unit
  std::uint32_t border = 0;    ///< Padding around each chart, in texels
};

/// Side in texels of the smallest map that holds all charts and their padding at this density: a
/// multiple of 16; 8192 if they do not fit in that either.
/// \param texels_per_unit  texels per world unit
std::uint32_t find_atlas_size(const SimplifiedIsosurface& low_poly, double texels_per_unit,
                              std::uint32_t border);

/// The low poly's triangles, in the order of Atlas::mesh but without UVs.
Mesh polygon_mesh(const SimplifiedIsosurface& low_poly, const Volume& volume);

/// Packs the polygons as rectangles at the highest density that fits; single triangles are paired if they unfold
/// with little distortion. Corners lie on texel centres, `border` texels from the rectangle's sides, so that
/// bilinear filtering reads only texels of the chart. A rectangle's sides are proportional to the lengths of the
/// polygon's sides.
/// \throws Error(usage) if the map is too small for the number of polygons; Error(input) if that
///   number is a result of keeping the topology
Atlas make_atlas(const SimplifiedIsosurface& low_poly, const Volume& volume, std::uint32_t size,
                 std::uint32_t border);

}  // namespace kiln
