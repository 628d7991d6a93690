// Sums of quantisation errors, of pictures that are not all in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/image/png.h"
#include "kiln/image.h"

namespace kiln {

/// Computes stored_error() row by row. The sums do not depend on how the rows are divided.
class StoredErrorSums {
 public:
  /// \param height  rows of the whole image
  explicit StoredErrorSums(std::size_t height);
  /// Adds rows in their order. The arguments must have been checked.
  /// \param first_row  the image's row with which `rows` begins; other than 0 only for formats of 8 bits a channel
  /// \param coverage   of these rows; empty: all texels count
  void add(const Image& rows, std::size_t first_row, const SaveImageOptions& options,
           std::span<const std::uint8_t> coverage);
  /// Adds rows like the function above, for other ways to dither and to decode. \param lossy
  /// decoded picture if the format is lossy, otherwise empty
  void add(const Image& rows, std::size_t first_row, const SaveImageOptions& options,
           const DitherBlocks& dither, const Image& lossy, std::span<const std::uint8_t> coverage);
  StoredError error() const;

 private:
  struct Sum {
    double sum = 0, max = 0;
    std::uint64_t texels = 0;
  };
  /// One sum for each block of a few rows, so that the number of threads does not change the order
  /// of additions
  std::vector<Sum> sums_;
};

}  // namespace kiln
