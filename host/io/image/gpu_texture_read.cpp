// Readers of KTX 2 and DDS: the first level of a picture, with its blocks decompressed.
#include <half.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "base/parallel.h"
#include "io/image/block_decode.h"
#include "io/image/picture.h"
#ifdef KILN_HAS_ZSTD
#include <zstd.h>
#endif

namespace kiln {
namespace {

constexpr std::size_t kSide = 4;  // Side of a block in texels
const char* const kExportAgain = "Export or copy the file again.";

enum class NumberType { unorm, snorm, sfloat };

/// How texels are stored: in blocks, or as consecutive numbers.
struct TexelStorage {
  std::optional<BlockFormat> block = std::nullopt;
  std::uint32_t channels = 0, bytes = 0;  ///< Bytes per number: 1, 2 or 4
  NumberType number = NumberType::unorm;
  bool blue_first = false;
  bool no_alpha = false;  ///< True if the fourth channel is to be ignored (formats with X8)

  bool is_float() const { return !block && number == NumberType::sfloat; }
  /// Number of bytes of a level; cannot overflow for sides of 32 bits.
  std::uint64_t size(std::uint64_t width, std::uint64_t height) const {
    if (!block) return width * height * channels * bytes;
    return (width + kSide - 1) / kSide * ((height + kSide - 1) / kSide) * block_bytes(*block);
  }
};

TexelStorage make_block_storage(BlockFormat format) { return {format}; }
TexelStorage make_number_storage(std::uint32_t channels, std::uint32_t bytes,
                                 NumberType number = NumberType::unorm, bool blue_first = false) {
  return {std::nullopt, channels, bytes, number, blue_first};
}

/// A texel format, with its code in Vulkan (VkFormat) and in DXGI (DXGI_FORMAT); 0 if it has none
/// there.
struct FormatRow {
  std::uint32_t vulkan, dxgi;
  TexelStorage storage;
};
const FormatRow kFormats[] = {
    {9, 61, make_number_storage(1, 1)},
    {10, 63, make_number_storage(1, 1, NumberType::snorm)},
    {15, 0, make_number_storage(1, 1)},
    {16, 49, make_number_storage(2, 1)},
    {17, 51, make_number_storage(2, 1, NumberType::snorm)},
    {22, 0, make_number_storage(2, 1)},
    {23, 0, make_number_storage(3, 1)},
    {29, 0, make_number_storage(3, 1)},
    {30, 0, make_number_storage(3, 1, NumberType::unorm, true)},
    {36, 0, make_number_storage(3, 1, NumberType::unorm, true)},
    {37, 28, make_number_storage(4, 1)},
    {38, 31, make_number_storage(4, 1, NumberType::snorm)},
    {43, 29, make_number_storage(4, 1)},
    {0, 27, make_number_storage(4, 1)},
    {44, 87, make_number_storage(4, 1, NumberType::unorm, true)},
    {50, 91, make_number_storage(4, 1, NumberType::unorm, true)},
    {0, 88, {{}, 4, 1, NumberType::unorm, true, true}},
    {0, 93, {{}, 4, 1, NumberType::unorm, true, true}},
    {70, 56, make_number_storage(1, 2)},
    {76, 54, make_number_storage(1, 2, NumberType::sfloat)},
    {77, 35, make_number_storage(2, 2)},
    {83, 34, make_number_storage(2, 2, NumberType::sfloat)},
    {84, 0, make_number_storage(3, 2)},
    {90, 0, make_number_storage(3, 2, NumberType::sfloat)},
    {91, 11, make_number_storage(4, 2)},
    {97, 10, make_number_storage(4, 2, NumberType::sfloat)},
    {100, 41, make_number_storage(1, 4, NumberType::sfloat)},
    {103, 16, make_number_storage(2, 4, NumberType::sfloat)},
    {106, 6, make_number_storage(3, 4, NumberType::sfloat)},
    {109, 2, make_number_storage(4, 4, NumberType::sfloat)},
    // Vulkan has codes for BC1 with alpha and without. In both, Kiln reads the fourth colour as
    // black.
    {131, 0, {BlockFormat::bc1, 0, 0, NumberType::unorm, false, true}},
    {132, 0, {BlockFormat::bc1, 0, 0, NumberType::unorm, false, true}},
    {133, 71, make_block_storage(BlockFormat::bc1)},
    {134, 72, make_block_storage(BlockFormat::bc1)},
    {0, 70, make_block_storage(BlockFormat::bc1)},
    {135, 74, make_block_storage(BlockFormat::bc2)},
    {136, 75, make_block_storage(BlockFormat::bc2)},
    {137, 77, make_block_storage(BlockFormat::bc3)},
    {138, 78, make_block_storage(BlockFormat::bc3)},
    {139, 80, make_block_storage(BlockFormat::bc4)},
    {140, 81, make_block_storage(BlockFormat::bc4_signed)},
    {141, 83, make_block_storage(BlockFormat::bc5)},
    {142, 84, make_block_storage(BlockFormat::bc5_signed)},
    {145, 98, make_block_storage(BlockFormat::bc7)},
    {146, 99, make_block_storage(BlockFormat::bc7)},
};

std::optional<TexelStorage> storage_of(std::uint32_t FormatRow::*number, std::uint32_t format) {
  const auto row = std::find_if(std::begin(kFormats), std::end(kFormats), [&](const FormatRow& r) {
    return format != 0 && r.*number == format;
  });
  return row == std::end(kFormats) ? std::nullopt : std::optional(row->storage);
}

std::uint32_t uint32_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    value |= std::uint32_t{static_cast<std::uint8_t>(bytes[at + k])} << (8 * k);
  }
  return value;
}
std::uint64_t uint64_at(std::string_view bytes, std::size_t at) {
  return uint32_at(bytes, at) | std::uint64_t{uint32_at(bytes, at + 4)} << 32U;
}
std::string size_text(std::uint64_t width, std::uint64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

float number_at(const std::uint8_t* from, const TexelStorage& storage) {
  switch (storage.bytes) {
    case 1:
      if (storage.number == NumberType::unorm) return static_cast<float>(*from) / 255;
      return static_cast<float>(std::max(-127, *from < 128 ? int{*from} : int{*from} - 256)) / 254 +
             0.5F;
    case 2: {
      const auto value = static_cast<std::uint16_t>(from[0] | from[1] << 8);
      if (storage.number == NumberType::unorm) return static_cast<float>(value) / 65535;
      half number;
      number.setBits(value);
      return number;
    }
    default:
      return std::bit_cast<float>(from[0] | std::uint32_t{from[1]} << 8U |
                                  std::uint32_t{from[2]} << 16U | std::uint32_t{from[3]} << 24U);
  }
}

/// Removes channels that are to be ignored, and alpha if a block format is opaque.
void drop_ignored_alpha(Image& image) {
  const std::size_t texels = image.pixels.size() / 4;
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.pixels[3 * i + c] = image.pixels[4 * i + c];
  }
  image.channels = 3;
  image.pixels.resize(3 * texels);
}

bool is_opaque(const Image& image) {
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    if (image.pixels[i] != 1) return false;
  }
  return true;
}

/// \param bytes  the level's bytes, Storage::size() of them
Image decode(const TexelStorage& storage, std::string_view bytes, std::uint32_t width,
             std::uint32_t height, const ImageLimits& limits, const FailWith& fail) {
  const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::uint32_t channels = storage.block ? block_channels(*storage.block) : storage.channels;
  Image image = empty_image(width, height, channels, 0, "header", limits, fail);
  if (!storage.block) {
    const std::size_t row = std::size_t{width} * channels;
    parallel_for(height, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin * row; i < end * row; ++i) {
        image.pixels[i] = number_at(from + i * storage.bytes, storage);
      }
      if (!storage.blue_first) return;
      for (std::size_t i = begin * width; i < end * width; ++i) {
        std::swap(image.pixels[i * channels], image.pixels[i * channels + 2]);
      }
    });
  } else {
    const std::size_t blocks_per_row = (std::size_t{width} + kSide - 1) / kSide;
    const std::size_t size = block_bytes(*storage.block);
    parallel_for(
        (std::size_t{height} + kSide - 1) / kSide, 4, [&](std::size_t begin, std::size_t end) {
          BlockTexels texels;
          for (std::size_t block = begin * blocks_per_row; block < end * blocks_per_row; ++block) {
            decode_block(*storage.block, from + block * size, texels);
            const std::size_t left = block % blocks_per_row * kSide,
                              top = block / blocks_per_row * kSide;
            for (std::size_t i = 0; i < texels.size(); ++i) {
              const std::size_t x = left + i % kSide, y = top + i / kSide;
              if (x < width && y < height) std::copy_n(texels[i].begin(), channels, image.at(x, y));
            }
          }
        });
  }
  if (channels == 4 && (storage.no_alpha || (storage.block && is_opaque(image)))) {
    drop_ignored_alpha(image);
  }
  return image;
}

void divide_by_alpha(Image& image) {
  if (image.channels != 4) return;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const float alpha = image.pixels[i + 3];
    for (std::size_t c = 0; c < 3 && alpha > 0; ++c) {
      image.pixels[i + c] = std::min(image.pixels[i + c] / alpha, 1.0F);
    }
  }
}

/// The value of a key in the key/value data of a KTX 2 file; empty if the key is missing or the
/// data is damaged.
std::string_view value_of(std::string_view data, std::string_view key) {
  constexpr std::size_t kAlignment = 4;
  while (data.size() >= 4) {
    const std::size_t length = uint32_at(data, 0);
    if (length > data.size() - 4) return {};
    const std::string_view entry = data.substr(4, length);
    if (const std::size_t end = entry.find('\0'); end == key.size() && entry.starts_with(key)) {
      const std::string_view value = entry.substr(end + 1);
      return value.substr(0, value.find('\0'));
    }
    data.remove_prefix(
        std::min(data.size(), (4 + length + kAlignment - 1) / kAlignment * kAlignment));
  }
  return {};
}

/// Applies KTXswizzle. Its letters say for red, green, blue and alpha which stored channel they
/// are, or that they are 0 or 1.
void apply_swizzle(Image& image, std::string_view letters) {
  static constexpr std::string_view kLetters = "rgba01";
  if (letters.size() != 4 || letters == "rgba" ||
      letters.find_first_not_of(kLetters) != std::string_view::npos) {
    return;
  }
  Image swizzled_image{image.width, image.height, 4, {}};
  swizzled_image.pixels.reserve(image.pixels.size() / image.channels * 4);
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
    std::array<float, 6> values{0, 0, 0, 1, 0, 1};
    std::copy_n(&image.pixels[i], image.channels, values.begin());
    for (const char letter : letters)
      swizzled_image.pixels.push_back(values[kLetters.find(letter)]);
  }
  image = std::move(swizzled_image);
  if (letters[3] == '1') drop_ignored_alpha(image);
}

/// Applies KTXorientation. Its letters give the direction of the stored columns and rows: with
/// "rd", they are as in an Image.
void apply_orientation(Image& image, std::string_view letters) {
  if (letters.size() < 2) return;
  if (letters[1] == 'u') {
    const std::size_t row = std::size_t{image.width} * image.channels;
    for (std::uint32_t y = 0; y < image.height / 2; ++y) {
      std::swap_ranges(image.at(0, y), image.at(0, y) + row, image.at(0, image.height - 1 - y));
    }
  }
  if (letters[0] != 'l') return;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width / 2; ++x) {
      std::swap_ranges(image.at(x, y), image.at(x, y) + image.channels,
                       image.at(image.width - 1 - x, y));
    }
  }
}

constexpr std::string_view kKtx2("\xABKTX 20\xBB\r\n\x1A\n", 12);
constexpr std::size_t kKtx2Header = 80, kKtx2Level = 24;

/// The fields of a KTX 2 header that are needed to read the first level.
struct Ktx2Header {
  std::uint32_t format, width, height, depth, layers, faces, scheme, model = 0, flags = 0;
  std::string_view keys;
  /// Offset of the first level, and its number of packed and of unpacked bytes
  std::uint64_t at, packed, size;

  explicit Ktx2Header(std::string_view bytes)
      : format(uint32_at(bytes, 12)),
        width(uint32_at(bytes, 20)),
        height(std::max(1U, uint32_at(bytes, 24))),
        depth(uint32_at(bytes, 28)),
        layers(uint32_at(bytes, 32)),
        faces(uint32_at(bytes, 36)),
        scheme(uint32_at(bytes, 44)),
        at(uint64_at(bytes, kKtx2Header)),
        packed(uint64_at(bytes, kKtx2Header + 8)),
        size(uint64_at(bytes, kKtx2Header + 16)) {
    const std::size_t descriptor = uint32_at(bytes, 48);
    if (descriptor <= bytes.size() && bytes.size() - descriptor >= 16) {
      model = static_cast<std::uint8_t>(bytes[descriptor + 12]);
      flags = static_cast<std::uint8_t>(bytes[descriptor + 15]);
    }
    const std::size_t first = uint32_at(bytes, 56), length = uint32_at(bytes, 60);
    if (first <= bytes.size() && bytes.size() - first >= length) keys = bytes.substr(first, length);
  }

  /// Why the first level cannot be read; empty if it can.
  /// \param remedy  [out] remedy for the message
  std::string refusal_reason(std::string& remedy) const {
    constexpr std::uint32_t kEtc1s = 163, kUastc = 166, kBasisLz = 1, kZstd = 2, kZlib = 3;
    remedy = "Convert it to PNG.";
    if (scheme == kBasisLz || model == kEtc1s || model == kUastc) {
      remedy =
          "Write it as BC7 (`ktx transcode --target bc7`), or convert it to PNG (`ktx extract`).";
      return std::string("it is compressed as Basis Universal (") +
             (model == kUastc ? "UASTC" : "ETC1S") + "), for which Kiln has no decoder";
    }
    if (depth > 1 || layers > 1 || faces > 1) {
      return "it holds several pictures (an array, a cube or a volume)";
    }
    if (!storage_of(&FormatRow::vulkan, format)) {
      return "its format is VkFormat " + std::to_string(format) + ", which Kiln does not read";
    }
#ifdef KILN_HAS_ZSTD
    if (scheme == kZstd) return {};
#else
    if (scheme == kZstd) {
      remedy = "Convert it to PNG, or build Kiln with KILN_ZSTD=ON where libzstd is installed.";
      return "it is compressed by Zstandard, and this build of Kiln was made without libzstd";
    }
#endif
    if (scheme != 0 && scheme != kZlib) {
      return "its supercompression scheme is " + std::to_string(scheme) +
             ", which Kiln does not read";
    }
    return {};
  }
};

/// Undoes the supercompression of the first level.
std::string unpack_level(const ByteSource& source, std::string_view bytes, const Ktx2Header& header,
                         std::uint64_t size, const FailWith& fail) {
  const std::string_view packed = bytes.substr(header.at, header.packed);
  const auto check = [&](bool enough) {
    if (!enough) {
      fail("level 0",
           "its pixels need " + std::to_string(size) +
               " bytes, but it has another number of bytes (damaged)",
           kExportAgain);
    }
  };
  if (header.scheme == 0) {
    check(packed.size() >= size);
    return std::string(packed.substr(0, size));
  }
  check(header.size == size);
  if (header.scheme == 3) {
    check(max_unpacked_bytes(Packing::deflate, packed.size()) >= size);
    std::string level(size, '\0');
    const auto stream = inflating_stream(source, header.at, fail);
    std::size_t have = 0;
    while (have < size) {
      const std::size_t more = stream->read(&level[have], size - have);
      if (more == 0) break;
      have += more;
    }
    check(have == size);
    return level;
  }
#ifdef KILN_HAS_ZSTD
  // A Zstandard block of 3 bytes and one literal unpacks to at most 128 KiB.
  constexpr std::uint64_t kMaxZstdRatio = std::uint64_t{1} << 15U;
  check(size / kMaxZstdRatio <= packed.size());
  std::string level(size, '\0');
  const std::size_t written =
      ZSTD_decompress(level.data(), level.size(), packed.data(), packed.size());
  if (ZSTD_isError(written) != 0) {
    fail("level 0", std::string("Zstandard says: ") + ZSTD_getErrorName(written), kExportAgain);
  }
  check(written == size);
  return level;
#else
  return {};
#endif
}

/// Checks that memory suffices for a level.
/// \throws what `fail` throws
void check_size(std::uint64_t width, std::uint64_t height, const TexelStorage& storage,
                const ImageLimits& limits, const FailWith& fail) {
  if (std::min(width, height) < 1 || std::max(width, height) > kLargestImageSide ||
      width * height > limits.pixels) {
    // Throws: empty_image() checks the same limits, and names the one that is exceeded
    empty_image(width, height, 1, 0, "header", limits, fail);
  }
  require_memory("its " + size_text(width, height) + " pixels", storage.size(width, height),
                 memory_failure(fail, "header"));
}

}  // namespace

bool is_ktx2(std::string_view head) { return head.starts_with(kKtx2); }
bool is_dds(std::string_view head) { return head.starts_with("DDS "); }

std::string explain_unreadable_ktx2(std::span<const std::byte> given) {
  const std::string_view bytes(reinterpret_cast<const char*>(given.data()), given.size());
  if (!is_ktx2(bytes) || bytes.size() < kKtx2Header + kKtx2Level) return "it is not a KTX 2 file";
  std::string remedy;
  return Ktx2Header(bytes).refusal_reason(remedy);
}

namespace {

/// The texel format that the first bytes of a KTX 2 or DDS file give; nullopt if Kiln does not read
/// it, or if a DDS is older than Direct3D 10.
std::optional<TexelStorage> stated_storage(const ByteSource& source) {
  constexpr std::size_t kMaxDdsHeaderBytes = 148;
  const std::string head = source.head(kMaxDdsHeaderBytes);
  if (is_ktx2(head) && head.size() >= kKtx2Header) {
    return storage_of(&FormatRow::vulkan, uint32_at(head, 12));
  }
  if (is_dds(head) && head.size() == kMaxDdsHeaderBytes && head.substr(84, 4) == "DX10") {
    return storage_of(&FormatRow::dxgi, uint32_at(head, 128));
  }
  return std::nullopt;
}

}  // namespace

bool gpu_texture_holds_floats(const ByteSource& source) {
  const std::optional<TexelStorage> storage = stated_storage(source);
  return storage && storage->is_float();
}

bool gpu_texture_has_two_channels(const ByteSource& source) {
  const std::optional<TexelStorage> storage = stated_storage(source);
  return storage && (storage->block ? block_channels(*storage->block) : storage->channels) == 2;
}

Image parse_ktx2(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const FailWith fail = image_failure(file, "KTX 2");
  const std::string bytes = read_whole(source, fail);
  if (bytes.size() < kKtx2Header + kKtx2Level)
    fail("header", "the file is cut short", kExportAgain);
  const Ktx2Header header(bytes);
  std::string remedy;
  if (const std::string reason = header.refusal_reason(remedy); !reason.empty())
    fail("header", reason, remedy);
  const TexelStorage storage = *storage_of(&FormatRow::vulkan, header.format);
  check_size(header.width, header.height, storage, limits, fail);
  if (header.at > bytes.size() || header.packed > bytes.size() - header.at) {
    fail("level 0", "it lies beyond the end of the file (truncated)", kExportAgain);
  }
  const std::string level =
      unpack_level(source, bytes, header, storage.size(header.width, header.height), fail);
  Image image = decode(storage, level, header.width, header.height, limits, fail);
  apply_swizzle(image, value_of(header.keys, "KTXswizzle"));
  if ((header.flags & 1U) != 0) divide_by_alpha(image);
  apply_orientation(image, value_of(header.keys, "KTXorientation"));
  return image;
}

namespace {

/// Bit masks of the channels in a pixel of up to 32 bits.
struct ChannelMasks {
  std::uint32_t bits = 0;
  std::array<std::uint32_t, 4> of{};  ///< Masks of red, green, blue and alpha; 0: no such channel

  std::uint32_t channels() const {
    if (of[3] != 0) return of[1] != 0 || of[0] == 0 ? 4 : 2;
    return of[1] != 0 || of[2] != 0 ? 3 : 1;
  }
  Image decode(std::string_view bytes, std::uint32_t width, std::uint32_t height,
               const ImageLimits& limits, const FailWith& fail) const {
    Image image = empty_image(width, height, channels(), 0, "header", limits, fail);
    const std::size_t size = bits / 8;
    float* to = image.pixels.data();
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
      std::uint32_t value = 0;
      for (std::size_t k = 0; k < size; ++k) {
        value |= std::uint32_t{static_cast<std::uint8_t>(bytes[i * size + k])} << (8 * k);
      }
      for (std::uint32_t c = 0; c < image.channels; ++c) {
        const std::uint32_t mask = of[image.channels == 2 && c == 1 ? 3 : c];
        if (mask == 0) {
          *to++ = 0;
          continue;
        }
        const int shift = std::countr_zero(mask);
        *to++ = static_cast<float>((value & mask) >> shift) / static_cast<float>(mask >> shift);
      }
    }
    return image;
  }
};

/// Texel format of a DDS file older than Direct3D 10, which gives a four-character code or a number
/// of D3DFORMAT.
std::optional<TexelStorage> storage_of_letters(std::string_view letters, bool& premultiplied) {
  struct Row {
    std::string_view letters;
    TexelStorage storage;
    bool premultiplied = false;
  };
  using namespace std::string_view_literals;
  static const Row rows[] = {
      {"DXT1", make_block_storage(BlockFormat::bc1)},
      {"DXT2", make_block_storage(BlockFormat::bc2), true},
      {"DXT3", make_block_storage(BlockFormat::bc2)},
      {"DXT4", make_block_storage(BlockFormat::bc3), true},
      {"DXT5", make_block_storage(BlockFormat::bc3)},
      {"RXGB", make_block_storage(BlockFormat::bc3)},
      {"ATI1", make_block_storage(BlockFormat::bc4)},
      {"BC4U", make_block_storage(BlockFormat::bc4)},
      {"BC4S", make_block_storage(BlockFormat::bc4_signed)},
      {"ATI2", make_block_storage(BlockFormat::bc5)},
      {"BC5U", make_block_storage(BlockFormat::bc5)},
      {"BC5S", make_block_storage(BlockFormat::bc5_signed)},
      {"\x24\0\0\0"sv, make_number_storage(4, 2)},
      {"\x6F\0\0\0"sv, make_number_storage(1, 2, NumberType::sfloat)},
      {"\x70\0\0\0"sv, make_number_storage(2, 2, NumberType::sfloat)},
      {"\x71\0\0\0"sv, make_number_storage(4, 2, NumberType::sfloat)},
      {"\x72\0\0\0"sv, make_number_storage(1, 4, NumberType::sfloat)},
      {"\x73\0\0\0"sv, make_number_storage(2, 4, NumberType::sfloat)},
      {"\x74\0\0\0"sv, make_number_storage(4, 4, NumberType::sfloat)},
  };
  for (const Row& row : rows) {
    if (row.letters != letters) continue;
    premultiplied = row.premultiplied;
    return row.storage;
  }
  return std::nullopt;
}

}  // namespace

Image parse_dds(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  // DDS_HEADER and DDS_HEADER_DXT10 of "Programming Guide for DDS".
  constexpr std::size_t kHeader = 128, kDx10Header = 148;
  constexpr std::uint32_t kAlpha = 0x1, kAlphaOnly = 0x2, kFourCc = 0x4, kRgb = 0x40,
                          kLuminance = 0x20000;
  constexpr std::uint32_t kCubeOrVolume = 0x200 | 0x200000, kTexture2D = 3, kCube = 0x4;
  const FailWith fail = image_failure(file, "DDS");
  const std::string bytes = read_whole(source, fail);
  if (bytes.size() < kHeader) fail("header", "the file is cut short", kExportAgain);
  const std::uint32_t height = uint32_at(bytes, 12), width = uint32_at(bytes, 16);
  const std::uint32_t flags = uint32_at(bytes, 80);
  const std::string four_character_code = bytes.substr(84, 4);
  const std::string several_pictures = "it holds several pictures (an array, a cube or a volume)";
  if ((uint32_at(bytes, 112) & kCubeOrVolume) != 0)
    fail("header", several_pictures, "Convert it to PNG.");
  std::size_t at = kHeader;
  bool premultiplied = false;
  std::optional<TexelStorage> storage;
  ChannelMasks channel_masks;
  std::string format;
  if ((flags & kFourCc) != 0 && four_character_code == "DX10") {
    if (bytes.size() < kDx10Header) fail("header", "the file is cut short", kExportAgain);
    at = kDx10Header;
    constexpr std::uint32_t kPremultiplied = 2;
    premultiplied = (uint32_at(bytes, 144) & 7U) == kPremultiplied;
    if (uint32_at(bytes, 132) > kTexture2D || uint32_at(bytes, 140) > 1 ||
        (uint32_at(bytes, 136) & kCube) != 0) {
      fail("header", several_pictures, "Convert it to PNG.");
    }
    storage = storage_of(&FormatRow::dxgi, uint32_at(bytes, 128));
    format = "DXGI_FORMAT " + std::to_string(uint32_at(bytes, 128));
  } else if ((flags & kFourCc) != 0) {
    storage = storage_of_letters(four_character_code, premultiplied);
    format = "\"" + four_character_code + "\"";
  } else if ((flags & (kRgb | kLuminance | kAlphaOnly)) != 0) {
    channel_masks.bits = uint32_at(bytes, 88);
    for (std::size_t c = 0; c < 3; ++c) channel_masks.of[c] = uint32_at(bytes, 92 + 4 * c);
    if ((flags & (kAlpha | kAlphaOnly)) != 0) channel_masks.of[3] = uint32_at(bytes, 104);
    if ((flags & kLuminance) != 0) channel_masks.of[1] = channel_masks.of[2] = 0;
    format = std::to_string(channel_masks.bits) + " bits a pixel";
    storage = make_number_storage(1, channel_masks.bits / 8);
    if (channel_masks.bits % 8 != 0 || channel_masks.bits < 8 || channel_masks.bits > 32)
      storage.reset();
  }
  for (char& letter : format) letter = letter < ' ' || letter > '~' ? '?' : letter;
  if (!storage) {
    fail("header",
         "its format is " + (format.empty() ? "not told" : format) + ", which Kiln does not read",
         "Convert it to PNG.");
  }
  check_size(width, height, *storage, limits, fail);
  const std::uint64_t size = storage->size(width, height);
  if (size > bytes.size() - at) {
    fail("pixels",
         "they need " + std::to_string(size) + " bytes, but the file has " +
             std::to_string(bytes.size() - at) + " (truncated)",
         kExportAgain);
  }
  const std::string_view level = std::string_view(bytes).substr(at, size);
  Image image = channel_masks.bits != 0 ? channel_masks.decode(level, width, height, limits, fail)
                                        : decode(*storage, level, width, height, limits, fail);
  if (premultiplied) divide_by_alpha(image);
  return image;
}

}  // namespace kiln
