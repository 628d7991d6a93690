// Layers of an OpenEXR file: a line each with channels, width and height as digits, the name, and after a tab a text's
// keyword. What is written has these channels and values, as OpenEXR itself reads them; else kiln::Error(usage).
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "kiln/image.h"

namespace {

namespace fs = std::filesystem;

const fs::path& file() {
  static const fs::path path = [] {
    static std::string folder = "/dev/shm/kiln-layers-fuzz-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) std::abort();
    std::atexit([] { fs::remove_all(folder); });
    return fs::path(folder) / "layers.exr";
  }();
  return path;
}

void check(const std::vector<kiln::ImageLayer>& layers) {
  Imf::InputFile input(file().c_str());
  const Imf::ChannelList& channels = input.header().channels();
  std::size_t count = 0;
  for (auto c = channels.begin(); c != channels.end(); ++c) ++count;
  for (const kiln::ImageLayer& layer : layers) {
    const kiln::Image& image = *layer.image;
    count -= image.channels;
    for (std::uint32_t c = 0; c < image.channels; ++c) {
      const std::string name =
          layer.name + "." + (image.channels == 1 ? 'Y' : std::string("RGBA")[c]);
      if (channels.findChannel(name) == nullptr) std::abort();
      std::vector<float> values(std::size_t{image.width} * image.height);
      Imf::FrameBuffer buffer;
      buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                     sizeof(float), sizeof(float) * image.width));
      input.setFrameBuffer(buffer);
      input.readPixels(0, static_cast<int>(image.height) - 1);
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::bit_cast<std::uint32_t>(values[i]) !=
            std::bit_cast<std::uint32_t>(image.pixels[i * image.channels + c])) {
          std::abort();
        }
      }
    }
    for (const kiln::ImageText& text : layer.texts) {
      if (input.header().find(layer.name + "." + text.keyword) == input.header().end())
        std::abort();
    }
  }
  if (count != 0) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<kiln::Image> images;
  std::vector<kiln::ImageLayer> layers;
  for (std::string line; layers.size() < 8 && std::getline(lines, line);) {
    line.resize(std::max<std::size_t>(line.size(), 3), '0');
    const auto digit = [&](std::size_t k) { return static_cast<unsigned char>(line[k]) % 8U; };
    kiln::Image& image = images.emplace_back();
    image.channels = digit(0);
    image.width = digit(1);
    image.height = digit(2);
    for (std::uint32_t i = 0; i < image.width * image.height * image.channels; ++i) {
      image.pixels.push_back(std::bit_cast<float>(0x9E3779B9U * (i + 1)));
    }
    kiln::ImageLayer& layer = layers.emplace_back();
    const std::size_t tab = line.find('\t', 3);
    layer.name = line.substr(3, tab == std::string::npos ? tab : tab - 3);
    if (tab != std::string::npos) layer.texts.push_back({line.substr(tab + 1), "text"});
  }
  for (std::size_t k = 0; k < layers.size(); ++k) layers[k].image = &images[k];
  try {
    kiln::save_layers(layers, file(), {.format = kiln::ImageFormat::exr_float, .threads = 1});
    check(layers);
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage) std::abort();
  }
  try {
    kiln::load_image(file());  // no image, or the last file
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
