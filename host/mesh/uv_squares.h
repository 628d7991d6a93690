// Triangles in UV space, found by a point that they hold.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

using UvPosition = std::array<double, 2>;

/// A triangle's UVs, moved by whole numbers so that their middle lies in the unit square.
struct UvPlace {
  std::array<UvPosition, 3> uv{};
  UvPosition middle{}, offset{};  ///< `offset` is what was taken away.
  double side = 0;                ///< The longest
  double area = 0;  ///< Twice it; negative where mirrored. 0: the triangle has no place.

  static UvPlace of(const std::array<LowSurface::Corner, 3>& corners);
  /// Largest distance of two corners that are one: 1e-4, and a twentieth of the longest side.
  double near() const;
  /// True within the triangle and a thousandth of its height around it.
  bool holds(const UvPosition& point) const;
};

/// True where both coordinates differ by `near` at most.
bool are_near(const UvPosition& a, const UvPosition& b, double near);

/// Twice the area that two triangles share; each may be mirrored.
double shared_area(const std::array<UvPosition, 3>& a, const std::array<UvPosition, 3>& b);

/// Squares of the plane with the triangles that reach into them. A triangle lies in squares as
/// large as itself, in four at most. So small ones and large ones cost the same.
class UvSquares {
 public:
  explicit UvSquares(std::span<const UvPlace> places);

  void add(std::uint32_t triangle);

  /// Calls `visit(triangle)` for triangles near a point, those added last first, until it says true; says whether
  /// it did. Where more than 256 triangles of one size meet in a square, the older ones are left out.
  template <class Visit>
  bool any_at(const UvPosition& point, const Visit& visit) const {
    for (const int level : levels_) {
      std::size_t left = kMostInSquare;
      const auto [x, y] = square_of(point, level);
      for (std::uint32_t at = heads_[slot(x, y, level)]; at != kEnd && left > 0;
           at = links_[at].next, --left) {
        if (visit(links_[at].triangle)) return true;
      }
    }
    return false;
  }

 private:
  struct Link {
    std::uint32_t triangle, next;
  };
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFU;
  static constexpr std::size_t kMostInSquare = 256;

  static std::array<std::int64_t, 2> square_of(const UvPosition& point, int level);
  std::size_t slot(std::int64_t x, std::int64_t y, int level) const;

  std::span<const UvPlace> places_;
  std::vector<std::uint32_t> heads_;
  std::vector<Link> links_;
  std::vector<int> levels_;  ///< Levels of the triangles added, as powers of two
};

}  // namespace kiln
