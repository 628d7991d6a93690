// Parts of a low poly that are changed as triangles, and put back as polygons.
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

/// Triangles of a low poly's polygons, in order.
struct IsosurfaceFaces {
  explicit IsosurfaceFaces(const SimplifiedIsosurface& low_poly);
  std::vector<Triangle> triangles;
};

/// Changes of triangles and vertices.
struct IsosurfaceChange {
  IsosurfaceChange(const SimplifiedIsosurface& low_poly, const IsosurfaceFaces& faces);

  /// Makes the polygons of what is left, and drops vertices that none has. What fine vertices stood for one that was
  /// joined with another stands for that.
  /// \return by vertex the number of what stands for it now; VertexTree::kNone for what is gone
  std::vector<std::uint32_t> apply(const FineSurface& surface, SimplifiedIsosurface& low_poly);

  std::vector<Triangle> triangles;
  std::vector<std::uint8_t> alive;  ///< By triangle
  std::vector<std::uint32_t> into;  ///< By vertex: what it was joined with, or itself

 private:
  void make_polygons(SimplifiedIsosurface& low_poly) const;
  std::vector<std::uint32_t> number_vertices(SimplifiedIsosurface& low_poly) const;
  void deal_leaves(const std::vector<std::uint32_t>& number, SimplifiedIsosurface& low_poly) const;
};

/// Triangles around some of a low poly, about unit size, with the fine surface there.
class IsosurfacePatch {
 public:
  /// \param seeds  triangles to be within, two rings from the rim
  IsosurfacePatch(const FineSurface& surface, const SimplifiedIsosurface& low_poly,
                  const IsosurfaceFaces& faces, std::span<const std::uint32_t> seeds);

  Vec3 to_world(const Vec3d& p) const { return to_float(p * size_ + center_); }
  Vec3d to_unit(const Vec3& p) const { return (Vec3d(p) - center_) * (1 / size_); }
  /// To where floats can hold a point.
  Vec3d snap(const Vec3d& p) const { return to_unit(to_world(p)); }

  /// Takes over what was made of the patch. \param merges  vertices kept and gone, in turn
  void take(const CollapseMesh& mesh,
            std::span<const std::pair<std::uint32_t, std::uint32_t>> merges);
  /// Puts it back into the low poly.
  void apply(const FineSurface& surface, const Volume& volume,
             SimplifiedIsosurface& low_poly) const;

  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> seeds;  ///< As numbered here, what is left of them
  std::vector<std::uint8_t> fixed;   ///< On the rim, or on an open border
  std::vector<Vec3> fine_points;
  std::vector<Triangle> fine_triangles;

 private:
  void find_fixed(std::span<const std::uint8_t> free);
  void leave_repeats_out();
  void gather_fine(const FineSurface& surface, const SimplifiedIsosurface& low_poly,
                   std::span<const std::uint8_t> free);

  const IsosurfaceFaces& faces_;
  Vec3d center_;
  double size_ = 1;
  std::vector<std::uint32_t> vertices_;  ///< By point: the low poly's
  std::vector<std::uint32_t> numbers_;   ///< By triangle: the low poly's
  std::vector<std::uint32_t> all_;       ///< Triangles that were there
  std::vector<std::pair<std::uint32_t, std::uint32_t>> merges_;
};

}  // namespace kiln
