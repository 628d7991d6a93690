#include "io/image/picture.h"

#include <algorithm>

#include "base/memory.h"
#include "base/parallel.h"

namespace kiln {

Image empty_image(std::uint64_t width, std::uint64_t height, std::uint32_t channels,
                  std::uint64_t working, const std::string& place, const ImageLimits& limits,
                  const FailWith& fail) {
  const std::string sides = std::to_string(width) + " x " + std::to_string(height);
  if (std::min(width, height) < 1 || std::max(width, height) > kLargestImageSide) {
    fail(place, "it says " + sides + " pixels, but 1 to 65536 a side are possible",
         "Export or copy the file again.");
  }
  if (width * height > limits.pixels) {
    fail(place,
         "it says " + sides + " pixels, but at most " + std::to_string(limits.pixels) + " are read",
         "Scale the image down.");
  }
  const std::uint64_t values = width * height * channels;
  require_memory("its " + sides + " pixels", values * sizeof(float) + working,
                 memory_failure(fail, place));
  Image image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.channels = channels;
  image.pixels.resize(values);
  return image;
}

void floats_of_bytes(std::span<const std::uint8_t> bytes, float* to) {
  parallel_for(bytes.size(), std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) to[i] = static_cast<float>(bytes[i]) / 255.0F;
  });
}

}  // namespace kiln
