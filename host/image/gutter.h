// Padding: fills texels outside of charts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/image_data.h"
#include "kiln/types.h"

namespace kiln {

/// Coverage of a texel, as BakeResult::coverage holds it.
enum Coverage : std::uint8_t {
  kCoverageEmpty = 0,
  kCoverageBaked = 1,
  kCoverageMissed = 2,
  kCoverageGutter = 3,
};

struct GutterOptions {
  /// Width of the padding in texels; values above 16384 count as 16384; 0: no padding; -1: unlimited (push-pull)
  std::int32_t texels = kPaddingTexels;
  bool fill_missed = false;   ///< Also fill texels marked missed, at any distance from a baked one
  bool unit_vectors = false;  ///< True if the values are vectors, so that averages are normalized
};

/// Fills empty texels near charts in place and marks them kCoverageGutter.
///
/// With a finite width, an empty texel copies the value of the nearest baked texel, at most
/// `texels` away (Euclidean distance between centres, ties to the lowest row, then column). With
/// -1, all empty texels are filled by push-pull (Grossman and Dally 1998; Gortler et al. 1996)
/// after those next to charts have got the nearest value. Baked texels never change. If missed
/// texels are filled, they get push-pull values from baked ones and stay marked missed; otherwise
/// they count as baked. The nearest texels are found on the device (kernels/image/image.cl),
/// exactly, in bands of rows; values are copied and averaged on the host's threads. Nothing wraps
/// around the image's sides. The result is the same on every device and with any number of threads.
/// If nothing is baked, nothing changes.
/// \returns number of texels that became padding
/// \throws Error(usage) for a width below -1, Error(device)
std::uint64_t fill_gutter(cl::Context& context, Image& image, std::span<std::uint8_t> coverage,
                          const GutterOptions& options);

/// One of several images with the same charts.
struct GutterImage {
  Image* image = nullptr;
  bool unit_vectors = false;  ///< Replaces GutterOptions::unit_vectors for this image
};

/// Fills several images of equal size and coverage; nearest texels are searched once.
std::uint64_t fill_gutters(cl::Context& context, std::span<const GutterImage> images,
                           std::span<std::uint8_t> coverage, const GutterOptions& options);

/// Rows [first, last) of an image.
struct RowRange {
  std::uint32_t first = 0, last = 0;
};

/// Does the work of fill_gutters() for some rows of the images, without filling missed texels. Rows within `texels` of
/// them are read, also where they were filled before, and stay unchanged. So a map can be padded row by row.
/// \param texels  width of the padding
std::uint64_t fill_gutter_rows(cl::Context& context, std::span<const GutterImage> images,
                               std::span<std::uint8_t> coverage, std::uint32_t texels,
                               const RowRange& rows);

}  // namespace kiln
