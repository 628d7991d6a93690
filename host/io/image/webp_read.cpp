// Reading of WebP, by libwebp.
#include <webp/decode.h>

#include <string>
#include <vector>

#include "io/image/picture.h"

namespace kiln {

Image parse_webp(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const FailWith fail = image_failure(file, "WebP");
  const std::string bytes = read_whole(source, fail);
  const std::string export_again = "Export or copy the file again.";
  const auto* const data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  if (bytes.size() < 12) fail("", "the file is cut short", export_again);
  // The file starts with "RIFF", the number of bytes that follow, and "WEBP".
  std::uint64_t declared_bytes = 8;
  for (std::size_t k = 0; k < 4; ++k) declared_bytes += std::uint64_t{data[4 + k]} << (8 * k);
  if (declared_bytes > bytes.size()) {
    fail("RIFF",
         "it says " + std::to_string(declared_bytes) + " bytes, but the file has " +
             std::to_string(bytes.size()) + " (truncated)",
         export_again);
  }
  WebPBitstreamFeatures webp_features{};
  if (WebPGetFeatures(data, bytes.size(), &webp_features) != VP8_STATUS_OK) {
    fail("header", "damaged", export_again);
  }
  if (webp_features.has_animation != 0) {
    fail("header", "it is an animation", "Export one image of it.");
  }
  const std::uint32_t channels = webp_features.has_alpha != 0 ? 4 : 3;
  const std::uint64_t row_bytes = static_cast<std::uint64_t>(webp_features.width) * channels;
  // Working memory: the rows, and for lossless files, libwebp's buffers of 4 bytes per pixel.
  const std::uint64_t working = (row_bytes + 4 * static_cast<std::uint64_t>(webp_features.width)) *
                                static_cast<std::uint64_t>(webp_features.height);
  Image image = empty_image(static_cast<std::uint64_t>(webp_features.width),
                            static_cast<std::uint64_t>(webp_features.height), channels, working,
                            "header", limits, fail);
  std::vector<std::uint8_t> rows(row_bytes * image.height);
  const auto decode = channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  if (decode(data, bytes.size(), rows.data(), rows.size(), static_cast<int>(row_bytes)) ==
      nullptr) {
    fail("pixels", "damaged or cut short", export_again);
  }
  floats_of_bytes(rows, image.pixels.data());
  return image;
}

}  // namespace kiln
