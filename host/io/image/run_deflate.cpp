#include "io/image/run_deflate.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <queue>
#include <utility>

namespace kiln {
namespace {

// RFC 1951, 3.2.5 and 3.2.7.
constexpr std::size_t kSymbols = 286, kEnd = 256, kFirstLength = 257;
constexpr std::size_t kLeastRun = 3, kMostRun = 258;
constexpr int kMostBits = 15;
// Bytes with Huffman codes of their own: half as many or twice as many change files by a thousandth.
constexpr std::size_t kBlock = std::size_t{1} << 16;
// A run of n is the token kRun + n; a literal is its own token.
constexpr std::uint16_t kRun = 256;

struct LengthCode {
  std::uint16_t symbol = 0;
  std::uint8_t extra_bits = 0;
  std::uint16_t extra = 0;
};

constexpr std::array<LengthCode, kMostRun + 1> make_length_codes() {
  std::array<LengthCode, kMostRun + 1> codes{};
  std::size_t length = kLeastRun;
  for (std::size_t symbol = kFirstLength; symbol < kSymbols - 1; ++symbol) {
    const std::size_t place = symbol - kFirstLength;
    const std::size_t bits = place < 8 ? 0 : place / 4 - 1;
    for (std::size_t extra = 0; extra < std::size_t{1} << bits && length < kMostRun; ++extra) {
      codes[length++] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint8_t>(bits),
                         static_cast<std::uint16_t>(extra)};
    }
  }
  codes[kMostRun] = {kSymbols - 1, 0, 0};
  return codes;
}
constexpr std::array<LengthCode, kMostRun + 1> kLengthCodes = make_length_codes();

using Counts = std::array<std::uint32_t, kSymbols>;
using Lengths = std::array<std::uint8_t, kSymbols>;

/// Literals and runs; counts what they are.
std::vector<std::uint16_t> tokens_of(std::span<const std::uint8_t> raw, Counts& counts) {
  std::vector<std::uint16_t> tokens(raw.size());
  std::uint16_t* to = tokens.data();
  const std::uint8_t* at = raw.data();
  const std::uint8_t* const end = at + raw.size();
  const auto put = [&](std::uint8_t byte) {
    *to++ = byte;
    ++counts[byte];
  };
  if (at != end) put(*at++);
  while (at != end) {
    if (end - at < static_cast<std::ptrdiff_t>(kLeastRun) || at[0] != at[-1] || at[1] != at[-1] ||
        at[2] != at[-1]) {
      put(*at++);
      continue;
    }
    const std::uint8_t* const most = std::min(end, at + kMostRun);
    const std::uint8_t* next = at + kLeastRun;
    while (next != most && *next == at[-1]) ++next;
    const auto length = static_cast<std::size_t>(next - at);
    ++counts[kLengthCodes[length].symbol];
    *to++ = static_cast<std::uint16_t>(kRun + length);
    at = next;
  }
  ++counts[kEnd];
  if (raw.empty()) ++counts[0];  // a code has two symbols at least
  tokens.resize(static_cast<std::size_t>(to - tokens.data()));
  return tokens;
}

/// Lengths of Huffman codes, without a bound. \returns the longest
int huffman(const Counts& counts, Lengths& lengths) {
  using Node = std::pair<std::uint64_t, std::uint32_t>;  // count, number: ties go to the lower one
  std::priority_queue<Node, std::vector<Node>, std::greater<>> open;
  std::vector<std::uint32_t> parent(2 * kSymbols);
  std::uint32_t next = kSymbols;
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    if (counts[i] != 0) open.emplace(counts[i], i);
  }
  while (open.size() > 1) {
    const Node a = open.top();
    open.pop();
    const Node b = open.top();
    open.pop();
    parent[a.second] = parent[b.second] = next;
    open.emplace(a.first + b.first, next++);
  }
  int longest = 0;
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    lengths[i] = 0;
    if (counts[i] == 0) continue;
    int length = 0;
    for (std::uint32_t node = i; node != next - 1; node = parent[node]) ++length;
    lengths[i] = static_cast<std::uint8_t>(std::min(length, 255));
    longest = std::max(longest, length);
  }
  return longest;
}

/// Lengths of at most kMostBits: counts are flattened until they are.
Lengths code_lengths(Counts counts) {
  Lengths lengths{};
  while (huffman(counts, lengths) > kMostBits) {
    for (std::uint32_t& count : counts) count = count == 0 ? 0 : count / 2 + 1;
  }
  return lengths;
}

std::uint32_t reversed(std::uint32_t code, int bits) {
  std::uint32_t result = 0;
  for (; bits > 0; --bits, code >>= 1) result = result << 1 | (code & 1U);
  return result;
}

/// Canonical codes, their bits in the order that they are written in.
std::array<std::uint32_t, kSymbols> codes_of(const Lengths& lengths) {
  std::array<std::uint32_t, kMostBits + 2> next{};
  for (const std::uint8_t length : lengths) {
    if (length != 0) ++next[length + 1U];
  }
  for (std::size_t bits = 1; bits < next.size(); ++bits)
    next[bits] = (next[bits] + next[bits - 1]) << (bits > 1 ? 1 : 0);
  std::array<std::uint32_t, kSymbols> codes{};
  for (std::size_t i = 0; i < kSymbols; ++i) {
    if (lengths[i] != 0) codes[i] = reversed(next[lengths[i]]++, lengths[i]);
  }
  return codes;
}

class BitWriter {
 public:
  /// Before so many bytes are put.
  void reserve(std::size_t more) { bytes_.resize(size_ + more); }
  /// \param count  32 at most
  void put(std::uint64_t bits, int count) {
    held_ |= bits << count_;
    count_ += count;
    if (count_ < 32) return;
    for (int i = 0; i < 4; ++i) bytes_[size_ + i] = static_cast<std::uint8_t>(held_ >> (8 * i));
    size_ += 4;
    held_ >>= 32;
    count_ -= 32;
  }
  /// Zeros up to the next whole byte.
  void align() {
    for (; count_ > 0; count_ -= 8, held_ >>= 8) {
      bytes_[size_++] = static_cast<std::uint8_t>(held_);
    }
    count_ = 0;
  }
  std::vector<std::uint8_t> take() {
    bytes_.resize(size_);
    return std::move(bytes_);
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t size_ = 0;
  std::uint64_t held_ = 0;
  int count_ = 0;
};

/// The block's header. Lengths are written with 4 bits each: what runs of them would save is a few bytes.
void put_header(const Lengths& lengths, bool last, BitWriter& writer) {
  writer.put(last ? 1 : 0, 1);
  writer.put(2, 2);  // dynamic codes
  writer.put(kSymbols - kFirstLength, 5);
  writer.put(0, 5);  // one distance
  writer.put(19 - 4, 4);
  // In the order of RFC 1951: 16, 17 and 18 have no code, 0 to 15 have 4 bits.
  for (int i = 0; i < 19; ++i) writer.put(i < 3 ? 0 : 4, 3);
  for (const std::uint8_t length : lengths) writer.put(reversed(length, 4), 4);
  writer.put(reversed(1, 4), 4);  // the distance has one bit
}

/// A block; the stream ends with it where `last` says so.
void put_block(std::span<const std::uint8_t> raw, bool last, BitWriter& writer) {
  Counts counts{};
  const std::vector<std::uint16_t> tokens = tokens_of(raw, counts);
  const Lengths lengths = code_lengths(counts);
  const std::array<std::uint32_t, kSymbols> codes = codes_of(lengths);
  // A token's bits, and how many: a run's are its code, its extra bits, and a 0 for the distance.
  std::array<std::pair<std::uint32_t, int>, kRun + kMostRun + 1> written{};
  for (std::size_t i = 0; i < kEnd; ++i) written[i] = {codes[i], lengths[i]};
  for (std::size_t n = kLeastRun; n <= kMostRun; ++n) {
    const LengthCode& code = kLengthCodes[n];
    const int length = lengths[code.symbol];
    written[kRun + n] = {codes[code.symbol] | std::uint32_t{code.extra} << length,
                         length + code.extra_bits + 1};
  }
  std::uint64_t bits = 0;
  for (const std::uint16_t token : tokens) {
    bits += static_cast<std::uint64_t>(written[token].second);
  }
  writer.reserve(bits / 8 + 256);
  put_header(lengths, last, writer);
  for (const std::uint16_t token : tokens) writer.put(written[token].first, written[token].second);
  writer.put(codes[kEnd], lengths[kEnd]);
}

}  // namespace

std::vector<std::uint8_t> run_deflate(std::span<const std::uint8_t> raw, bool last) {
  BitWriter writer;
  do {
    const auto block = raw.first(std::min(raw.size(), kBlock));
    raw = raw.subspan(block.size());
    put_block(block, last && raw.empty(), writer);
  } while (!raw.empty());
  writer.reserve(16);
  if (!last) writer.put(0, 3);  // an empty stored block
  writer.align();
  if (!last) writer.put(0xFFFF0000U, 32);
  writer.align();
  return writer.take();
}

}  // namespace kiln
