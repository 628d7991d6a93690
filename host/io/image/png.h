// PNG: 8 or 16 bits a channel, 1 to 4 channels (grey, grey and alpha, RGB, RGBA).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/asset.h"
#include "kiln/image.h"

namespace kiln {

/// How hard the bytes of a PNG are packed. The pixels are the same.
enum class Deflate {
  fast,  ///< Runs alone, on all threads
  small,  ///< One filter of several, by a sample of rows; libdeflate where it was built in, else zlib
  smallest,  ///< As `small`, at the library's highest level: seconds for each million pixels
};

/// Settings of a PNG.
struct PngOptions {
  int bits = 16;                        ///< A channel: 8 or 16
  Dither dither = Dither::off;          ///< 8 bits only
  int threads = 0;                      ///< 0: all
  std::vector<ImageText> texts = {};    ///< A tEXt chunk each
  TextureUse use = TextureUse::values;  ///< For Dither::automatic
  Deflate deflate = Deflate::fast;
};

/// Writes with 8 or 16 bits a channel. Values are clamped to [0, 1] (NaN becomes 0), scaled in
/// double precision and rounded to nearest, ties to even. So k/255 and k/65535 come back as they
/// were. With `dither` (8 bits), the fraction is compared with an ordered 8x8 threshold instead
/// (Bayer 1973), which keeps such values too.
///
/// No gamma, colour-space or time chunk is written: maps are data, and the same image gives the same
/// bytes.
///
/// Bands of rows are filtered and deflated on `threads` threads (0: all). Each ends on a byte boundary
/// (Z_SYNC_FLUSH), and they are joined to one zlib stream. The bands do not depend on the number of
/// threads, so neither do the bytes. Cost and size for 4096^2 RGB16: see the source.
/// \throws Error(output)
void save_png(const Image& image, const std::filesystem::path& path, const PngOptions& options);

/// Where an image of 8 bits is dithered.
class DitherBlocks {
 public:
  /// Side of a square of texels that is dithered, or rounded, as one.
  static constexpr std::size_t kSide = 32;
  /// \param use  of normals: z is rounded by Dither::automatic
  DitherBlocks(const Image& image, Dither dither, TextureUse use = TextureUse::values);
  /// Nowhere.
  DitherBlocks() = default;

  bool anywhere() const { return everywhere_ || !blocks_.empty(); }
  /// A bit a channel, of the square that a texel lies in.
  std::uint8_t channels_at(std::size_t x, std::size_t y) const {
    return everywhere_ ? 0xFF : blocks_.empty() ? 0 : blocks_[y / kSide * columns_ + x / kSide];
  }

 private:
  bool everywhere_ = false;
  std::size_t columns_ = 0;
  std::vector<std::uint8_t> blocks_;  ///< Empty: none
};

/// A row as a PNG holds it, without a filter; 16 bits big-endian. \param to  of all values
void quantise_row(const Image& image, int bits, const DitherBlocks& dither, std::size_t y,
                  std::uint8_t* to);

/// Takes a file's bytes, one piece after the other.
using PutBytes = std::function<void(std::string_view)>;

/// The same bytes, wherever they go. \param name  for messages
void write_png(const Image& image, const PngOptions& options, const std::string& name,
               const PutBytes& send);

}  // namespace kiln
