// Writers of GPU textures, KTX 2 and DDS: 8 bits a channel or blocks of 4 x 4 texels (BC4, BC5), with mip-maps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/image_data.h"
#include "kiln/image_format.h"

namespace kiln {

/// True for formats of GPU textures, which store a mip chain in 8 bits or in blocks.
inline bool is_texture(ImageFormat format) {
  return format == ImageFormat::ktx2 || format == ImageFormat::dds;
}

/// Texel format of a texture.
struct TextureFormat {
  std::uint32_t vulkan, dxgi;  ///< VkFormat, DXGI_FORMAT
  std::uint32_t channels;      ///< 1, 2 or 4
  /// `in_blocks`: true if each channel is stored in BC4 blocks of 8 bytes
  bool is_srgb, in_blocks;

  /// The format for an image, which depends on its use.
  static TextureFormat of(const Image& image, TextureUse use);
};

/// The 16 values of a block, by rows, in [0, 255].
using BlockValues = std::array<float, 16>;

/// Encodes a BC4 block: two endpoints, and an index for each value. The squared error is nearly the
/// smallest one. The search for endpoints starts at the lowest and highest value; its step is
/// halved repeatedly.
std::array<std::uint8_t, 8> encode_bc4(const BlockValues& values);
/// Decodes BC4 as a GPU interpolates it.
BlockValues decode_bc4(std::span<const std::uint8_t> block);

/// Encodes rows 4 y to 4 y + 3 of an image. The BC4 blocks of a texel block's channels follow each
/// other. Beyond the image's sides, its last texel is repeated.
void encode_blocks(const Image& image, const TextureFormat& format, std::size_t y,
                   std::uint8_t* to);

/// \param levels  the image and its mip levels, down to 1 x 1 or to a larger size
std::vector<std::byte> encode_ktx2(std::span<const Image* const> levels, TextureUse use);
std::vector<std::byte> encode_dds(std::span<const Image* const> levels, TextureUse use);

}  // namespace kiln
