#include "io/image/block_decode.h"

#include <algorithm>
#include <span>

#include "io/image/gpu_texture.h"

namespace kiln {
namespace {

using Color = std::array<float, 4>;

std::uint32_t word(const std::uint8_t* from, int bytes) {
  std::uint32_t value = 0;
  for (int k = 0; k < bytes; ++k) value |= std::uint32_t{from[k]} << (8 * k);
  return value;
}

Color color_of_565(std::uint32_t packed) {
  return {static_cast<float>(packed >> 11U & 31U) / 31, static_cast<float>(packed >> 5U & 63U) / 63,
          static_cast<float>(packed & 31U) / 31, 1};
}

Color interpolate_color(const Color& a, const Color& b, float share) {
  Color result;
  for (std::size_t c = 0; c < 4; ++c) result[c] = a[c] + (b[c] - a[c]) * share;
  return result;
}

/// \param four  true: blocks always have four colours (BC2, BC3). false (BC1): if the first
///   endpoint is not greater than the second, the colour of index 2 is their mean, and that of
///   index 3 is transparent black
void decode_colors(const std::uint8_t* block, bool four, BlockTexels& texels) {
  const std::uint32_t first = word(block, 2), second = word(block + 2, 2);
  const std::uint32_t indices = word(block + 4, 4);
  std::array<Color, 4> colors{color_of_565(first), color_of_565(second)};
  if (four || first > second) {
    colors[2] = interpolate_color(colors[0], colors[1], 1.0F / 3);
    colors[3] = interpolate_color(colors[0], colors[1], 2.0F / 3);
  } else {
    colors[2] = interpolate_color(colors[0], colors[1], 0.5F);
  }
  for (std::size_t i = 0; i < 16; ++i) texels[i] = colors[indices >> (2 * i) & 3U];
}

void decode_channel(const std::uint8_t* block, std::size_t channel, BlockTexels& texels) {
  const BlockValues values = decode_bc4(std::span(block, 8));
  for (std::size_t i = 0; i < 16; ++i) texels[i][channel] = values[i] / 255;
}

/// BC4_SNORM. Endpoints are from -127 to 127; -128 counts as -127. Two of the eight shades may be
/// -1 and 1.
void decode_signed_channel(const std::uint8_t* block, std::size_t channel, BlockTexels& texels) {
  const auto end_of = [](std::uint8_t byte) {
    return static_cast<float>(std::max(-127, byte < 128 ? int{byte} : int{byte} - 256));
  };
  const float a = end_of(block[0]), b = end_of(block[1]);
  std::array<float, 8> shades{a, b};
  const int steps = a > b ? 7 : 5;
  for (int k = 1; k < steps; ++k) {
    shades[static_cast<std::size_t>(k) + 1] =
        a + (b - a) * static_cast<float>(k) / static_cast<float>(steps);
  }
  if (steps == 5) shades[6] = -127, shades[7] = 127;
  const std::uint64_t indices = word(block + 2, 3) | std::uint64_t{word(block + 5, 3)} << 24U;
  for (std::size_t i = 0; i < 16; ++i) {
    texels[i][channel] = shades[indices >> (3 * i) & 7U] / 254 + 0.5F;
  }
}

/// Layout of a mode of BC7: the number of bits of each field.
struct Mode {
  /// Number of subsets, and numbers of bits of the partition, of the rotation and of the index
  /// selection
  unsigned subsets, partition, rotation, selector;
  /// Bits per channel of an endpoint; without bits, alpha is 1
  unsigned color, alpha;
  /// True if a further low bit (p-bit) follows for each endpoint, or for each subset
  bool own_low_bits, shared_low_bits;
  unsigned index, second_index;  ///< Bits per index; 0: there is no second set of indices
};
constexpr std::array<Mode, 8> kModes = {{{3, 4, 0, 0, 4, 0, true, false, 3, 0},
                                         {2, 6, 0, 0, 6, 0, false, true, 3, 0},
                                         {3, 6, 0, 0, 5, 0, false, false, 2, 0},
                                         {2, 6, 0, 0, 7, 0, true, false, 2, 0},
                                         {1, 0, 2, 1, 5, 6, false, false, 2, 3},
                                         {1, 0, 2, 0, 7, 8, false, false, 2, 2},
                                         {1, 0, 0, 0, 7, 7, true, false, 4, 0},
                                         {2, 6, 0, 0, 5, 5, true, false, 2, 0}}};

/// Partition tables for two and for three subsets. They give the subset of each texel in two bits,
/// starting at the lowest bits.
constexpr std::array<std::uint32_t, 64> kTwoSubsets = {
    0x50505050, 0x40404040, 0x54545454, 0x54505040, 0x50404000, 0x55545450, 0x55545040, 0x54504000,
    0x50400000, 0x55555450, 0x55544000, 0x54400000, 0x55555440, 0x55550000, 0x55555500, 0x55000000,
    0x55150100, 0x00004054, 0x15010000, 0x00405054, 0x00004050, 0x15050100, 0x05010000, 0x40505054,
    0x00404050, 0x05010100, 0x14141414, 0x05141450, 0x01155440, 0x00555500, 0x15014054, 0x05414150,
    0x44444444, 0x55005500, 0x11441144, 0x05055050, 0x05500550, 0x11114444, 0x41144114, 0x44111144,
    0x15055054, 0x01055040, 0x05041050, 0x05455150, 0x14414114, 0x50050550, 0x41411414, 0x00141400,
    0x00041504, 0x00105410, 0x10541000, 0x04150400, 0x50410514, 0x41051450, 0x05415014, 0x14054150,
    0x41050514, 0x41505014, 0x40011554, 0x54150140, 0x50505500, 0x00555050, 0x15151010, 0x54540404};
constexpr std::array<std::uint32_t, 64> kThreeSubsets = {
    0xAA685050, 0x6A5A5040, 0x5A5A4200, 0x5450A0A8, 0xA5A50000, 0xA0A05050, 0x5555A0A0, 0x5A5A5050,
    0xAA550000, 0xAA555500, 0xAAAA5500, 0x90909090, 0x94949494, 0xA4A4A4A4, 0xA9A59450, 0x2A0A4250,
    0xA5945040, 0x0A425054, 0xA5A5A500, 0x55A0A0A0, 0xA8A85454, 0x6A6A4040, 0xA4A45000, 0x1A1A0500,
    0x0050A4A4, 0xAAA59090, 0x14696914, 0x69691400, 0xA08585A0, 0xAA821414, 0x50A4A450, 0x6A5A0200,
    0xA9A58000, 0x5090A0A8, 0xA8A09050, 0x24242424, 0x00AA5500, 0x24924924, 0x24499224, 0x50A50A50,
    0x500AA550, 0xAAAA4444, 0x66660000, 0xA5A0A5A0, 0x50A050A0, 0x69286928, 0x44AAAA44, 0x66666600,
    0xAA444444, 0x54A854A8, 0x95809580, 0x96969600, 0xA85454A8, 0x80959580, 0xAA141414, 0x96960000,
    0xAAAA1414, 0xA05050A0, 0xA0A5A5A0, 0x96000000, 0x40804080, 0xA9A8A9A8, 0xAAAAAA44, 0x2A4A5254};
/// Anchor texels, whose indices lack the highest bit, as it is 0. The tables are for the second of
/// two subsets, and for the second and the third of three.
constexpr std::array<std::uint8_t, 64> kTwoSubsetAnchor = {
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 2,  8, 2, 2, 8,
    8,  15, 2,  8,  2,  2,  8,  8,  2,  2,  15, 15, 6,  8,  2,  8,  15, 15, 2, 8, 2, 2,
    2,  15, 15, 6,  6,  2,  6,  8,  15, 15, 2,  2,  15, 15, 15, 15, 15, 2,  2, 15};
constexpr std::array<std::uint8_t, 64> kThreeSubsetAnchor = {
    3,  3,  15, 15, 8, 3,  15, 15, 8,  8,  6, 6,  6, 5,  3, 3,  3,  3,  8,  15, 3,  3,
    6,  10, 5,  8,  8, 6,  8,  5,  15, 15, 8, 15, 3, 5,  6, 10, 8,  15, 15, 3,  15, 5,
    15, 15, 15, 15, 3, 15, 5,  5,  5,  8,  5, 10, 5, 10, 8, 13, 15, 12, 3,  3};
constexpr std::array<std::uint8_t, 64> kLastSubsetAnchor = {
    15, 8, 8, 3,  15, 15, 3,  8,  15, 15, 15, 15, 15, 15, 15, 8,  15, 8,  15, 3,  15, 8,
    15, 8, 3, 15, 6,  10, 15, 15, 10, 8,  15, 3,  15, 10, 10, 8,  9,  10, 6,  15, 8,  15,
    3,  6, 6, 8,  15, 3,  15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 3,  15, 15, 8};

/// Weight of the second endpoint in 64ths, for an index of `bits` bits.
unsigned weight_of(unsigned bits, unsigned index) {
  static constexpr std::array<std::uint8_t, 4> kWeights2 = {0, 21, 43, 64};
  static constexpr std::array<std::uint8_t, 8> kWeights3 = {0, 9, 18, 27, 37, 46, 55, 64};
  static constexpr std::array<std::uint8_t, 16> kWeights4 = {0,  4,  9,  13, 17, 21, 26, 30,
                                                             34, 38, 43, 47, 51, 55, 60, 64};
  return bits == 2 ? kWeights2[index] : bits == 3 ? kWeights3[index] : kWeights4[index];
}

/// Reads the bits of a block in order, starting with the lowest bit of its first byte.
class Bits {
 public:
  explicit Bits(const std::uint8_t* bytes) : bytes_(bytes) {}
  unsigned take(unsigned count) {
    unsigned value = 0;
    for (unsigned k = 0; k < count; ++k, ++at_) {
      value |= (bytes_[at_ / 8] >> (at_ % 8) & 1U) << k;
    }
    return value;
  }

 private:
  const std::uint8_t* bytes_;
  unsigned at_ = 0;
};

/// Expands a value of `bits` bits to eight bits by repeating its highest bits.
unsigned widen_bits(unsigned value, unsigned bits) {
  value <<= 8 - bits;
  return value | value >> bits;
}

void decode_bc7(const std::uint8_t* block, BlockTexels& texels) {
  Bits bits(block);
  std::size_t number = 0;
  while (number < kModes.size() && bits.take(1) == 0) ++number;
  if (number == kModes.size()) {
    for (Color& texel : texels) texel = {};
    return;
  }
  const Mode& mode = kModes[number];
  const unsigned partition = bits.take(mode.partition);
  const unsigned rotation = bits.take(mode.rotation);
  const bool swaps_sets = bits.take(mode.selector) != 0;

  const std::size_t endpoint_count = std::size_t{2} * mode.subsets;
  std::array<std::array<unsigned, 4>, 6> end{};
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t e = 0; e < endpoint_count; ++e)
      end[e][c] = bits.take(c < 3 ? mode.color : mode.alpha);
  }
  const bool has_low_bits = mode.own_low_bits || mode.shared_low_bits;
  unsigned low = 0;
  for (std::size_t e = 0; has_low_bits && e < endpoint_count; ++e) {
    if (mode.own_low_bits || e % 2 == 0) low = bits.take(1);
    for (unsigned& value : end[e]) value = value << 1U | low;
  }
  const unsigned extra_bits = has_low_bits ? 1 : 0;
  for (std::size_t e = 0; e < endpoint_count; ++e) {
    for (std::size_t c = 0; c < 3; ++c) end[e][c] = widen_bits(end[e][c], mode.color + extra_bits);
    end[e][3] = mode.alpha == 0 ? 255 : widen_bits(end[e][3], mode.alpha + extra_bits);
  }

  const auto subset_of = [&](std::size_t i) -> std::size_t {
    if (mode.subsets == 1) return 0;
    return (mode.subsets == 2 ? kTwoSubsets : kThreeSubsets)[partition] >> (2 * i) & 3U;
  };
  const auto is_anchor = [&](std::size_t i) {
    if (i == 0) return true;
    if (mode.subsets == 2) return i == kTwoSubsetAnchor[partition];
    return mode.subsets == 3 &&
           (i == kThreeSubsetAnchor[partition] || i == kLastSubsetAnchor[partition]);
  };
  std::array<unsigned, 16> first{}, second{};
  for (std::size_t i = 0; i < 16; ++i) first[i] = bits.take(mode.index - (is_anchor(i) ? 1 : 0));
  if (mode.second_index != 0) {
    for (std::size_t i = 0; i < 16; ++i)
      second[i] = bits.take(mode.second_index - (i == 0 ? 1 : 0));
  }
  for (std::size_t i = 0; i < 16; ++i) {
    unsigned color_weight = weight_of(mode.index, first[i]), alpha_weight = color_weight;
    if (mode.second_index != 0) alpha_weight = weight_of(mode.second_index, second[i]);
    if (swaps_sets) std::swap(color_weight, alpha_weight);
    const std::size_t a = 2 * subset_of(i);
    for (std::size_t c = 0; c < 4; ++c) {
      const unsigned endpoint_weight = c < 3 ? color_weight : alpha_weight;
      const unsigned value =
          (end[a][c] * (64 - endpoint_weight) + end[a + 1][c] * endpoint_weight + 32) >> 6U;
      texels[i][c] = static_cast<float>(value) / 255;
    }
    if (rotation != 0) std::swap(texels[i][rotation - 1], texels[i][3]);
  }
}

}  // namespace

std::size_t block_bytes(BlockFormat format) {
  return format == BlockFormat::bc1 || format == BlockFormat::bc4 ||
                 format == BlockFormat::bc4_signed
             ? 8
             : 16;
}

std::uint32_t block_channels(BlockFormat format) {
  switch (format) {
    case BlockFormat::bc4:
    case BlockFormat::bc4_signed:
      return 1;
    case BlockFormat::bc5:
    case BlockFormat::bc5_signed:
      return 2;
    default:
      return 4;
  }
}

void decode_block(BlockFormat format, const std::uint8_t* block, BlockTexels& texels) {
  for (Color& texel : texels) texel = {0, 0, 0, 1};
  switch (format) {
    case BlockFormat::bc1:
      return decode_colors(block, false, texels);
    case BlockFormat::bc2:
      decode_colors(block + 8, true, texels);
      for (std::size_t i = 0; i < 16; ++i) {
        texels[i][3] = static_cast<float>(block[i / 2] >> (4 * (i % 2)) & 15U) / 15;
      }
      return;
    case BlockFormat::bc3:
      decode_colors(block + 8, true, texels);
      return decode_channel(block, 3, texels);
    case BlockFormat::bc4:
      return decode_channel(block, 0, texels);
    case BlockFormat::bc4_signed:
      return decode_signed_channel(block, 0, texels);
    case BlockFormat::bc5:
      decode_channel(block, 0, texels);
      return decode_channel(block + 8, 1, texels);
    case BlockFormat::bc5_signed:
      decode_signed_channel(block, 0, texels);
      return decode_signed_channel(block + 8, 1, texels);
    case BlockFormat::bc7:
      return decode_bc7(block, texels);
  }
}

}  // namespace kiln
