// Finds the UV triangles that contain a point.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

using UvPosition = std::array<double, 2>;

/// The UVs of a triangle, shifted by whole numbers so that its centroid lies in the unit square.
struct UvPlace {
  std::array<UvPosition, 3> uv{};
  /// Centroid after the shift; the whole numbers that were subtracted
  UvPosition middle{}, offset{};
  double side = 0;  ///< Length of the longest side in UV space
  double area = 0;  ///< Twice the signed area: negative if mirrored, 0 if not usable

  static UvPlace of(const std::array<LowSurface::Corner, 3>& corners);
  /// Largest distance at which two corners count as equal: the smaller of 1e-4 and a twentieth of the longest side.
  double tolerance() const;
  /// True if a point lies in the triangle after this is enlarged by a thousandth of its height.
  bool contains(const UvPosition& point) const;
};

/// True if both coordinates differ by at most `near`.
bool are_near(const UvPosition& a, const UvPosition& b, double near);

/// Twice the area in which two triangles overlap. Each may be mirrored.
double shared_area(const std::array<UvPosition, 3>& a, const std::array<UvPosition, 3>& b);

/// A hierarchy of square grids that lists the triangles that touch each square. A triangle is stored in the grid whose
/// squares match its size, in at most four squares, so small and large triangles cost the same.
class UvSquares {
 public:
  explicit UvSquares(std::span<const UvPlace> places);

  void add(std::uint32_t triangle);

  /// Calls `visit(triangle)` for triangles near a point, the most recent first, until it returns true. Returns true in
  /// that case. If a square lists more than 256 triangles of one size, only the most recent are visited.
  template <class Visit>
  bool any_match_at(const UvPosition& point, const Visit& visit) const {
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
  std::vector<int> levels_;  ///< Levels of grids in use: binary logarithms of the squares' sides
};

}  // namespace kiln
