// Input of simplification: the usable triangles of a mesh, scaled to unit size.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"
#include "simplify/uv_seam_constraint.h"

namespace kiln {

/// The triangle of the given mesh that a triangle was made from.
struct SourceTriangle {
  std::uint32_t index;
  std::uint32_t first;  ///< Corner of the given triangle that became the first corner
};

/// A triangle that faces away from the surface that it approximates.
struct Fold {
  std::uint32_t triangle;
  Vec3d surface{};  ///< The high poly's normal at the triangle, of any length
};

/// A ball, given by its centre and radius.
struct Ball {
  Vec3d center{};
  double radius;
};

/// The mesh that is simplified. It is welded, centred, and scaled to a bounding box with a diagonal of 1.
struct Work {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  /// Source of each triangle; empty after presimplification, which creates new triangles
  std::vector<SourceTriangle> sources;
  /// Label of each triangle (see Labels); empty if all have the same label
  std::vector<std::uint32_t> labels;
  /// For each triangle, the triangle of the given mesh that is its back, or TwoSided::kNone; empty if no triangle is
  /// two-sided. labels_of() needs it, since labels depend on fronts and backs.
  std::vector<std::uint32_t> backs;
  /// True if labels must be kept because only some triangles are two-sided
  bool keep_labels = false;
  std::vector<Fold> folds;  ///< Folds that remain after presimplification
  std::vector<Vec3d> torn;  ///< Points at which edges of more than two triangles were cut
};

/// True if much of a mesh is flat, or tessellated far more finely than low polys need: at 15% of the corners or more,
/// neighbouring triangles are within half a degree of each other. meshoptimizer collapses the edges between them at
/// nearly no cost, and leaves slivers. Hard surfaces and smooth tubes have 23% to 64% such corners; scans and rocks
/// have 1% to 5%.
bool is_finely_curved(const Work& work);

/// Reverses all triangles if the closed components are inside out, as marching cubes often leaves them. The orientation
/// matters because convex and concave places have different weights.
/// \returns true if the triangles were reversed
bool turn_outwards(const Mesh& mesh, std::vector<Triangle>& triangles);

/// Transforms between the coordinates of the mesh and those of the collapser.
class Scale {
 public:
  Scale(const Mesh& mesh, const std::vector<Triangle>& triangles);
  Vec3d to_work(const Vec3& p) const;
  Vec3 to_mesh(const Vec3d& p) const { return to_float(p * diagonal_ + center_); }
  /// Rounds a point to a position that the given mesh can store.
  Vec3d snap(const Vec3d& p) const { return to_work(to_mesh(p)); }
  /// Largest distance by which snap() moves a point.
  double slack() const;

 private:
  Vec3d center_{};
  double diagonal_ = 1;
};

/// The triangles of a mesh over welded vertices, without degenerate and duplicate ones.
/// \param backs  if not null, receives Work::backs, and the backs of two-sided sheets are left out of the result
/// \throws Error(input) for an index out of range, or if no triangle is left
std::vector<Triangle> clean(const Mesh& mesh, std::vector<SourceTriangle>& sources,
                            std::vector<std::uint32_t>* backs, std::vector<Warning>& warnings);

/// Removes unused vertices and renumbers the others.
Work compact(const Mesh& mesh, std::vector<Triangle> triangles, std::vector<SourceTriangle> sources,
             std::vector<std::uint32_t> backs, const Scale& scale);

/// Labels of triangles. A label stands for one combination of group, object and material, of a triangle's front and of
/// its back if it has one.
struct Labels {
  std::vector<std::uint32_t> of;      ///< Label of each triangle; empty if the mesh has no labels
  std::vector<std::uint32_t> source;  ///< For each label, a triangle of the given mesh that has it
  /// For each label, the triangle that is the back of a triangle with this label, or TwoSided::kNone if there is none.
  /// Empty if no triangle is two-sided
  std::vector<std::uint32_t> backs;
};
Labels labels_of(const Mesh& mesh, const Work& work);

/// UVs and groups of the given mesh, for the triangles of `work`.
Layout layout_of(const Mesh& mesh, const Work& work);

std::vector<Vec3> to_floats(const std::vector<Vec3d>& points);

}  // namespace kiln
