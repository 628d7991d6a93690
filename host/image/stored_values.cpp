#include "image/stored_values.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "kiln/image.h"

namespace kiln {
namespace {

template <std::size_t kChannels>
void store_in(const std::vector<ValueRange>& ranges, std::vector<float>& values) {
  std::array<float, kChannels> low{}, size{};
  for (std::size_t c = 0; c < kChannels; ++c) {
    low[c] = ranges[c].low;
    size[c] = ranges[c].high - ranges[c].low;
  }
  for (std::size_t i = 0; i + kChannels <= values.size(); i += kChannels) {
    for (std::size_t c = 0; c < kChannels; ++c) {
      values[i + c] = size[c] > 0 ? (values[i + c] - low[c]) / size[c] : 0.5F;
    }
  }
}

/// Maps each channel's values from their range to [0, 1].
void store_in(const std::vector<ValueRange>& ranges, Image& image) {
  if (ranges.size() == 1) return store_in<1>(ranges, image.pixels);
  if (ranges.size() == 2) return store_in<2>(ranges, image.pixels);
  if (ranges.size() == 3) return store_in<3>(ranges, image.pixels);
  if (ranges.size() == 4) return store_in<4>(ranges, image.pixels);
}

}  // namespace

bool holds_floats(ImageFormat format) {
  return format == ImageFormat::exr_half || format == ImageFormat::exr_float ||
         format == ImageFormat::tiff_float;
}

std::vector<ValueRange> stored_ranges(const BakedMap& map, ImageFormat format) {
  const bool is_unscaled =
      std::all_of(map.ranges.begin(), map.ranges.end(),
                  [](const ValueRange& range) { return range.low == 0 && range.high == 1; });
  return is_unscaled || holds_floats(format) || map.info.type == MapType::unit_vector
             ? std::vector<ValueRange>()
             : map.ranges;
}

void to_stored(BakedMap& map, ImageFormat format) {
  if (map.stored || holds_floats(format)) return;
  const std::vector<ValueRange> ranges = stored_ranges(map, format);
  const auto convert = [&](Image& image) {
    if (map.info.type == MapType::color) to_srgb(image);
    if (!ranges.empty()) store_in(ranges, image);
  };
  convert(map.image);
  for (Image& level : map.mips) convert(level);
  map.stored = true;
}

}  // namespace kiln
