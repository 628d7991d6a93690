// Maps and masks as files hold them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "kiln/image.h"

namespace kiln {

/// Reads a normal map as n/2 + 1/2 in three channels. Kiln's other two forms are recognised and decoded:
/// components in [-1, 1] (some are negative) and two components (the third is 0 everywhere, so
/// z = sqrt(1 - x^2 - y^2)). \throws Error(input)
Image load_normal_map(const std::filesystem::path& path);

/// Reads a map of curvature, one channel, n/2 + 1/2 with n from -1 (concave) to 1 (convex). 1 is what 95%
/// of the texels that bend do not exceed. So neither units matter nor the range of a PNG, where 1/2 is
/// flat. Texels bend above a 255th of the strongest one. \throws Error(input), also for a map with colours
Image load_bend(const std::filesystem::path& path);

/// Reads a mask: an image, whose first channel counts; or a saved match, whose samples count 1
/// where they found a point, else 0. \throws Error(input)
Image load_mask(const std::filesystem::path& path);

/// Description of a file's values. \param ranges  of each channel: values at 0 and 1; none: as they are
std::vector<ImageText> texts_of(const SaveImageOptions& options,
                                const std::vector<ValueRange>& ranges, const std::string& unit);

}  // namespace kiln
