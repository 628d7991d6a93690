#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kiln/error.h"
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
  std::optional<double> no_data = {};  ///< As mark_no_data() has it; what reads files obeys it
  bool guess_no_data = true;           ///< The same
};

/// Heights as a file holds them, and what it says of them.
struct Heights {
  Image image = {};    ///< The first channel counts
  double largest = 1;  ///< What a value of 1 stands for in the file: of a PNG of 16 bits 65535
  std::optional<double> no_data =
      {};  ///< The file's own number for pixels without a height (GDAL_NODATA)
  std::array<double, 2>
      spacing{};  ///< From column to column and row to row, in the heights' unit; 0: not said
};

/// Reads heights: any picture that load_image() reads, and TIFFs whose numbers are heights: floats and signed numbers
/// as they are, unsigned ones, too, where tags of GeoTIFF or GDAL are there (else in [0, 1], as those of PNG). A
/// GeoTIFF says its pixels' distance: one in degrees is taken as metres at its latitude, with the warning
/// "spacing-in-degrees".
/// \throws Error(input) as load_image()
Heights load_heights(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// Report of mark_no_data().
struct NoData {
  std::uint64_t pixels = 0;  ///< Pixels without a height, NaN among them
  std::vector<double> values =
      {};  ///< Numbers that stood there, as the file holds them; NaN and infinite ones are none
  std::optional<double> doubtful =
      {};  ///< A number farther from all others than these from each other: perhaps none
};

/// Makes pixels without a height NaN: those that are not finite, that hold `value`, or the file's own number; or, where
/// neither is given, one that programs write there (-9999, -32768, the lowest float and the like) and that is farther
/// from all heights than these are from each other.
/// \param value  as the file holds it, so that white of a PNG of 16 bits is 65535
/// \param guess  false: but for `value`, nothing finite is none
NoData mark_no_data(Heights& heights, std::optional<double> value = {}, bool guess = true);

/// The high poly of an image of heights, for terrains and walls: a vertex a pixel, two triangles a cell.
///
/// Pixels are points: the outermost ones lie on the border, so that (columns - 1) x (rows - 1) cells span
/// `width` x `depth`. Row 0 is at the largest y. UVs are those of the plane: u along +X and v along +Y over
/// the unit square. Cells are cut from their lower left to their upper right corner. No normals: computed
/// when needed. Where a value is not finite, its triangles are left out: a hole. The image is read during the call.
/// Thread safety of all functions here: may be called from several threads, each with a mesh of its own.
/// \param image  1 channel, or more of which the first counts; 2 x 2 pixels or more
/// \throws Error(usage) for extents that are not finite or below 0; Error(input) for an image that
///         is too small, or has no three finite values side by side
Mesh height_field_mesh(const Image& image, const HeightFieldOptions& options = {});

/// The low poly of a height field that is none: a rectangle of two triangles in z = 0 under the whole of
/// it, with the same layout.
Mesh height_field_plane(const Image& image, const HeightFieldOptions& options = {});

/// Gives a mesh over a height field, such as a simplified one, the field's layout: UVs by x and y.
/// Replaces what UVs it had.
void lay_out_over_height_field(Mesh& mesh, const Image& image,
                               const HeightFieldOptions& options = {});

}  // namespace kiln
