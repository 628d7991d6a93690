// Exact copies within a UV layout, such as mirrored halves and repeated parts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Finds corners of a layout that are copies of each other.
class LayoutCopies {
 public:
  /// Triangles are copies if their corners have the same UVs, up to mirroring and integer offsets.
  /// \param corners  indices into uvs, by triangle
  LayoutCopies(std::span<const Vec2> uvs, std::span<const Triangle> corners);

  bool any() const { return any_; }
  /// True if a corner has copies.
  bool has(std::uint32_t uv) const { return any_ && next_copy_[uv] != uv; }
  /// True if a corner is its own copy: the layout is folded there, as on the axis of a mirrored mesh.
  bool on_fold(std::uint32_t uv) const { return any_ && on_fold_[uv] != 0; }
  /// The lowest index among a corner and its copies, before any collapse.
  std::uint32_t first(std::uint32_t uv) const { return any_ ? first_copy_[uv] : uv; }
  /// The lowest index among a triangle and its copies.
  std::uint32_t first_triangle(std::uint32_t t) const { return any_ ? first_triangle_copy_[t] : t; }
  /// True if two triangles are copies of each other.
  bool triangles(std::uint32_t t, std::uint32_t other) const {
    return any_ && first_triangle_copy_[t] == first_triangle_copy_[other];
  }
  /// True if the predicate holds for each other copy of a corner: first the lower ones, in descending order, then the
  /// higher ones. Stops at the first failure.
  template <class Predicate>
  bool all_of(std::uint32_t uv, const Predicate& holds) const {
    if (!any_) return true;
    for (std::uint32_t other = next_copy_[uv]; other != uv; other = next_copy_[other]) {
      if (!holds(other)) return false;
    }
    return true;
  }

 private:
  bool any_ = false;
  /// Next copy of each UV; the copies of a UV form a ring
  std::vector<std::uint32_t> next_copy_;
  std::vector<std::uint32_t> first_copy_;  ///< Lowest index among the copies of each UV
  std::vector<std::uint8_t> on_fold_;      ///< 1 for each UV that lies on a fold
  std::vector<std::uint32_t>
      first_triangle_copy_;  ///< Lowest index among the copies of each triangle
};

}  // namespace kiln
