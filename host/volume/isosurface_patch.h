// Patches of a low poly, which are edited as triangles and then written back as polygons.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kiln/volume.h"
#include "simplify/collapse_mesh.h"
#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// The triangles of a low poly's polygons, in order.
struct IsosurfaceFaces {
  explicit IsosurfaceFaces(const SimplifiedIsosurface& low_poly);
  std::vector<Triangle> triangles;
};

/// An edited copy of a low poly's triangles, and the vertices that the edits merged.
struct IsosurfaceChange {
  IsosurfaceChange(const SimplifiedIsosurface& low_poly, const IsosurfaceFaces& faces);

  /// Rebuilds polygons from the remaining triangles and removes unused vertices. A vertex inherits
  /// the fine vertices of those merged into it.
  /// \returns for each old vertex, the new number of the vertex that represents it;
  ///   VertexTree::kNone if there is none
  std::vector<std::uint32_t> apply_to_low_poly(const FineSurface& surface,
                                               SimplifiedIsosurface& low_poly);

  std::vector<Triangle> triangles;
  std::vector<std::uint8_t> is_remaining;  ///< For each triangle, 1 if it remains
  /// For each vertex, the vertex into which it was merged, or itself
  std::vector<std::uint32_t> merged_into;

 private:
  void make_polygons(SimplifiedIsosurface& low_poly) const;
  std::vector<std::uint32_t> renumber_vertices(SimplifiedIsosurface& low_poly) const;
  void assign_leaves(const std::vector<std::uint32_t>& number,
                     SimplifiedIsosurface& low_poly) const;
};

/// A part of a low poly that is repaired: the triangles around some seed triangles, scaled to about
/// unit size, and the fine surface that they represent.
class IsosurfacePatch {
 public:
  /// \param seeds  triangles to include, with two rings around them
  IsosurfacePatch(const FineSurface& surface, const SimplifiedIsosurface& low_poly,
                  const IsosurfaceFaces& faces, std::span<const std::uint32_t> seeds);

  Vec3 to_world(const Vec3d& p) const { return to_float(p * size_ + box_center_); }
  Vec3d to_unit(const Vec3& p) const { return (to_double(p) - box_center_) * (1 / size_); }
  /// Rounds a point to the nearest one that the low poly can store in single precision.
  Vec3d snap(const Vec3d& p) const { return to_unit(to_world(p)); }

  /// Replaces the patch's triangles and points by the result of edge collapses.
  /// \param merges  pairs of the vertex that is kept and the vertex that was merged into it
  void apply_collapses(const CollapseMesh& mesh,
                       std::span<const std::pair<std::uint32_t, std::uint32_t>> merges);
  /// Writes the patch back to the low poly.
  void apply_to_low_poly(const FineSurface& surface, const Volume& volume,
                         SimplifiedIsosurface& low_poly) const;

  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> seeds;  ///< Remaining seed triangles, as indices into `triangles`
  /// For each vertex, 1 if it lies on the patch's boundary or on an open border
  std::vector<std::uint8_t> is_fixed;
  std::vector<Vec3> fine_points;
  std::vector<Triangle> fine_triangles;

 private:
  void find_fixed_vertices(std::span<const std::uint8_t> free);
  void remove_duplicates();
  void collect_fine_quads(const FineSurface& surface, const SimplifiedIsosurface& low_poly,
                          std::span<const std::uint8_t> free);

  const IsosurfaceFaces& faces_;
  Vec3d box_center_{};
  double size_ = 1;
  std::vector<std::uint32_t> vertices_;  ///< For each point of the patch, the low poly's vertex
  /// For each triangle of the patch, the low poly's triangle
  std::vector<std::uint32_t> low_poly_triangles_;
  std::vector<std::uint32_t>
      replaced_triangles_;  ///< The low poly's triangles that the patch replaces
  std::vector<std::pair<std::uint32_t, std::uint32_t>> merged_vertices_;
};

}  // namespace kiln
