// Lookup of UV triangles by a point that they contain.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

using UvPosition = std::array<double, 2>;

/// A triangle's UVs, shifted by whole numbers so that the centroid lies in the unit square.
struct UvPlace {
  std::array<UvPosition, 3> uv{};
  UvPosition middle{}, offset{};  ///< Centroid after the shift; the subtracted whole numbers
  double side = 0;                ///< Length of the longest side in UV space
  double area = 0;                ///< Twice the signed area; negative if mirrored; 0 if not usable

  static UvPlace of(const std::array<LowSurface::Corner, 3>& corners);
  /// Largest distance at which two corners count as equal: 1e-4, and a twentieth of the longest side.
  double near() const;
  /// True if a point lies in the triangle, enlarged by a thousandth of its height.
  bool holds(const UvPosition& point) const;
};

/// True if both coordinates differ by at most `near`.
bool are_near(const UvPosition& a, const UvPosition& b, double near);

/// Twice the area of the intersection of two triangles; each may be mirrored.
double shared_area(const std::array<UvPosition, 3>& a, const std::array<UvPosition, 3>& b);

/// A hierarchy of square grids with the triangles that touch each square. A triangle is stored in the grid whose
/// squares match its size, in at most four squares, so that small and large triangles cost the same.
class UvSquares {
 public:
  explicit UvSquares(std::span<const UvPlace> places);

  void add(std::uint32_t triangle);

  /// Calls `visit(triangle)` for triangles near a point, most recent first, until it returns true. Returns true in
  /// that case. Of more than 256 triangles of one size in a square, only the most recent are visited.
  template <class Visit>
  bool any_at(const UvPosition& point, const Visit& visit) const {
    for (const int level : levels_) {
      std::size_t left = kMaxPerSquare;
      const auto [x, y] = square_of(point, level);
      for (std::uint32_t at = newest_entry_[slot(x, y, level)]; at != kEnd && left > 0;
           at = square_entries_[at].next, --left) {
        if (visit(square_entries_[at].triangle)) return true;
      }
    }
    return false;
  }

 private:
  struct Link {
    std::uint32_t triangle, next;
  };
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFU;
  static constexpr std::size_t kMaxPerSquare = 256;

  static std::array<std::int64_t, 2> square_of(const UvPosition& point, int level);
  std::size_t slot(std::int64_t x, std::int64_t y, int level) const;

  std::span<const UvPlace> places_;
  std::vector<std::uint32_t> newest_entry_;
  std::vector<Link> square_entries_;
  std::vector<int> levels_;  ///< Grid levels in use, as powers of two
};

}  // namespace kiln
