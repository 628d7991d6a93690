// PNG: 8 or 16 bits a channel, 1 to 4 channels (grey, grey and alpha, RGB, RGBA).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/asset.h"
#include "kiln/image_format.h"

namespace kiln {

/// Compression effort of a PNG. The pixels are the same.
enum class Deflate {
  fast,      ///< Run lengths only, on all threads
  small,     ///< The best filter for a sample of rows; libdeflate if it was built in, else zlib
  smallest,  ///< As `small`, at the library's highest level: seconds per million pixels
};

/// Settings of a PNG.
struct PngOptions {
  int bits = 16;                        ///< Bits per channel: 8 or 16
  Dither dither = Dither::off;          ///< Used for 8 bits only
  int threads = 0;                      ///< 0: one per core
  std::vector<ImageText> texts = {};    ///< Texts; each becomes a tEXt chunk
  TextureUse use = TextureUse::values;  ///< Content of the channels, for Dither::automatic
  Deflate deflate = Deflate::fast;
};

/// Writes a PNG with 8 or 16 bits per channel. Values are clamped to [0, 1] (NaN becomes 0), scaled in double
/// precision and rounded to nearest, ties to even. So k/255 and k/65535 are preserved. With `dither` (8 bits), the
/// fraction is compared with an ordered 8x8 threshold instead (Bayer 1973), which preserves k/255, too.
///
/// No gamma, colour-space or time chunk is written: maps are data, and the same image gives the same
/// bytes.
///
/// Bands of rows are filtered and deflated on `threads` threads (0: all). Each ends on a byte boundary
/// (Z_SYNC_FLUSH), and they are concatenated into one zlib stream. Bands do not depend on the number
/// of threads, so neither do the bytes. Cost and size for 4096^2 RGB16: see the source.
/// \throws Error(output)
void save_png(const Image& image, const std::filesystem::path& path, const PngOptions& options);

/// Selects which squares of an 8-bit image are dithered.
class DitherBlocks {
 public:
  /// Side of a square that is dithered or rounded as a whole, texels.
  static constexpr std::size_t kSide = 32;
  /// \param use  content of the image: for normals, Dither::automatic rounds z instead of dithering it
  DitherBlocks(const Image& image, Dither dither, TextureUse use = TextureUse::values);
  /// Creates an object that dithers no square.
  DitherBlocks() = default;

  bool anywhere() const { return everywhere_ || !blocks_.empty(); }
  /// Channels to dither in the square of a texel, one bit each.
  std::uint8_t channels_at(std::size_t x, std::size_t y) const {
    return everywhere_ ? 0xFF : blocks_.empty() ? 0 : blocks_[y / kSide * columns_ + x / kSide];
  }

 private:
  bool everywhere_ = false;
  std::size_t columns_ = 0;
  std::vector<std::uint8_t> blocks_;  ///< Empty: no dithering
};

/// Quantises a row to the bytes of a PNG, without the filter byte; 16-bit values are big-endian.
/// \param to  receives the bytes of all values
void quantise_row(const Image& image, int bits, const DitherBlocks& dither, std::size_t y,
                  std::uint8_t* to);

/// Receives a file's bytes, one piece after the other.
using PutBytes = std::function<void(std::string_view)>;

/// Passes a PNG's bytes to `put`.
/// \param name  file name for messages
void write_png(const Image& image, const PngOptions& options, const std::string& name,
               const PutBytes& send);

}  // namespace kiln
