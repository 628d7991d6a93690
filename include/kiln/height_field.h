#pragma once

#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Place and extent of a height field: in the plane z = 0 around the origin, heights along +Z.
struct HeightFieldOptions {
  double width =
      0;  ///< Along X, world units. 0: `depth` by the image's sides; both 0: the longer is 1
  double depth = 0;   ///< Along Y, as `width`
  double height = 1;  ///< World units of a value of 1 (PNG: white); may be negative
};

/// The high poly of an image of heights, for terrains and walls: a vertex a pixel, two triangles a cell.
///
/// Pixels are points: the outermost ones lie on the border, so that (columns - 1) x (rows - 1) cells span
/// `width` x `depth`. Row 0 is at the largest y. UVs are those of the plane: u along +X and v along +Y over
/// the unit square. Cells are cut from their lower left to their upper right corner. No normals: computed
/// when needed. The image is read during the call. Thread safety of this and the next two: may be called from
/// several threads, each with a mesh of its own.
/// \param image  1 channel, or more of which the first counts; 2 x 2 pixels or more
/// \throws Error(usage) for extents that are not finite or below 0; Error(input) for an image that
///         is too small, or holds a value that is not finite
Mesh height_field_mesh(const Image& image, const HeightFieldOptions& options = {});

/// The low poly of a height field that is none: a rectangle of two triangles in z = 0 under the whole of
/// it, with the same layout.
Mesh height_field_plane(const Image& image, const HeightFieldOptions& options = {});

/// Gives a mesh over a height field, such as a simplified one, the field's layout: UVs by x and y.
/// Replaces what UVs it had.
void lay_out_over_height_field(Mesh& mesh, const Image& image,
                               const HeightFieldOptions& options = {});

}  // namespace kiln
