#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Position and extent of a height field: in the plane z = 0 around the origin, heights along +Z.
struct HeightFieldOptions {
  /// Extent along X, world units. 0: computed from `depth` by the image's aspect ratio; if both are
  /// 0, the longer side is 1
  double width = 0;
  /// Extent along Y, world units; 0: computed from `width` by the image's aspect ratio
  double depth = 0;
  double height = 1;  ///< Height in world units of the value 1 (white in a PNG); may be negative
  /// Value of pixels without a height, as the file stores it; none: the file's own marker. Functions that read files
  /// pass it to mark_no_data().
  std::optional<double> no_data = {};
  /// If neither a value nor a marker of the file is given: detect customary markers, see
  /// mark_no_data()
  bool guess_no_data = true;
};

/// Heights from a file, with its metadata.
struct Heights {
  Image image = {};    ///< Heights in the first channel
  double largest = 1;  ///< Number in the file that means a height of 1: 65535 for a 16-bit PNG
  std::optional<double> no_data =
      {};  ///< The file's own marker of pixels without a height (GDAL_NODATA)
  std::array<double, 2>
      spacing{};  ///< Distance between columns and between rows, in the heights' unit; 0: unknown
};

/// Reads heights: any picture that load_image() reads, and TIFFs. Floats and signed integers of a TIFF are heights;
/// so are unsigned ones if it has GeoTIFF or GDAL tags (else they become [0, 1], as for PNG). A GeoTIFF's pixel
/// spacing in degrees is converted to metres at its latitude, with the warning "spacing-in-degrees".
/// \throws Error(input) as load_image()
Heights load_heights(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// Report of mark_no_data().
struct NoData {
  std::uint64_t pixels = 0;  ///< Number of pixels without a height, including NaN
  /// Values that marked missing heights, as the file stores them; NaN and infinity are not listed
  std::vector<double> values = {};
  /// A value that may mark missing heights: its distance from all other heights exceeds the range
  /// of these heights
  std::optional<double> doubtful = {};
};

/// Replaces pixels without a height by NaN: those that are not finite, that hold `value`, or the file's own marker. If
/// neither is given, also a customary marker (-9999, -32768, the lowest float and the like) whose
/// distance from all heights exceeds the range of the heights.
/// \param value  as the file holds it: white of a 16-bit PNG is 65535
/// \param guess  false: no customary markers
NoData mark_no_data(Heights& heights, std::optional<double> value = {}, bool guess = true);

/// The high poly of an image of heights, for terrains and walls: one vertex per pixel, two triangles per cell.
///
/// Pixels are points: the outermost ones lie on the border, so that (columns - 1) x (rows - 1) cells span `width` x
/// `depth`. Row 0 is at the largest y. UVs are those of the plane: u along +X and v along +Y over the unit square.
/// Cells are cut from their lower left to their upper right corner. It has no normals; they are computed when
/// needed. Triangles at a non-finite value are left out, so that holes remain. The image is read during the call.
/// Thread safety of all functions here: may be called from several threads, each with a mesh of its own.
/// \param image  1 channel, or more of which the first counts; 2 x 2 pixels or more
/// \throws Error(usage) for extents that are not finite or below 0; Error(input) for an image that
///         is too small, or has no three finite values side by side
Mesh height_field_mesh(const Image& image, const HeightFieldOptions& options = {});

/// A flat low poly for a height field: a rectangle of two triangles in z = 0 with the same extent and
/// layout.
Mesh height_field_plane(const Image& image, const HeightFieldOptions& options = {});

/// Gives a mesh over a height field, such as a simplified one, the UVs of the height field: u by x
/// and v by y. Existing UVs are replaced.
void lay_out_over_height_field(Mesh& mesh, const Image& image,
                               const HeightFieldOptions& options = {});

}  // namespace kiln
