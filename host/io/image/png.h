// PNG: 8 or 16 bits a channel, 1 to 4 channels (grey, grey and alpha, RGB, RGBA).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/image.h"

namespace kiln {

/// Settings of a PNG.
struct PngOptions {
  int bits = 16;                      ///< A channel: 8 or 16
  bool dither = false;                ///< 8 bits only
  int threads = 0;                    ///< 0: all
  std::vector<ImageText> texts = {};  ///< A tEXt chunk each
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

/// A row as a PNG holds it, without a filter; 16 bits big-endian. \param to  of all values
void quantise_row(const Image& image, int bits, bool dither, std::size_t y, std::uint8_t* to);

/// Takes a file's bytes, one piece after the other.
using PutBytes = std::function<void(std::string_view)>;

/// The same bytes, wherever they go. \param name  for messages
void write_png(const Image& image, const PngOptions& options, const std::string& name,
               const PutBytes& send);

}  // namespace kiln
