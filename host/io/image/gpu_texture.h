// Textures as GPUs take them, KTX 2 and DDS: 8 bits a channel or blocks of 4 x 4 texels (BC4, BC5), with mip-maps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/image.h"

namespace kiln {

/// Formats that hold a mip chain in 8 bits or blocks.
inline bool is_texture(ImageFormat format) {
  return format == ImageFormat::ktx2 || format == ImageFormat::dds;
}

/// Storage of texels.
struct TextureFormat {
  std::uint32_t vulkan, dxgi;  ///< VkFormat, DXGI_FORMAT
  std::uint32_t channels;      ///< 1, 2 or 4
  bool is_srgb, in_blocks;     ///< Blocks: BC4, 8 bytes a channel

  /// The one for an image, by TextureUse.
  static TextureFormat of(const Image& image, TextureUse use);
};

/// Sixteen values of [0, 255], by rows.
using BlockValues = std::array<float, 16>;

/// BC4: two ends and the shade of each value between them; of squared errors near the least. Ends are searched from
/// the extremes inward and outward, in steps that halve.
std::array<std::uint8_t, 8> encode_bc4(const BlockValues& values);
/// The values back, as a GPU interpolates them.
BlockValues decode_bc4(std::span<const std::uint8_t> block);

/// Rows 4 y to 4 y + 3 of an image, a BC4 block a channel, one block after the other. Beyond the image's sides its
/// last texel is repeated.
void encode_blocks(const Image& image, const TextureFormat& format, std::size_t y,
                   std::uint8_t* to);

/// \param levels  the image, and its mip-maps down to 1 x 1, or no further
std::vector<std::byte> encode_ktx2(std::span<const Image* const> levels, TextureUse use);
std::vector<std::byte> encode_dds(std::span<const Image* const> levels, TextureUse use);

}  // namespace kiln
