// Writing of WebP, by libwebp.
#include <webp/encode.h>

#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "io/image/picture.h"
#include "kiln/error.h"

namespace kiln {

std::vector<std::byte> encode_webp(const Image& image, const PictureEncoding& encoding) {
  if (image.width > WEBP_MAX_DIMENSION || image.height > WEBP_MAX_DIMENSION) {
    throw Error(ErrorCode::usage, "WebP holds at most " + std::to_string(WEBP_MAX_DIMENSION) +
                                      " pixels a side, not " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) + ": choose PNG.");
  }
  constexpr int kEffort = 2;       // Effort of lossless compression, 0 to 9
  constexpr int kLossyEffort = 4;  // Effort of lossy compression, 0 to 6
  const bool is_lossy = encoding.quality != 0;
  std::vector<std::uint8_t> bytes = bytes_of(image, encoding.dither, encoding.use);
  const std::size_t texels = std::size_t{image.width} * image.height;
  if (image.channels == 1) {
    std::vector<std::uint8_t> grey = std::move(bytes);
    bytes.resize(3 * texels);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = grey[i / 3];
  }
  WebPConfig webp_config;
  WebPPicture picture;
  if (WebPConfigPreset(&webp_config, WEBP_PRESET_DEFAULT, static_cast<float>(encoding.quality)) ==
          0 ||
      (!is_lossy && WebPConfigLosslessPreset(&webp_config, kEffort) == 0) ||
      WebPPictureInit(&picture) == 0) {
    throw Error(ErrorCode::internal,
                "Kiln was built against another version of libwebp than the one installed.");
  }
  webp_config.exact = 1;  // Keeps colours of transparent pixels
  if (is_lossy) {
    webp_config.method = kLossyEffort;
    // Alpha is stored without loss, since alpha tests depend on it
    webp_config.alpha_quality = 100;
    webp_config.use_sharp_yuv = encoding.use == TextureUse::color ? 0 : 1;
  }
  picture.use_argb = 1;
  picture.width = static_cast<int>(image.width);
  picture.height = static_cast<int>(image.height);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool has_alpha = image.channels == 4;
  const int stride = picture.width * (has_alpha ? 4 : 3);
  const auto import_pixels = has_alpha ? WebPPictureImportRGBA : WebPPictureImportRGB;
  const bool done =
      import_pixels(&picture, bytes.data(), stride) != 0 && WebPEncode(&webp_config, &picture) != 0;
  WebPPictureFree(&picture);
  const std::unique_ptr<WebPMemoryWriter, void (*)(WebPMemoryWriter*)> owner(&writer,
                                                                             WebPMemoryWriterClear);
  if (!done) throw std::bad_alloc();
  std::vector<std::byte> file(writer.size);
  std::memcpy(file.data(), writer.mem, writer.size);
  return file;
}

}  // namespace kiln
