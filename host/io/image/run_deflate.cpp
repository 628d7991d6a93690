#include "io/image/run_deflate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <memory>

namespace kiln {
namespace {

// Numbers of symbols of RFC 1951, sections 3.2.5 and 3.2.7.
constexpr std::size_t kSymbols = 286, kEnd = 256, kFirstLength = 257;
constexpr std::size_t kMinRun = 3, kMaxRun = 258;
constexpr int kMaxCodeBits = 15;
// Typical number of bytes that share Huffman codes in a block. With half or twice as many, file
// sizes change by 0.1%.
constexpr std::size_t kBlock = std::size_t{1} << 16;
// The token of a run of n bytes is kFirstRunToken + n; the token of a literal is its byte.
constexpr std::size_t kFirstRunToken = 256, kTokens = kFirstRunToken + kMaxRun + 1;

struct LengthCode {
  std::uint16_t symbol = 0;
  std::uint8_t extra_bits = 0;
  std::uint16_t extra = 0;
};

constexpr std::array<LengthCode, kMaxRun + 1> make_length_codes() {
  std::array<LengthCode, kMaxRun + 1> codes{};
  std::size_t length = kMinRun;
  for (std::size_t symbol = kFirstLength; symbol < kSymbols - 1; ++symbol) {
    const std::size_t place = symbol - kFirstLength;
    const std::size_t bits = place < 8 ? 0 : place / 4 - 1;
    for (std::size_t extra = 0; extra < std::size_t{1} << bits && length < kMaxRun; ++extra) {
      codes[length++] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint8_t>(bits),
                         static_cast<std::uint16_t>(extra)};
    }
  }
  codes[kMaxRun] = {kSymbols - 1, 0, 0};
  return codes;
}
constexpr std::array<LengthCode, kMaxRun + 1> kLengthCodes = make_length_codes();

using Counts = std::array<std::uint32_t, kSymbols>;
using Lengths = std::array<std::uint8_t, kSymbols>;

/// Number of consecutive bytes, from `at` on, that equal `byte`; at most `most`.
std::size_t count_run(const std::uint8_t* at, std::size_t max_count, std::uint8_t byte) {
  std::uint64_t eight_bytes = 0, all = byte * 0x0101010101010101U;
  std::size_t length = 0;
  for (; length + sizeof(eight_bytes) <= max_count; length += sizeof(eight_bytes)) {
    std::memcpy(&eight_bytes, at + length, sizeof(eight_bytes));
    if (eight_bytes != all) break;
  }
  while (length < max_count && at[length] == byte) ++length;
  return length;
}

/// True if the four bytes at `at` are equal.
bool are_four_equal(const std::uint8_t* at) {
  std::uint32_t four_bytes = 0;
  std::memcpy(&four_bytes, at, sizeof(four_bytes));
  return four_bytes == std::rotl(four_bytes, 8);
}

/// True if four consecutive bytes among the eight at `at` are equal; occasionally also if they are
/// not.
bool may_have_four_equal(const std::uint8_t* at) {
  std::uint64_t eight_bytes = 0;
  std::memcpy(&eight_bytes, at, sizeof(eight_bytes));
  // A byte of `change` is 0 if the byte equals its neighbour; the last byte is compared with the
  // first.
  const std::uint64_t change = (eight_bytes ^ std::rotr(eight_bytes, 8));
  const std::uint64_t same = (change - 0x0101010101010101U) & ~change & 0x8080808080808080U;
  return (same & same >> 8 & same >> 16) != 0;
}

/// Splits bytes into tokens, which are literals and runs, and counts their symbols.
/// \param tokens  buffer with room for one token per byte
/// \returns the number of tokens
std::size_t make_tokens(std::span<const std::uint8_t> raw, std::uint16_t* tokens, Counts& counts) {
  // Two counters per token are used in turn. The same token often repeats, and one counter would
  // have to be updated before its next use.
  std::array<std::array<std::uint32_t, kTokens>, 2> token_counts{};
  std::uint16_t* to = tokens;
  const std::uint8_t* at = raw.data();
  const std::uint8_t* const end = at + raw.size();
  const auto put = [&](std::size_t token) {
    ++token_counts[(to - tokens) & 1][token];
    *to++ = static_cast<std::uint16_t>(token);
  };
  if (at != end) put(*at++);
  while (at != end) {
    if (end - at > 6 && !may_have_four_equal(at - 1)) {
      for (int i = 0; i < 5; ++i) put(*at++);
      continue;
    }
    if (end - at < static_cast<std::ptrdiff_t>(kMinRun) || !are_four_equal(at - 1)) {
      put(*at++);
      continue;
    }
    const std::size_t most = std::min(kMaxRun, static_cast<std::size_t>(end - at));
    const std::size_t length = count_run(at, most, at[-1]);
    put(kFirstRunToken + length);
    at += length;
  }
  for (std::size_t i = 0; i < kEnd; ++i) counts[i] = token_counts[0][i] + token_counts[1][i];
  for (std::size_t n = kMinRun; n <= kMaxRun; ++n) {
    counts[kLengthCodes[n].symbol] +=
        token_counts[0][kFirstRunToken + n] + token_counts[1][kFirstRunToken + n];
  }
  ++counts[kEnd];
  if (raw.empty()) ++counts[0];  // A code needs at least two symbols
  return static_cast<std::size_t>(to - tokens);
}

/// Computes the lengths of Huffman codes, without an upper limit.
///
/// Symbols are sorted by count once. Nodes are made in the order of increasing counts, so the two
/// items to join next are always at the front of the list of symbols or of nodes. Of equal counts,
/// symbols come before nodes, lower symbols before higher ones, and older nodes before newer ones.
/// \returns the greatest length
int compute_huffman_lengths(const Counts& counts, Lengths& lengths) {
  constexpr unsigned kSymbolBits = 16;
  // Each entry has a symbol's count in its high bits, and the symbol in its low bits
  std::array<std::uint64_t, kSymbols> sorted;
  std::size_t used_count = 0;
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    if (counts[i] != 0) sorted[used_count++] = std::uint64_t{counts[i]} << kSymbolBits | i;
  }
  lengths.fill(0);
  if (used_count == 0) return 0;
  std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(used_count));
  // The first `used_count` entries stand for the sorted symbols, those after them for nodes.
  std::array<std::uint16_t, 2 * kSymbols> parent{};
  std::array<std::uint64_t, 2 * kSymbols> weight;
  for (std::size_t i = 0; i < used_count; ++i) weight[i] = sorted[i] >> kSymbolBits;
  const std::size_t root = 2 * used_count - 2;
  std::size_t symbol = 0, joined = used_count;
  for (std::size_t node = used_count; node <= root; ++node) {
    const auto take = [&] {
      const bool takes_symbol =
          symbol < used_count && (joined == node || weight[symbol] <= weight[joined]);
      const std::size_t taken = takes_symbol ? symbol++ : joined++;
      parent[taken] = static_cast<std::uint16_t>(node);
      return weight[taken];
    };
    const std::uint64_t first = take();
    weight[node] = first + take();
  }
  std::array<std::uint16_t, 2 * kSymbols> depth;
  depth[root] = 0;
  int longest = 0;
  for (std::size_t i = root; i-- > 0;) {
    depth[i] = static_cast<std::uint16_t>(depth[parent[i]] + 1);
    if (i >= used_count) continue;
    lengths[sorted[i] & ((1U << kSymbolBits) - 1)] =
        static_cast<std::uint8_t>(std::min<int>(depth[i], 255));
    longest = std::max(longest, int{depth[i]});
  }
  return longest;
}

/// Computes code lengths of at most kMaxCodeBits: counts are made more equal until the codes are
/// short enough.
Lengths compute_code_lengths(Counts counts) {
  Lengths lengths{};
  while (compute_huffman_lengths(counts, lengths) > kMaxCodeBits) {
    for (std::uint32_t& count : counts) count = count == 0 ? 0 : count / 2 + 1;
  }
  return lengths;
}

std::uint32_t reverse_bits(std::uint32_t code, int bits) {
  std::uint32_t result = 0;
  for (; bits > 0; --bits, code >>= 1) result = result << 1 | (code & 1U);
  return result;
}

/// The canonical codes for these lengths, with their bits in the order in which they are written.
std::array<std::uint32_t, kSymbols> codes_of(const Lengths& lengths) {
  std::array<std::uint32_t, kMaxCodeBits + 2> next{};
  for (const std::uint8_t length : lengths) {
    if (length != 0) ++next[length + 1U];
  }
  for (std::size_t bits = 1; bits < next.size(); ++bits)
    next[bits] = (next[bits] + next[bits - 1]) << (bits > 1 ? 1 : 0);
  std::array<std::uint32_t, kSymbols> codes{};
  for (std::size_t i = 0; i < kSymbols; ++i) {
    if (lengths[i] != 0) codes[i] = reverse_bits(next[lengths[i]]++, lengths[i]);
  }
  return codes;
}

/// The bits that stand for a token, and how many they are. For a run, these are the code of its
/// length, the extra bits, and a 0 for its distance.
struct TokenBits {
  std::uint32_t bits = 0;
  std::uint32_t count = 0;  // Number of bits: at most 15 for a literal, and 15 + 5 + 1 for a run
};

class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes), size_(bytes.size()) {}
  /// Reserves memory for a number of further bytes.
  void reserve(std::size_t more) { bytes_.resize(size_ + more + sizeof(std::uint64_t)); }
  /// \param count  at most 32
  void put(std::uint32_t bits, int count) {
    const TokenBits one{bits, static_cast<std::uint32_t>(count)};
    const std::uint16_t first = 0;
    put({&first, 1}, &one);
  }
  /// \param token_bits  the bits that stand for a token, indexed by the token
  void put(std::span<const std::uint16_t> tokens, const TokenBits* token_bits) {
    // Works on a local copy of the state: the compiler must assume that writing bytes may change
    // members, and would reload these after each write.
    HeldBits held{held_, bytes_.data() + size_};
    std::size_t i = 0;
    for (; i + 2 <= tokens.size(); i += 2) {
      held.add(token_bits[tokens[i]]);
      held.add(token_bits[tokens[i + 1]]);
      held.flush();
    }
    if (i < tokens.size()) {
      held.add(token_bits[tokens[i]]);
      held.flush();
    }
    size_ = static_cast<std::size_t>(held.to - bytes_.data());
    held_ = held.bits;
  }
  /// Pads with zeros to a whole byte.
  void align() {
    if (held_.count != 0) put(0, static_cast<int>(8 - held_.count));
  }
  void finish() { bytes_.resize(size_); }

 private:
  /// Bits that are not written yet: fewer than 8 between calls, at most 49 within one.
  struct Bits {
    std::uint64_t bits = 0;
    std::uint32_t count = 0;
  };
  struct HeldBits {
    Bits bits;
    std::uint8_t* to;
    void add(const TokenBits& token) {
      bits.bits |= std::uint64_t{token.bits} << bits.count;
      bits.count += token.count;
    }
    void flush() {
      if constexpr (std::endian::native == std::endian::little) {
        std::memcpy(to, &bits.bits, sizeof(bits.bits));
      } else {
        for (std::size_t i = 0; i < sizeof(bits.bits); ++i) {
          to[i] = static_cast<std::uint8_t>(bits.bits >> (8 * i));
        }
      }
      to += bits.count / 8;
      bits.bits >>= bits.count / 8 * 8;
      bits.count %= 8;
    }
  };

  std::vector<std::uint8_t>& bytes_;
  std::size_t size_;
  Bits held_;
};

/// Writes the header of a block. Each code length takes 4 bits; run-length coding of the lengths
/// would save only a few bytes.
void put_header(const Lengths& lengths, bool last, BitWriter& writer) {
  writer.put(last ? 1 : 0, 1);
  writer.put(2, 2);  // Dynamic codes
  writer.put(kSymbols - kFirstLength, 5);
  writer.put(0, 5);  // One distance code
  writer.put(19 - 4, 4);
  // The code lengths come in the order that RFC 1951 gives: 16, 17 and 18 have no code, 0 to 15
  // have 4 bits.
  for (int i = 0; i < 19; ++i) writer.put(i < 3 ? 0 : 4, 3);
  for (const std::uint8_t length : lengths) writer.put(reverse_bits(length, 4), 4);
  writer.put(reverse_bits(1, 4), 4);  // The distance code has one bit
}

std::array<TokenBits, kTokens> bits_of_tokens(const Lengths& lengths,
                                              const std::array<std::uint32_t, kSymbols>& codes) {
  std::array<TokenBits, kTokens> token_bits{};
  for (std::size_t i = 0; i < kEnd; ++i) token_bits[i] = {codes[i], lengths[i]};
  for (std::size_t n = kMinRun; n <= kMaxRun; ++n) {
    const LengthCode& code = kLengthCodes[n];
    const int length = lengths[code.symbol];
    token_bits[kFirstRunToken + n] = {codes[code.symbol] | std::uint32_t{code.extra} << length,
                                      static_cast<std::uint32_t>(length + code.extra_bits + 1)};
  }
  return token_bits;
}

/// Writes a block.
/// \param last  true if it is the last one of the stream
/// \param room  buffer for the tokens of a block
void put_block(std::span<const std::uint8_t> raw, bool last, std::uint16_t* room,
               BitWriter& writer) {
  Counts counts{};
  const std::span<const std::uint16_t> tokens(room, make_tokens(raw, room, counts));
  const Lengths lengths = compute_code_lengths(counts);
  const std::array<std::uint32_t, kSymbols> codes = codes_of(lengths);
  const std::array<TokenBits, kTokens> token_bits = bits_of_tokens(lengths, codes);
  // A run has at most 5 extra bits, and one bit for its distance.
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < kSymbols; ++i) {
    bits += counts[i] * (lengths[i] + (i < kFirstLength ? 0ULL : 6ULL));
  }
  writer.reserve(bits / 8 + 256);
  put_header(lengths, last, writer);
  writer.put(tokens, token_bits.data());
  writer.put(codes[kEnd], lengths[kEnd]);
}

}  // namespace

void run_deflate(std::span<const std::uint8_t> raw, bool last, std::vector<std::uint8_t>& to) {
  // The data are divided into blocks of about the same size, since a short block at the end would
  // save fewer bytes than its header takes.
  const std::size_t blocks = std::max<std::size_t>(1, (raw.size() + kBlock / 2) / kBlock);
  const std::size_t block_bytes = (raw.size() + blocks - 1) / blocks;
  const auto tokens = std::make_unique_for_overwrite<std::uint16_t[]>(block_bytes);
  BitWriter writer(to);
  do {
    const auto block = raw.first(std::min(raw.size(), block_bytes));
    raw = raw.subspan(block.size());
    put_block(block, last && raw.empty(), tokens.get(), writer);
  } while (!raw.empty());
  writer.reserve(16);
  if (!last) writer.put(0, 3);  // An empty stored block, which ends at a byte boundary
  writer.align();
  if (!last) writer.put(0xFFFF0000U, 32);
  writer.finish();
}

}  // namespace kiln
