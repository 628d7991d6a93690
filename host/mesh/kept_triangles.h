// Finds triangles of one mesh that another mesh contains unchanged.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Hash set of triangles, found by their corners in any rotation. A point on a triangle that another mesh contains
/// unchanged has that triangle as its nearest, so it needs no search of that mesh's SurfaceDistance. The search would be
/// slow where many triangles share an edge or a vertex, since the boxes of all of them contain the points of each.
class KeptTriangles {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// \param corners  three corners per triangle; must outlive this object
  explicit KeptTriangles(std::span<const Vec3> corners)
      : corners_(corners), slots_(std::bit_ceil(corners.size() / 3 * 2 + 1), kNone) {
    for (std::size_t t = 0; 3 * t < corners.size(); ++t) {
      const Key key = key_of(&corners[3 * t]);
      std::size_t i = slot_of(key);
      while (slots_[i] != kNone && key_at(slots_[i]) != key) i = (i + 1) & (slots_.size() - 1);
      if (slots_[i] == kNone) slots_[i] = static_cast<std::uint32_t>(t);
    }
  }

  /// Index of the first equal triangle, in the order of the constructor's corners; kNone if there is none.
  std::uint32_t find(const std::array<Vec3, 3>& triangle) const {
    const Key key = key_of(triangle.data());
    for (std::size_t i = slot_of(key); slots_[i] != kNone; i = (i + 1) & (slots_.size() - 1)) {
      if (key_at(slots_[i]) == key) return slots_[i];
    }
    return kNone;
  }
  /// The three corners of a triangle that find() returned.
  const Vec3* corners(std::uint32_t index) const { return &corners_[std::size_t{3} * index]; }

 private:
  using Point = std::array<std::uint32_t, 3>;
  using Key = std::array<Point, 3>;
  static Key key_of(const Vec3* c) {
    Key key;
    for (std::size_t k = 0; k < 3; ++k) {
      key[k] = {std::bit_cast<std::uint32_t>(c[k].x), std::bit_cast<std::uint32_t>(c[k].y),
                std::bit_cast<std::uint32_t>(c[k].z)};
    }
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    return key;
  }
  Key key_at(std::uint32_t t) const { return key_of(&corners_[std::size_t{3} * t]); }
  std::size_t slot_of(const Key& key) const {
    std::uint64_t hash = 0;
    for (const Point& point : key) {
      for (const std::uint32_t bits : point) {
        hash = (hash ^ bits) * 0x9E3779B97F4A7C15U;
        hash ^= hash >> 32;
      }
    }
    return hash & (slots_.size() - 1);
  }

  std::span<const Vec3> corners_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace kiln
