// Flaws of a low poly: folds, triangles without area, new holes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/surface_distance.h"
#include "simplify/collapse_shape.h"

namespace kiln {

/// Triangles that a low poly should not have.
struct Flaws {
  std::vector<std::uint32_t> folded;  ///< They face away from the high poly, or lie on a neighbour.
  std::vector<std::uint32_t> flat;    ///< They have no area, as single precision holds them.
  std::vector<std::uint32_t> facing_down;  ///< Triangles of a height field that face down.
  bool none() const { return folded.empty() && flat.empty() && facing_down.empty(); }
  std::size_t count() const { return folded.size() + flat.size() + facing_down.size(); }
};

/// Thresholds for a triangle by itself, and beside its neighbours.
namespace flaw_rules {

/// Cosine between neighbours' normals: below the first, both are looked at; below the second, one lies on the other.
inline constexpr double kSuspicious = -0.5, kBackToBack = -0.985;
/// A triangle faces away where the best of the dense normals near it is below this.
inline constexpr double kAway = -0.2;
/// Height of a triangle without area, a share of its longest side.
inline constexpr double kNoArea = 1e-12;

inline Vec3d normal_of(const TriangleCorners& p) { return cross(p[1] - p[0], p[2] - p[0]); }
inline Vec3d unit_or_zero(const Vec3d& v) {
  const double size = length(v);
  return size > 0 ? v * (1 / size) : Vec3d{};
}
/// True if a triangle is no higher than a share of its longest side.
inline bool is_thin(const TriangleCorners& p, double share) {
  const Vec3d ab = p[1] - p[0], bc = p[2] - p[1], ca = p[0] - p[2];
  return !(length(normal_of(p)) > share * std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)}));
}
inline bool is_flat(const TriangleCorners& p) { return is_thin(p, kNoArea); }

}  // namespace flaw_rules

/// Compares a low poly with the high poly that it stands for. Coordinates of about unit size.
class SimplifyCheck {
 public:
  /// Spans must outlive this.
  SimplifyCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                bool height_field)
      : positions_(positions), triangles_(triangles), height_field_(height_field) {}

  /// With a high poly that is small enough to be looked at as a whole.
  SimplifyCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles)
      : positions_(positions),
        triangles_(triangles),
        height_field_(false),
        surface_(std::make_unique<SurfaceDistance>(positions, triangles)) {}

  Flaws find(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles);
  /// Checks some triangles alone.
  Flaws find_among(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                   std::span<const std::uint32_t> some);

  /// True if a triangle near one that find() looked at is a flaw by itself.
  bool is_flaw(const TriangleCorners& corners) const;

 private:
  Flaws find_in(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                const std::vector<std::uint8_t>* some);
  void load_near(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                 std::span<const std::uint32_t> candidates);
  bool faces_away(const TriangleCorners& corners, bool shell) const;
  bool has_edge(const TriangleCorners& corners) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool height_field_;
  std::vector<Triangle> near_;        ///< Triangles of the high poly near the candidates.
  std::vector<std::uint8_t> marked_;  ///< Cells of a grid that these touch.
  std::unique_ptr<SurfaceDistance> surface_;
};

/// Loops of open edges: holes and rims.
std::uint64_t count_rims(std::span<const Triangle> triangles, std::size_t vertices);

}  // namespace kiln
