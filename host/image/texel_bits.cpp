#include "image/texel_bits.h"

#include "base/parallel.h"

namespace kiln {

TexelBits dilated(const TexelBits& from) {
  TexelBits result(from.width(), from.height());
  const std::size_t words = from.words_in_row();
  parallel_for(from.height(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      std::uint64_t* const to = result.row(y);
      const auto column_union = [&](std::size_t w) {
        std::uint64_t bits = from.row(y)[w];
        if (y > 0) bits |= from.row(y - 1)[w];
        if (y + 1 < from.height()) bits |= from.row(y + 1)[w];
        return bits;
      };
      std::uint64_t previous_word = 0, word = column_union(0);
      for (std::size_t w = 0; w < words; ++w) {
        const std::uint64_t next_word = w + 1 < words ? column_union(w + 1) : 0;
        to[w] = word | word << 1U | word >> 1U | previous_word >> 63U | next_word << 63U;
        previous_word = word, word = next_word;
      }
      to[words - 1] &= from.last_word();
    }
  });
  return result;
}

}  // namespace kiln
