// PNG: 8 or 16 bits a channel, 1 to 4 channels (grey, grey and alpha, RGB, RGBA).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/image/image_rows.h"
#include "kiln/asset.h"
#include "kiln/image_format.h"

namespace kiln {

/// How much effort is spent on compressing a PNG. The pixels do not depend on it.
enum class Deflate {
  fast,  ///< Searches only for runs of one byte; uses all threads
  /// Chooses the filter that is best for a sample of the rows; uses libdeflate if it was built in,
  /// otherwise zlib
  small,
  /// Compresses like `small`, but at the library's highest level, which takes seconds per million
  /// pixels
  smallest,
};

/// Settings of a PNG.
struct PngOptions {
  int bits = 16;                        ///< Bits per channel: 8 or 16
  Dither dither = Dither::off;          ///< Used with 8 bits only
  int threads = 0;                      ///< Number of threads; 0: one per core
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
  /// The image is divided into squares of this side, in texels. Each square is dithered as a whole, or not.
  static constexpr std::size_t kSide = 32;
  /// \param use  content of the image: for normals, Dither::automatic rounds z instead of dithering it
  DitherBlocks(const Image& image, Dither dither, TextureUse use = TextureUse::values);
  /// Dithers no square.
  DitherBlocks() = default;

  bool dithers_any() const { return dithers_everywhere_ || !blocks_.empty(); }
  /// Which channels are dithered in the square that contains a texel, as one bit each.
  std::uint8_t channels_at(std::size_t x, std::size_t y) const {
    return dithers_everywhere_ ? 0xFF
           : blocks_.empty()   ? 0
                               : blocks_[y / kSide * columns_ + x / kSide];
  }

 private:
  bool dithers_everywhere_ = false;
  std::size_t columns_ = 0;
  std::vector<std::uint8_t> blocks_;  ///< If empty, no square is dithered
};

/// Quantises a row to the bytes that a PNG stores, without the filter byte; 16-bit values are
/// big-endian.
/// \param y   row of the whole image
/// \param to  receives the bytes of all values
/// \param first_row  the row of the whole image with which `image` begins
void quantise_row(const Image& image, int bits, const DitherBlocks& dither, std::size_t y,
                  std::uint8_t* to, std::size_t first_row = 0);

/// Receives the bytes of a file in consecutive pieces.
using PutBytes = std::function<void(std::string_view)>;

/// Writes a PNG row by row: the bytes of write_png() with Deflate::fast.
class PngRows {
 public:
  /// Writes the header.
  /// \param dither  of the whole image
  /// \param name    file name for messages
  PngRows(const ImageShape& shape, const PngOptions& options, DitherBlocks dither, std::string name,
          PutBytes put);
  ~PngRows();
  PngRows(const PngRows&) = delete;
  PngRows& operator=(const PngRows&) = delete;

  /// Appends rows. \param rows  the next rows; of the image's width and channels
  void put(const Image& rows);
  /// Completes the file. All rows must have been put.
  void finish();

 private:
  struct Band;
  const std::uint8_t* row(const Image& rows, std::size_t y,
                          std::vector<std::uint8_t>& scratch) const;
  Band encode_band(const Image& rows, std::size_t first, std::size_t last) const;

  ImageShape shape_;
  int bits_, threads_;
  DitherBlocks dither_;
  std::string name_;
  PutBytes put_;
  std::size_t row_bytes_, band_rows_;
  std::size_t next_row_ = 0;        ///< Number of rows that were added so far
  std::vector<std::uint8_t> kept_;  ///< Quantised rows [first_kept_, next_row_)
  std::size_t first_kept_ = 0;
  unsigned long adler_;
};

/// Passes a PNG's bytes to `put`.
/// \param name  file name for messages
void write_png(const Image& image, const PngOptions& options, const std::string& name,
               const PutBytes& send);

}  // namespace kiln
