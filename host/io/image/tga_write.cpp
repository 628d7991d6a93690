// Writes TGA, and converts images to 8 bits per channel, as TGA and WebP encode them.
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "io/image/picture.h"
#include "io/image/png.h"

namespace kiln {

std::vector<std::uint8_t> bytes_of(const Image& image, Dither by, TextureUse use) {
  const DitherBlocks dither(image, by, use);
  const std::uint32_t channels = image.channels == 2 ? 3 : image.channels;
  std::vector<std::uint8_t> bytes(std::size_t{image.width} * image.height * channels);
  std::vector<std::uint8_t> row(std::size_t{image.width} * image.channels);
  for (std::size_t y = 0; y < image.height; ++y) {
    quantise_row(image, 8, dither, y, row.data());
    std::uint8_t* const to = &bytes[y * image.width * channels];
    if (channels == image.channels) {
      std::ranges::copy(row, to);
      continue;
    }
    for (std::size_t x = 0; x < image.width; ++x) std::copy_n(&row[2 * x], 2, to + 3 * x);
  }
  return bytes;
}

std::vector<std::byte> encode_tga(const Image& image, bool dither) {
  const std::vector<std::uint8_t> bytes =
      bytes_of(image, dither ? Dither::on : Dither::off, TextureUse::values);
  const std::size_t texels = std::size_t{image.width} * image.height;
  const std::size_t channels = bytes.size() / texels, row = image.width * channels;
  const auto byte = [](std::size_t value) { return static_cast<std::byte>(value & 0xFFU); };
  std::vector<std::byte> file(18);  // Truevision TGA 2.0, 3.2
  file[2] = byte(channels == 1 ? 3 : 2);
  for (const auto& [at, side] : {std::pair(12, image.width), std::pair(14, image.height)}) {
    file[static_cast<std::size_t>(at)] = byte(side);
    file[static_cast<std::size_t>(at) + 1] = byte(side >> 8U);
  }
  file[16] = byte(8 * channels);
  file[17] = byte(channels == 4 ? 8 : 0);  // Number of alpha bits; the bottom row comes first
  file.reserve(file.size() + bytes.size());
  for (std::size_t y = image.height; y-- > 0;) {
    for (std::size_t i = 0; i < row; ++i) {
      const std::size_t c = i % channels;
      const std::size_t from = channels >= 3 && c < 3 ? i + 2 - 2 * c : i;  // Blue comes first
      file.push_back(static_cast<std::byte>(bytes[y * row + from]));
    }
  }
  return file;
}

}  // namespace kiln
