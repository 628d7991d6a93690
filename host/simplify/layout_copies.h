// Parts of a layout that lie on each other exactly: mirrored halves, repeated parts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Which corners of a layout are copies of each other.
class LayoutCopies {
 public:
  /// Triangles are copies where their corners have the same UVs, mirrored or not, whole numbers apart or not.
  /// \param corners  indices into uvs, by triangle
  LayoutCopies(std::span<const Vec2> uvs, std::span<const Triangle> corners);

  bool any() const { return any_; }
  /// True if a corner has copies.
  bool has(std::uint32_t uv) const { return any_ && next_[uv] != uv; }
  /// True if a corner is its own copy: the layout is folded there, as where two mirrored halves meet.
  bool on_fold(std::uint32_t uv) const { return any_ && on_fold_[uv] != 0; }
  /// The lowest of a corner and its copies, as they were at first.
  std::uint32_t first(std::uint32_t uv) const { return any_ ? first_[uv] : uv; }
  /// The lowest triangle that a triangle is a copy of; itself where there is none.
  std::uint32_t first_triangle(std::uint32_t t) const { return any_ ? first_triangle_[t] : t; }
  /// True if two triangles are copies of each other.
  bool triangles(std::uint32_t t, std::uint32_t other) const {
    return any_ && first_triangle_[t] == first_triangle_[other];
  }
  /// True if a predicate holds for each other copy of a corner: of the lower ones the highest first, then of the higher
  /// ones. Ends at the first for which it does not.
  template <class Predicate>
  bool all_of(std::uint32_t uv, const Predicate& holds) const {
    if (!any_) return true;
    for (std::uint32_t other = next_[uv]; other != uv; other = next_[other]) {
      if (!holds(other)) return false;
    }
    return true;
  }

 private:
  bool any_ = false;
  std::vector<std::uint32_t> next_;            ///< By UV, in a ring.
  std::vector<std::uint32_t> first_;           ///< By UV.
  std::vector<std::uint8_t> on_fold_;          ///< By UV.
  std::vector<std::uint32_t> first_triangle_;  ///< By triangle: the lowest that it is a copy of.
};

}  // namespace kiln
