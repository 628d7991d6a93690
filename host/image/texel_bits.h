// A set of a picture's texels, with one bit per texel.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

/// A set of texels. The bits of each row start in a new word.
class TexelBits {
 public:
  TexelBits() = default;
  TexelBits(std::uint32_t width, std::uint32_t height)
      : width_(width),
        height_(height),
        row_((std::size_t{width} + 63) / 64),
        bit_words_(row_ * height) {}

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  bool has(std::size_t x, std::size_t y) const {
    return (bit_words_[y * row_ + x / 64] >> (x % 64) & 1U) != 0;
  }
  /// \param texel  y * width() + x
  bool has(std::size_t texel) const { return has(texel % width_, texel / width_); }

  /// The words of a row; bits beyond the width are 0.
  std::uint64_t* row(std::size_t y) { return &bit_words_[y * row_]; }
  const std::uint64_t* row(std::size_t y) const { return &bit_words_[y * row_]; }
  std::size_t words_in_row() const { return row_; }
  /// Mask of the bits of a row's last word that stand for texels.
  std::uint64_t last_word() const {
    return width_ % 64 == 0 ? ~std::uint64_t{0} : (std::uint64_t{1} << (width_ % 64)) - 1;
  }

  /// Adds the texels [begin, end) of a row. Thread-safe.
  void add(std::size_t y, std::size_t begin, std::size_t end) {
    while (begin < end) {
      const std::size_t word = begin / 64, first = begin % 64;
      const std::size_t stop = end - word * 64 < 64 ? end - word * 64 : 64;
      std::uint64_t bits = ~std::uint64_t{0} << first;
      if (stop < 64) bits &= (std::uint64_t{1} << stop) - 1;
      const std::atomic_ref<std::uint64_t> at(bit_words_[y * row_ + word]);
      // Triangles overlap, so texels are often in the set already, and testing that costs less than
      // an atomic write.
      if ((at.load(std::memory_order_relaxed) & bits) != bits) {
        at.fetch_or(bits, std::memory_order_relaxed);
      }
      begin = word * 64 + stop;
    }
  }

 private:
  std::uint32_t width_ = 0, height_ = 0;
  std::size_t row_ = 0;
  std::vector<std::uint64_t> bit_words_;
};

/// The set together with all neighbours of its texels, including diagonal ones.
TexelBits dilated(const TexelBits& from);

}  // namespace kiln
