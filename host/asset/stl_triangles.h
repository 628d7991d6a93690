// What the readers of STL share: the layout of a binary file, and the joining of its corners.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

namespace kiln {

/// A binary STL has a header, whose last four bytes are the number of triangles, and the triangles:
/// a normal, three corners, and two bytes that some programs use for colours.
inline constexpr std::size_t kStlHeaderBytes = 84, kStlTriangleBytes = 50, kStlNormalBytes = 12;

/// Begins a colour in the header of Materialise Magics and MeshLab.
inline constexpr const char* kStlColorPrefix = "COLOR=";

/// Reads four bytes, lowest first.
inline std::uint32_t little_endian_word(const char* bytes) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, sizeof value);
  if constexpr (std::endian::native == std::endian::big) value = __builtin_bswap32(value);
  return value;
}

/// Merges corners with exactly equal positions into one vertex, in the order of their first
/// appearance. -0 equals 0, and a NaN equals the same NaN. It is a hash table with open addressing
/// and linear probing, at most half full.
/// \tparam Position  an array of three floats or doubles
template <typename Position>
class CornerWelder {
 public:
  /// Called before the table is allocated; it may throw. The arguments are the number of slots and the minimum number of
  /// vertices that the table will hold.
  using CheckMemory = std::function<void(std::size_t slots, std::size_t vertices)>;

  /// \param positions  receives the vertices; empty
  /// \param expected   estimated number of vertices
  CornerWelder(std::vector<Position>& positions, std::size_t expected, CheckMemory check = {})
      : positions_(positions), check_memory_(std::move(check)) {
    allocate(std::bit_ceil(2 * expected + 16), expected);
  }

  /// Prefetches the slot that add() reads first.
  void prefetch(const Position& p) const { __builtin_prefetch(&slots_[slot_of(p)]); }

  /// Returns the number of the vertex at a position.
  std::uint32_t add(Position p) {
    if (2 * positions_.size() >= slots_.size()) grow();
    for (auto& value : p) value += 0;  // -0 becomes 0
    std::size_t slot = slot_of(p);
    while (slots_[slot] != kEmpty) {
      if (std::memcmp(&positions_[slots_[slot]], &p, sizeof p) == 0) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<std::uint32_t>(positions_.size());
    positions_.push_back(p);
    return slots_[slot];
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;

  std::size_t slot_of(const Position& p) const {
    using Value = typename Position::value_type;
    using Bits = std::conditional_t<sizeof(Value) == 4, std::uint32_t, std::uint64_t>;
    std::uint64_t hash = 0;
    for (const Value value : p) {
      hash = (hash ^ std::bit_cast<Bits>(value)) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 32;
    }
    return hash & (slots_.size() - 1);
  }

  void allocate(std::size_t slots, std::size_t vertices) {
    if (check_memory_) check_memory_(slots, vertices);
    slots_ = {};
    slots_.assign(slots, kEmpty);
  }

  void grow() {
    allocate(2 * slots_.size(), 2 * positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      std::size_t slot = slot_of(positions_[v]);
      while (slots_[slot] != kEmpty) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = static_cast<std::uint32_t>(v);
    }
  }

  std::vector<Position>& positions_;
  CheckMemory check_memory_;
  std::vector<std::uint32_t> slots_;  // Numbers of vertices; their count is a power of 2
};

}  // namespace kiln
