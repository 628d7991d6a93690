// Finds exact copies within a UV layout, such as mirrored halves and repeated parts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Finds the copies of each triangle in a UV layout, and the copies of each of its corners. A corner is a UV index.
class LayoutCopies {
 public:
  /// Triangles are copies if their corners have the same UVs, except for mirroring and whole-number offsets.
  /// \param corners  indices into uvs, for each triangle
  LayoutCopies(std::span<const Vec2> uvs, std::span<const Triangle> corners);

  bool any() const { return has_any_copies_; }
  /// True if a corner has other copies.
  bool has_copies(std::uint32_t uv) const { return has_any_copies_ && next_copy_[uv] != uv; }
  /// True if a corner is its own copy because the layout is folded there, as on the axis of a mirrored mesh.
  bool is_on_fold(std::uint32_t uv) const { return has_any_copies_ && on_fold_[uv] != 0; }
  /// The lowest index among a corner and its copies. Collapses do not change it.
  std::uint32_t first_copy(std::uint32_t uv) const {
    return has_any_copies_ ? first_copy_[uv] : uv;
  }
  /// The lowest index among a triangle and its copies.
  std::uint32_t first_triangle_copy(std::uint32_t t) const {
    return has_any_copies_ ? first_triangle_copy_[t] : t;
  }
  /// True if two triangles are copies of each other.
  bool are_triangle_copies(std::uint32_t t, std::uint32_t other) const {
    return has_any_copies_ && first_triangle_copy_[t] == first_triangle_copy_[other];
  }
  /// True if the predicate holds for each other copy of a corner. Visits first the copies with lower indices, in
  /// descending order, then those with higher indices, in descending order. Stops at the first for which the predicate
  /// fails.
  template <class Predicate>
  bool all_of(std::uint32_t uv, const Predicate& holds) const {
    if (!has_any_copies_) return true;
    for (std::uint32_t other = next_copy_[uv]; other != uv; other = next_copy_[other]) {
      if (!holds(other)) return false;
    }
    return true;
  }

 private:
  bool has_any_copies_ = false;
  /// For each UV, the next of its copies; the copies of a UV form a ring
  std::vector<std::uint32_t> next_copy_;
  std::vector<std::uint32_t> first_copy_;  ///< For each UV, the lowest index among its copies
  std::vector<std::uint8_t> on_fold_;      ///< 1 for each UV that lies on a fold
  std::vector<std::uint32_t>
      first_triangle_copy_;  ///< For each triangle, the lowest index among its copies
};

}  // namespace kiln
