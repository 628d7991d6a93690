// Hashes of arrays tell apart what differs anywhere.
#include "base/byte_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

namespace kiln {
namespace {

// Sizes around the words and the lanes that are hashed together.
TEST(FastHash, KnowsEachByteAndWhereArraysEnd) {
  std::set<std::uint64_t> seen;
  std::size_t count = 0;
  for (std::size_t size = 0; size < 100; ++size) {
    std::vector<std::uint8_t> bytes(size);
    seen.insert(fast_hash(bytes));
    ++count;
    for (std::size_t i = 0; i < size; ++i) {
      for (const std::uint8_t bit : {1, 128}) {
        bytes[i] = bit;
        seen.insert(fast_hash(bytes));
        ++count;
      }
      bytes[i] = 0;
    }
  }
  EXPECT_EQ(seen.size(), count);
  const std::vector<std::uint32_t> a{1, 2, 3}, ab{1, 2, 3, 4, 5}, b{4, 5}, none;
  EXPECT_NE(fast_hash(a, b), fast_hash(ab, none));
  EXPECT_NE(fast_hash(a, b), fast_hash(b, a));
  EXPECT_EQ(fast_hash(a, b), fast_hash(std::vector<std::uint32_t>(a), b));
}

// Words a lane apart are not exchanged unnoticed, nor are words of one lane.
TEST(FastHash, KnowsTheOrderOfWords) {
  std::vector<std::uint64_t> words(64);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = i * i * i + 7;
  std::set<std::uint64_t> seen{fast_hash(words)};
  std::size_t count = 1;
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (std::size_t k = i + 1; k < words.size(); ++k) {
      std::swap(words[i], words[k]);
      seen.insert(fast_hash(words));
      ++count;
      std::swap(words[i], words[k]);
    }
  }
  EXPECT_EQ(seen.size(), count);
}

// Pieces that end within words, within blocks and within what is buffered.
TEST(PieceHash, EqualsTheHashOfTheWhole) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, (std::size_t{1} << 20) + 3,
                                 std::size_t{1} << 24, (std::size_t{5} << 23) + 1}) {
    std::vector<std::uint8_t> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
    PieceHash hash(size);
    std::size_t piece = 1;
    for (std::size_t at = 0; at < size; at += piece, piece = piece * 3 + 1) {
      hash.add(bytes.data() + at, std::min(piece, size - at));
    }
    EXPECT_EQ(hash.value(), hash_bytes(bytes)) << size;
  }
}

}  // namespace
}  // namespace kiln
