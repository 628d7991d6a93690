// A hash of large arrays.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "base/fnv.h"
#include "base/parallel.h"

namespace kiln {

/// 64-bit hash of bytes: FNV-1a over the words of each block, in parallel, then FNV-1a over the hashes of the blocks.
class ByteHash {
 public:
  void add(std::span<const std::byte> bytes) {
    hash_.add(bytes.size());
    add_blocks(bytes);
  }
  /// The hash; never 0, which callers use for "unknown".
  std::uint64_t value() const { return hash_.value != 0 ? hash_.value : 1; }

 private:
  friend class PieceHash;
  static constexpr std::size_t kBytesPerBlock = std::size_t{1} << 20;

  void add_blocks(std::span<const std::byte> bytes) {
    std::vector<std::uint64_t> block_hashes((bytes.size() + kBytesPerBlock - 1) / kBytesPerBlock);
    parallel_for(bytes.size(), kBytesPerBlock, [&](std::size_t begin, std::size_t end) {
      Fnv1a hash;
      std::size_t i = begin;
      for (; i + 4 <= end; i += 4) {
        std::uint32_t word = 0;
        std::memcpy(&word, &bytes[i], 4);
        hash.add(word);
      }
      for (; i < end; ++i) hash.add(static_cast<std::uint64_t>(bytes[i]));
      block_hashes[begin / kBytesPerBlock] = hash.value;
    });
    for (const std::uint64_t block : block_hashes) hash_.add(block);
  }

  Fnv1a hash_;
};

/// Computes the ByteHash of an array whose bytes are added in pieces. It buffers 16 MiB.
class PieceHash {
 public:
  /// \param size  sum of the sizes of all pieces
  explicit PieceHash(std::uint64_t size) { hash_.hash_.add(size); }
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const std::byte*>(data);
    while (size != 0) {
      const std::size_t part = std::min(size, kBufferBytes - buffer_.size());
      buffer_.insert(buffer_.end(), bytes, bytes + part);
      bytes += part;
      size -= part;
      if (buffer_.size() == kBufferBytes) flush();
    }
  }
  std::uint64_t value() {
    flush();
    return hash_.value();
  }

 private:
  static constexpr std::size_t kBufferBytes = 16 * ByteHash::kBytesPerBlock;

  void flush() {
    hash_.add_blocks(buffer_);
    buffer_.clear();
  }

  ByteHash hash_;
  std::vector<std::byte> buffer_;
};

/// Hash of the concatenation of several arrays.
template <typename... Arrays>
std::uint64_t hash_bytes(const Arrays&... arrays) {
  ByteHash hash;
  (hash.add(std::as_bytes(std::span(arrays))), ...);
  return hash.value();
}

/// Hash of several arrays for caches with frequent look-ups: up to five times as fast as hash_bytes(), whose values
/// are stored in files. Never 0.
template <typename... Arrays>
std::uint64_t fast_hash(const Arrays&... arrays) {
  constexpr std::size_t kHashLanes = 4, kBytesPerWord = sizeof(std::uint64_t),
                        kBytesPerStep = kHashLanes * kBytesPerWord;
  Fnv1a all;
  const auto add = [&](std::span<const std::byte> bytes) {
    Fnv1a lanes[kHashLanes];  // independent hashes, so that their multiplications overlap
    std::size_t i = 0;
    for (; i + kBytesPerStep <= bytes.size(); i += kBytesPerStep) {
      std::uint64_t words[kHashLanes];
      std::memcpy(words, &bytes[i], kBytesPerStep);
      for (std::size_t k = 0; k < kHashLanes; ++k) {
        // The low bits of a product only depend on the low bits of its factors, so the rotation moves high bits to the
        // low end.
        lanes[k].add(words[k]);
        lanes[k].value = std::rotl(lanes[k].value, 29);
      }
    }
    all.add(bytes.size());
    for (; i < bytes.size(); ++i) all.add(static_cast<std::uint64_t>(bytes[i]));
    for (const Fnv1a& lane : lanes) all.add(lane.value);
  };
  (add(std::as_bytes(std::span(arrays))), ...);
  return all.value != 0 ? all.value : 1;
}

}  // namespace kiln
