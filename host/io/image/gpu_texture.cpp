#include "io/image/gpu_texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <string_view>

#include "base/parallel.h"
#include "io/image/png.h"
#include "kiln/error.h"
#include "kiln/version.h"
#ifdef KILN_HAS_ZSTD
#include <zstd.h>
#endif

namespace kiln {
namespace {

constexpr std::size_t kBlockSide = 4,
                      kBlockBytes = 8;  // Side of a block in texels; bytes of a block

using Bytes = std::vector<std::uint8_t>;

/// The shades of a block: the eight values that it can represent, evenly spaced from one endpoint
/// to the other. If the first endpoint is not greater than the second, only six are spaced so, and
/// the other two are 0 and 255.
std::array<float, 8> shades_of(std::uint8_t first, std::uint8_t second) {
  const float a = first, b = second;
  std::array<float, 8> shades{a, b};
  const int steps = first > second ? 7 : 5;
  const auto count = static_cast<float>(steps);
  for (int k = 1; k < steps; ++k) {
    const auto at = static_cast<float>(k);
    shades[static_cast<std::size_t>(k) + 1] = ((count - at) * a + at * b) / count;
  }
  if (steps == 5) shades[6] = 0, shades[7] = 255;
  return shades;
}

struct Endpoints {
  int low = 0, high = 0;
};

/// Squared error of values that are each quantised to the nearest shade: `steps` + 1 evenly spaced
/// ones, and with 5 steps also 0 and 255.
float error_of(const BlockValues& values, const Endpoints& endpoints, int steps) {
  const auto low = static_cast<float>(endpoints.low);
  const auto step = static_cast<float>(endpoints.high - endpoints.low) / static_cast<float>(steps);
  const float scale = step > 0 ? 1 / step : 0;
  std::array<float, 16> squared_errors{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    const float place = std::min(std::max((value - low) * scale, 0.0F), static_cast<float>(steps));
    const auto nearest = static_cast<float>(static_cast<int>(place + 0.5F));
    const float off = value - (low + nearest * step);
    squared_errors[i] = off * off;
  }
  if (steps == 5) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float squared_from_0 = values[i], above = 255 - squared_from_0;
      squared_errors[i] =
          std::min({squared_errors[i], squared_from_0 * squared_from_0, above * above});
    }
  }
  for (std::size_t half = squared_errors.size() / 2; half > 0; half /= 2) {
    for (std::size_t i = 0; i < half; ++i) squared_errors[i] += squared_errors[i + half];
  }
  return squared_errors[0];
}

/// Coordinate descent: moves the endpoints by `step` as long as the error decreases, then by half
/// as much, and so on.
void improve_endpoints(const BlockValues& values, int steps, int step, Endpoints& best,
                       float& least) {
  for (; step > 0; step /= 2) {
    for (bool is_better = least > 0; is_better;) {
      is_better = false;
      const Endpoints from = best;
      const int search_steps = step == 1 ? 2 : 1, side = 2 * search_steps + 1;
      for (int move = 0; move < side * side; ++move) {
        const Endpoints endpoints{
            std::clamp(from.low + (move % side - search_steps) * step, 0, 255),
            std::clamp(from.high + (move / side - search_steps) * step, 0, 255)};
        if (endpoints.low > endpoints.high) continue;
        const float error = error_of(values, endpoints, steps);
        if (error >= least) continue;
        least = error;
        best = endpoints;
        is_better = true;
      }
    }
  }
}

/// Searches the best endpoints near the lowest and the highest value. With 5 steps, values that the
/// shades 0 and 255 represent are ignored.
/// \returns the squared error
float search_endpoints(const BlockValues& values, int steps, Endpoints& best) {
  float low = 255, high = 0;
  for (const float value : values) {
    if (steps == 5 && (value < 0.5F || value > 254.5F)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) low = high = 0;
  best = {static_cast<int>(std::floor(low)), static_cast<int>(std::ceil(high))};
  float least_error = error_of(values, best, steps);
  // It never helps to move an endpoint inward by more than half of the distance between shades.
  const auto range = static_cast<unsigned>(best.high - best.low);
  improve_endpoints(values, steps, static_cast<int>(std::bit_floor(std::max(1U, range / 14))), best,
                    least_error);
  if (steps == 7) return least_error;
  // If values near 0 and 255 use those two shades, the best endpoints for the other values may lie
  // anywhere, so a coarse grid of endpoints is tried.
  constexpr int kCoarseStep = 16;
  Endpoints coarse_endpoints;
  float error = std::numeric_limits<float>::infinity();
  for (int i = kCoarseStep / 2; i < 256; i += kCoarseStep) {
    for (int k = i; k < 256; k += kCoarseStep) {
      const float other = error_of(values, {i, k}, steps);
      if (other < error) error = other, coarse_endpoints = {i, k};
    }
  }
  improve_endpoints(values, steps, kCoarseStep / 2, coarse_endpoints, error);
  if (error < least_error) least_error = error, best = coarse_endpoints;
  return least_error;
}

std::size_t blocks_along(std::uint32_t side) { return (side + kBlockSide - 1) / kBlockSide; }

/// The texels of a level in the layout of the file.
Bytes texels_of(const Image& image, const TextureFormat& format) {
  const std::size_t rows = format.in_blocks ? blocks_along(image.height) : image.height;
  const std::size_t row = format.in_blocks
                              ? blocks_along(image.width) * format.channels * kBlockBytes
                              : std::size_t{image.width} * format.channels;
  Bytes bytes(rows * row);
  parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
    Bytes values(std::size_t{image.width} * image.channels);
    for (std::size_t y = begin; y < end; ++y) {
      std::uint8_t* const to = &bytes[y * row];
      if (format.in_blocks) {
        encode_blocks(image, format, y, to);
        continue;
      }
      quantise_row(image, 8, DitherBlocks(), y, values.data());
      const bool is_grey = image.channels < 3 && format.channels == 4;
      for (std::size_t x = 0; x < image.width; ++x) {
        const std::uint8_t* const from = &values[x * image.channels];
        for (std::size_t c = 0; c < format.channels; ++c) {
          to[x * format.channels + c] = c == 3 && image.channels != 4 ? 255 : from[is_grey ? 0 : c];
        }
      }
    }
  });
  return bytes;
}

template <typename T>
void put(Bytes& to, T value) {
  for (std::size_t k = 0; k < sizeof value; ++k)
    to.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
}
void put_words(Bytes& to, std::initializer_list<std::uint32_t> words) {
  for (const std::uint32_t word : words) put(to, word);
}

std::vector<std::byte> as_bytes(const Bytes& from) {
  std::vector<std::byte> bytes(from.size());
  std::memcpy(bytes.data(), from.data(), from.size());
  return bytes;
}

}  // namespace

TextureFormat TextureFormat::of(const Image& image, TextureUse use) {
  const bool blocks = image.width % kBlockSide == 0 && image.height % kBlockSide == 0;
  const std::uint32_t channels = use == TextureUse::tangent_normal ? 2 : image.channels;
  if (use == TextureUse::color) return {43, 29, 4, true, false};  // R8G8B8A8_SRGB
  if (channels == 1 && blocks) return {139, 80, 1, false, true};  // BC4_UNORM
  if (channels == 2 && blocks) return {141, 83, 2, false, true};  // BC5_UNORM
  if (channels == 1) return {9, 61, 1, false, false};             // R8_UNORM
  if (channels == 2) return {16, 49, 2, false, false};            // R8G8_UNORM
  return {37, 28, 4, false, false};                               // R8G8B8A8_UNORM
}

std::array<std::uint8_t, 8> encode_bc4(const BlockValues& values) {
  Endpoints endpoints;
  bool greater_first = true;
  const float error = search_endpoints(values, 7, endpoints);
  const bool has_ends =
      std::any_of(values.begin(), values.end(), [](float v) { return v < 0.5F || v > 254.5F; });
  if (error > 0 && has_ends) {
    Endpoints inner_endpoints;
    if (search_endpoints(values, 5, inner_endpoints) < error) {
      endpoints = inner_endpoints;
      greater_first = false;
    }
  }
  std::array<std::uint8_t, 8> block{
      static_cast<std::uint8_t>(greater_first ? endpoints.high : endpoints.low),
      static_cast<std::uint8_t>(greater_first ? endpoints.low : endpoints.high)};
  const std::array<float, 8> shades = shades_of(block[0], block[1]);
  std::uint64_t indices = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto nearest = std::min_element(shades.begin(), shades.end(), [&](float a, float b) {
      return std::abs(a - values[i]) < std::abs(b - values[i]);
    });
    indices |= static_cast<std::uint64_t>(nearest - shades.begin()) << (3 * i);
  }
  for (std::size_t k = 0; k < 6; ++k) block[2 + k] = static_cast<std::uint8_t>(indices >> (8 * k));
  return block;
}

BlockValues decode_bc4(std::span<const std::uint8_t> block) {
  const std::array<float, 8> shades = shades_of(block[0], block[1]);
  std::uint64_t indices = 0;
  for (std::size_t k = 0; k < 6; ++k) indices |= std::uint64_t{block[2 + k]} << (8 * k);
  BlockValues values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = shades[indices >> (3 * i) & 7U];
  return values;
}

void encode_blocks(const Image& image, const TextureFormat& format, std::size_t y,
                   std::uint8_t* to) {
  BlockValues values{};
  for (std::size_t block = 0; block < blocks_along(image.width); ++block) {
    for (std::size_t c = 0; c < format.channels; ++c, to += kBlockBytes) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t column =
            std::min<std::size_t>(kBlockSide * block + i % kBlockSide, image.width - 1);
        const std::size_t row =
            std::min<std::size_t>(kBlockSide * y + i / kBlockSide, image.height - 1);
        const float value = image.at(column, row)[c];
        values[i] = value > 0 ? std::min(value, 1.0F) * 255 : 0;  // NaN becomes 0
      }
      std::ranges::copy(encode_bc4(values), to);
    }
  }
}

std::vector<std::byte> encode_ktx2(std::span<const Image* const> levels, TextureUse use) {
#ifdef KILN_HAS_ZSTD
  // KTX 2.0, sections 3 and 4; Khronos Data Format 1.3, section 5 (basic descriptor block).
  constexpr std::uint32_t kHeader = 80, kLevel = 24, kZstd = 2, kKeyPadding = 4;
  constexpr int kEffort = 9;
  const TextureFormat format = TextureFormat::of(*levels[0], use);
  const auto count = static_cast<std::uint32_t>(levels.size());

  Bytes descriptor;
  const std::uint32_t bits = format.in_blocks ? 64 : 8, samples = format.channels;
  const std::uint32_t size = 24 + 16 * samples;
  // Codes of the Data Format: colour models RGBSDA 1, BC4 131 and BC5 132; the primaries of sRGB;
  // transfer functions linear 1 and sRGB 2.
  const std::uint32_t color_model = !format.in_blocks ? 1 : samples == 1 ? 131 : 132;
  const std::uint32_t side = format.in_blocks ? kBlockSide - 1 : 0;
  put_words(descriptor, {size + 4, 0, 2U | size << 16U,
                         color_model | 1U << 8U | (format.is_srgb ? 2U : 1U) << 16U,
                         side | side << 8U, samples * bits / 8, 0});
  for (std::uint32_t c = 0; c < samples; ++c) {
    const std::uint32_t channel = c == 3 ? 15 : c;
    // Alpha is linear even if the colours are sRGB-encoded
    const std::uint32_t linear = c == 3 && format.is_srgb ? 1U << 4U : 0;
    put_words(descriptor, {c * bits | (bits - 1) << 16U | (channel | linear) << 24U, 0, 0,
                           format.in_blocks ? 0xFFFFFFFFU : 255U});
  }
  Bytes keys;
  using namespace std::string_view_literals;
  const std::string writer = "Kiln " + std::string(version());
  for (const auto& [key, value] : {std::pair("KTXorientation"sv, "rd"sv),
                                   std::pair("KTXwriter"sv, std::string_view(writer))}) {
    put(keys, static_cast<std::uint32_t>(key.size() + value.size() + 2));
    for (const std::string_view text : {key, value}) {
      keys.insert(keys.end(), text.begin(), text.end());
      keys.push_back(0);
    }
    keys.resize((keys.size() + kKeyPadding - 1) / kKeyPadding * kKeyPadding);
  }

  const std::uint32_t at = kHeader + kLevel * count;
  Bytes file = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
  put_words(file, {format.vulkan, 1, levels[0]->width, levels[0]->height, 0, 0, 1, count, kZstd, at,
                   static_cast<std::uint32_t>(descriptor.size()),
                   at + static_cast<std::uint32_t>(descriptor.size()),
                   static_cast<std::uint32_t>(keys.size()), 0, 0, 0, 0});
  file.resize(at);
  file.insert(file.end(), descriptor.begin(), descriptor.end());
  file.insert(file.end(), keys.begin(), keys.end());
  for (std::uint32_t k = count; k-- > 0;) {  // KTX 2 stores the smallest level first
    const Bytes texels = texels_of(*levels[k], format);
    Bytes packed_level(ZSTD_compressBound(texels.size()));
    const std::size_t written = ZSTD_compress(packed_level.data(), packed_level.size(),
                                              texels.data(), texels.size(), kEffort);
    if (ZSTD_isError(written) != 0) throw std::bad_alloc();
    Bytes key_entry;
    for (const std::size_t value : {file.size(), written, texels.size()}) {
      put(key_entry, static_cast<std::uint64_t>(value));
    }
    std::ranges::copy(key_entry, file.begin() + kHeader + kLevel * std::ptrdiff_t{k});
    file.insert(file.end(), packed_level.begin(),
                packed_level.begin() + static_cast<std::ptrdiff_t>(written));
  }
  return as_bytes(file);
#else
  static_cast<void>(levels);
  static_cast<void>(use);
  throw Error(
      ErrorCode::usage,
      "KTX 2 cannot be written: this build of Kiln was made without libzstd. Choose DDS, or "
      "build with KILN_ZSTD=ON where libzstd is installed.");
#endif
}

std::vector<std::byte> encode_dds(std::span<const Image* const> levels, TextureUse use) {
  // DDS_HEADER and DDS_HEADER_DXT10 of "Programming Guide for DDS".
  constexpr std::uint32_t kCaps = 0x1, kHeight = 0x2, kWidth = 0x4, kPitch = 0x8,
                          kPixelFormat = 0x1000, kMips = 0x20000, kLinearSize = 0x80000;
  constexpr std::uint32_t kTexture = 0x1000, kComplex = 0x8, kMipMap = 0x400000;
  constexpr std::uint32_t kFourCc = 0x4, kDx10 = 0x30315844, kTexture2D = 3;
  const TextureFormat format = TextureFormat::of(*levels[0], use);
  const Image& image = *levels[0];
  const bool has_mips = levels.size() > 1;
  const Bytes first = texels_of(image, format);
  const std::size_t pitch = format.in_blocks ? first.size() : first.size() / image.height;
  if (pitch > 0xFFFFFFFFU) throw Error(ErrorCode::usage, "a DDS of such an image is not possible.");
  Bytes file = {'D', 'D', 'S', ' '};
  put_words(file, {124,
                   kCaps | kHeight | kWidth | kPixelFormat |
                       (format.in_blocks ? kLinearSize : kPitch) | (has_mips ? kMips : 0),
                   image.height, image.width, static_cast<std::uint32_t>(pitch), 0,
                   static_cast<std::uint32_t>(levels.size())});
  put_words(file, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  put_words(file, {32, kFourCc, kDx10, 0, 0, 0, 0, 0});
  put_words(file, {kTexture | (has_mips ? kComplex | kMipMap : 0), 0, 0, 0, 0});
  const bool has_alpha = format.channels == 4 && image.channels == 4;
  // Alpha is straight, not premultiplied
  put_words(file, {format.dxgi, kTexture2D, 0, 1, has_alpha ? 1U : 0U});
  for (const Image* level : levels) {
    const Bytes texels = level == levels[0] ? first : texels_of(*level, format);
    file.insert(file.end(), texels.begin(), texels.end());
  }
  return as_bytes(file);
}

}  // namespace kiln
