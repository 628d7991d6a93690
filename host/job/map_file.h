// Readers of maps and masks from files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kiln/image_format.h"
#include "kiln/map.h"

namespace kiln {

/// Reads a normal map as n/2 + 1/2 in three channels. It detects and decodes the two other encodings that Kiln writes:
/// components in [-1, 1] (some are negative), and two components (the third is 0 everywhere, so z = sqrt(1 - x^2 -
/// y^2)).
/// \throws Error(input)
Image load_normal_map(const std::filesystem::path& path);

/// Reads a curvature map of one channel as n/2 + 1/2, with n from -1 (concave) to 1 (convex). Values are divided by the
/// 95th percentile of the magnitudes of bent texels, so that neither units nor the range of a PNG matter. A texel
/// counts as bent if its magnitude exceeds 1/255 of the largest one.
/// \throws Error(input), also for a map with colours
Image load_curvature(const std::filesystem::path& path);

/// Reads a mask: the first channel of an image; or a saved match, in which a texel is 1 if one of its samples found a
/// point, else 0.
/// \throws Error(input)
Image load_mask(const std::filesystem::path& path);

/// Text entries of an image file that describe its values. \param ranges  the values at 0 and 1, per channel; empty:
/// the values are stored unscaled
std::vector<ImageText> value_texts(const SaveImageOptions& options,
                                   const std::vector<ValueRange>& ranges, const std::string& unit);

}  // namespace kiln
