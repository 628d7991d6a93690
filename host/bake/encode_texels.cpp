#include "bake/encode_texels.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::size_t kTexelsPerTask = std::size_t{1} << 16;

}  // namespace

void encode_texels(const MapInfo& map, const BakeOptions& options,
                   std::span<const std::uint8_t> coverage, Image& image) {
  const std::array<float, 4> empty = map_background(map, options);
  const std::size_t channels = image.channels;
  const bool marks_misses = options.encoding.miss == MissPolicy::mark;
  const bool copies_values = map.type != MapType::unit_vector && !marks_misses;
  const bool is_halved = map.type == MapType::unit_vector && !marks_misses &&
                         !options.encoding.raw && !options.encoding.two_component;
  parallel_for(coverage.size(), kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (coverage[i] == kCoverageEmpty) {
        std::copy_n(empty.begin(), channels, &image.pixels[i * channels]);
      }
      if (!copies_values && !is_halved) {
        encode_texel(map, options, coverage[i], &image.pixels[i * channels]);
      }
    }
    if (!is_halved) return;
    // A vectorizable version of encode_texel().
    float* const pixels = image.pixels.data();
    for (std::size_t i = begin * 3; i < end * 3; ++i) pixels[i] = pixels[i] * 0.5F + 0.5F;
  });
}

}  // namespace kiln
