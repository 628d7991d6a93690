// Smooth interpolation of unknown texels.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/image_data.h"

namespace kiln {

/// Fills texels by push-pull (Grossman and Dally, "Point Sample Rendering", 1998, section 3.3; Gortler et al., "The
/// Lumigraph", 1996, section 3.4).
///
/// Push: each texel of a coarser level gets the average of the known texels among the 2 x 2 finer
/// ones under it. Pull, starting at the coarsest level: an unknown texel gets the bilinear
/// interpolation, with weights (9, 3, 3, 1)/16, of the four nearest texels of the next coarser
/// level. Nothing wraps at the borders. The order of sums is fixed, so the result does not depend
/// on the number of threads. Temporary memory: a third of the image's.
///
/// \param known   per texel: 1 if the value is known, otherwise 0
/// \param is_wanted  per texel: 1 if an unknown value is to be written, otherwise 0; all others stay unchanged
/// \param unit_vectors  true: the first (up to three) channels are a vector, whose averages are normalized. If an
///     average vanishes, the first known value (push) or the nearest value (pull) replaces it
/// \returns false if no texel is known; in this case, the image is unchanged
bool push_pull(Image& image, std::span<const std::uint8_t> known,
               std::span<const std::uint8_t> is_wanted, bool unit_vectors);

}  // namespace kiln
