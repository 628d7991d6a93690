// Several images as the layers of one OpenEXR file.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "io/image/exr.h"
#include "kiln/image.h"

namespace kiln {
namespace {

// Maximum length of a layer's name. OpenEXR limits names of attributes to 255 bytes, of which the
// rest is for the keyword of a layer's text.
constexpr std::size_t kMaxLayerNameBytes = 128;

[[noreturn]] void throw_usage(const std::string& text) { throw Error(ErrorCode::usage, text); }

std::string layer_size_text(const ImageLayer& layer) {
  return layer.name + ": " + std::to_string(layer.image->width) + " x " +
         std::to_string(layer.image->height);
}

void check(std::span<const ImageLayer> layers, const SaveImageOptions& options) {
  if (options.format != ImageFormat::exr_half && options.format != ImageFormat::exr_float) {
    throw_usage("PNG holds one image, not layers: use OpenEXR.");
  }
  if (layers.empty()) throw_usage("There is no layer to write.");
  std::set<std::string> names;
  for (const ImageLayer& layer : layers) {
    if (layer.name.empty() || layer.name.size() > kMaxLayerNameBytes ||
        layer.name.find_first_of(std::string_view(".\0", 2)) != std::string::npos) {
      throw_usage("'" + layer.name + "' is an invalid name of a layer: use 1 to " +
                  std::to_string(kMaxLayerNameBytes) + " bytes, none of them a dot or 0.");
    }
    if (!names.insert(layer.name).second)
      throw_usage("Two layers are called '" + layer.name + "'.");
    const Image* image = layer.image;
    if (image == nullptr || image->channels < 1 || image->channels > 4 || image->width == 0 ||
        image->height == 0 ||
        image->pixels.size() != std::size_t{image->width} * image->height * image->channels) {
      throw_usage("The layer '" + layer.name +
                  "' has no pixels, or their number does not match its size.");
    }
    check_texts(layer.texts);
    if (image->width != layers[0].image->width || image->height != layers[0].image->height) {
      throw_usage("Layers must be of one size, but there are " + layer_size_text(layers[0]) +
                  " and " + layer_size_text(layer) + ".");
    }
  }
}

std::string channel_name(const ImageLayer& layer, std::size_t channel) {
  static constexpr std::array<const char*, 4> kColors = {"R", "G", "B", "A"};
  return layer.name + "." + (layer.image->channels == 1 ? "Y" : kColors[channel]);
}

template <typename T>
void write_layers(std::span<const ImageLayer> layers, Imf::OutputFile& output, Imf::PixelType type,
                  int threads) {
  const std::size_t height = layers[0].image->height;
  std::vector<std::vector<T>> layer_bands(layers.size());
  for (std::size_t first = 0; first < height; first += kExrBandRows) {
    const std::size_t count = std::min(kExrBandRows, height - first);
    Imf::FrameBuffer buffer;
    for (std::size_t l = 0; l < layers.size(); ++l) {
      const Image& image = *layers[l].image;
      convert_rows(image, first, count, layer_bands[l], threads);
      for (std::size_t c = 0; c < image.channels; ++c) {
        buffer.insert(
            channel_name(layers[l], c),
            Imf::Slice::Make(type, layer_bands[l].data() + c,
                             Imath::V2i(0, static_cast<int>(first)), image.width,
                             static_cast<std::int64_t>(count), image.channels * sizeof(T)));
      }
    }
    output.setFrameBuffer(buffer);
    output.writePixels(static_cast<int>(count));
  }
}

}  // namespace

void save_layers(std::span<const ImageLayer> layers, const std::filesystem::path& path,
                 const SaveImageOptions& options) {
  check(layers, options);
  const bool half = options.format == ImageFormat::exr_half;
  const Imf::PixelType type = half ? Imf::HALF : Imf::FLOAT;
  Imf::Header header(static_cast<int>(layers[0].image->width),
                     static_cast<int>(layers[0].image->height));
  header.compression() = Imf::PIZ_COMPRESSION;
  for (const ImageLayer& layer : layers) {
    for (std::size_t c = 0; c < layer.image->channels; ++c) {
      header.channels().insert(channel_name(layer, c), Imf::Channel(type));
    }
    put_texts(header, layer.name + ".", layer.origin, layer.texts);
  }
  write_exr(path, [&](ExrStream& stream) {
    Imf::OutputFile output(stream, header, exr_threads(options.threads));
    if (half) {
      write_layers<Imath::half>(layers, output, type, options.threads);
    } else {
      write_layers<float>(layers, output, type, options.threads);
    }
  });
}

}  // namespace kiln
