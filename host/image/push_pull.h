// Smooth filling of whatever is unknown in an image.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/image.h"

namespace kiln {

/// Fills texels by push-pull (Grossman and Dally, "Point Sample Rendering", 1998, section 3.3; Gortler
/// et al., "The Lumigraph", 1996, section 3.4).
///
/// Push: each coarser level holds the average of the known ones among 2 x 2 texels. Pull, from the
/// coarsest: an unknown texel takes the bilinear interpolation (9, 3, 3, 1)/16 of the coarser
/// level's four nearest texels. Nothing wraps at the borders. The sums' order is fixed: the result
/// does not depend on the number of threads. Takes a third of the image's memory.
///
/// \param known   per texel: 1 where the value counts, else 0
/// \param wanted  per texel: 1 where a value that is not known is to be written, else 0; the rest of the
///                image does not change
/// \param unit_vectors  the first (up to three) channels are a vector: averages are normalised; where
///                they vanish the first known (push) or the nearest (pull) value is taken
/// \returns whether anything was known; else the image is unchanged
bool push_pull(Image& image, std::span<const std::uint8_t> known,
               std::span<const std::uint8_t> wanted, bool unit_vectors);

}  // namespace kiln
