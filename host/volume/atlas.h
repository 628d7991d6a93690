// Charts of the low poly's polygons in one texture.
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
  Mesh mesh;  ///< With UVs and smooth normals; each chart's triangles follow each other
  std::uint64_t texels = 0;       ///< Texels of all charts, with borders
  std::uint64_t ring_texels = 0;  ///< On their sides (kiln_volume_chart::first_ring)
  double texels_per_unit = 0;     ///< Side of the world's unit in texels
  std::uint32_t border = 0;       ///< Border that was kept
};

/// The smallest map, a multiple of 16 texels, that holds the charts at a density, their borders included;
/// 8192 where none does.
/// \param texels_per_unit  side of the world's unit in texels
std::uint32_t atlas_size(const SimplifiedIsosurface& low_poly, double texels_per_unit,
                         std::uint32_t border);

/// The triangles, in the order of Atlas::mesh, without UVs.
Mesh polygon_mesh(const SimplifiedIsosurface& low_poly, const Volume& volume);

/// Packs the polygons as rectangles; single triangles are paired where they unfold well. The corners
/// lie on texel centres, `border` texels in from the rectangle's sides. So bilinear filtering reads
/// the chart's own texels alone. Sides follow the polygon's lengths; as dense as fits.
/// \throws Error(usage) where the polygons are too many for the size; Error(input) where the topology
///         keeps so many
Atlas make_atlas(const SimplifiedIsosurface& low_poly, const Volume& volume, std::uint32_t size,
                 std::uint32_t border);

}  // namespace kiln
