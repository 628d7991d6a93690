// Finds flaws of a low poly: folds, degenerate triangles, new holes.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/kept_triangles.h"
#include "mesh/surface_distance.h"
#include "simplify/collapse_shape.h"

namespace kiln {

/// Indices of the triangles that have flaws.
struct Flaws {
  /// Triangles that face away from the high poly, or are folded onto a neighbour
  std::vector<std::uint32_t> folded;
  std::vector<std::uint32_t> flat;         ///< Triangles without area in single precision
  std::vector<std::uint32_t> facing_down;  ///< Triangles of a height field that face down
  bool none() const { return folded.empty() && flat.empty() && facing_down.empty(); }
  std::size_t count() const { return folded.size() + flat.size() + facing_down.size(); }
};

/// Limits for a single triangle, and for two neighbours.
namespace flaw_rules {

/// Limits of the cosine between the normals of two neighbours. Below kMaxSuspiciousCosine both triangles are checked.
/// Below kMaxBackToBackCosine one is folded onto the other.
inline constexpr double kMaxSuspiciousCosine = -0.5, kMaxBackToBackCosine = -0.985;
/// A triangle faces away if the largest cosine between its normal and the normals of the high poly near it is below
/// this.
inline constexpr double kMaxAwayCosine = -0.2;
/// Largest height of a degenerate triangle, as a share of its longest side.
inline constexpr double kMaxDegenerateHeight = 1e-12;

inline Vec3d normal_of(const TriangleCorners& p) { return cross(p[1] - p[0], p[2] - p[0]); }
inline Vec3d unit_or_zero(const Vec3d& v) {
  const double size = length(v);
  return size > 0 ? v * (1 / size) : Vec3d{};
}
/// True if a triangle's height is at most `share` times its longest side.
inline bool is_thin(const TriangleCorners& p, double share) {
  const Vec3d ab = p[1] - p[0], bc = p[2] - p[1], ca = p[0] - p[2];
  return !(length(normal_of(p)) > share * std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)}));
}
inline bool is_flat(const TriangleCorners& p) { return is_thin(p, kMaxDegenerateHeight); }

}  // namespace flaw_rules

/// Cells of a grid over [-1, 1]^3, as a bit each. A box is marked by its rows of cells along x, so that large boxes cost
/// little.
class MarkedCells {
 public:
  bool empty() const { return rows_.empty(); }
  /// Marks the cells that a box touches.
  void mark(const Vec3d& low, const Vec3d& high);
  /// True if the box touches a marked cell. Some cell must be marked.
  bool touches(const Vec3d& low, const Vec3d& high) const;
  /// True if all cells of the other are marked here, too. The other must not be empty.
  bool contains(const MarkedCells& other) const;

 private:
  static constexpr int kGridCells = 128;
  using Row = std::array<std::uint64_t, kGridCells / 64>;
  struct Range;
  std::vector<Row> rows_;
};

/// Compares a low poly with its high poly. Coordinates should be of about unit size.
class SimplifyCheck {
 public:
  /// The spans must outlive this object.
  SimplifyCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                bool height_field)
      : positions_(positions), triangles_(triangles), height_field_(height_field) {}

  /// Prepares a high poly that is small enough for a single tree.
  SimplifyCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles)
      : positions_(positions),
        triangles_(triangles),
        height_field_(false),
        surface_(std::make_unique<SurfaceDistance>(positions, triangles)),
        kept_(surface_->corners()) {}

  Flaws find(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles);
  /// Variant of find() that checks only the triangles whose indices are in `included`.
  Flaws find_selected(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                      std::span<const std::uint32_t> included);

  /// True if a triangle has a flaw by itself. The triangle must lie near one that find() has checked.
  bool is_flaw(const TriangleCorners& corners) const;

 private:
  Flaws find_flaws_in(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                      const std::vector<std::uint8_t>* is_included);
  void load_near(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                 std::span<const std::uint32_t> candidates);
  bool faces_away(const TriangleCorners& corners, bool shell) const;
  bool has_edge(const TriangleCorners& corners) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool height_field_;
  std::vector<Triangle> near_triangles_;  ///< Triangles of the high poly near the candidates
  MarkedCells marked_cells_;              ///< Cells whose triangles are in near_triangles_
  std::unique_ptr<SurfaceDistance> surface_;
  std::optional<KeptTriangles>
      kept_;  ///< Triangles of surface_; a low-poly triangle among them has no flaw
};

/// Number of loops of open edges: holes and rims.
std::uint64_t count_rims(std::span<const Triangle> triangles, std::size_t vertices);

}  // namespace kiln
