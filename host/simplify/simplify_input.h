// Input of simplification: the mesh without unusable triangles, about unit size.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"
#include "simplify/uv_seam_constraint.h"

namespace kiln {

/// A triangle of the given mesh.
struct SourceTriangle {
  std::uint32_t index;
  std::uint32_t first;  ///< Its corner that comes first now.
};

/// A triangle that faces away from the surface that it stands for.
struct Fold {
  std::uint32_t triangle;
  Vec3d surface;  ///< The high poly's normal there, of any length.
};

/// A ball.
struct Place {
  Vec3d center;
  double radius;
};

/// A mesh as the collapser takes it: welded, centred, its bounding box's diagonal 1.
struct Work {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<SourceTriangle>
      sources;  ///< By triangle; empty once presimplification has made new ones.
  std::vector<std::uint32_t> labels;  ///< By triangle; empty: all have one. See Labels.
  /// By triangle, the given mesh's triangle on its back, or TwoSided::kNone; empty: none has two sides. For
  /// labels_of() alone, which gives triangles of one side and of two different labels.
  std::vector<std::uint32_t> backs;
  bool keep_labels = false;  ///< Labels may not be lost: some triangles alone have two sides.
  std::vector<Fold> folds;   ///< Folds that presimplification left.
  std::vector<Vec3d> torn;   ///< Places where edges of too many triangles were cut.
};

/// True if much of a mesh is flat, or curved in far finer steps than low polys need: around at least 15% of the
/// corners, triangles lie within half a degree of each other. meshoptimizer collapses these edges at next to no
/// cost, and leaves slivers. Hard surfaces and smooth tubes have 23% to 64%, scans and rocks 1% to 5%.
bool is_finely_curved(const Work& work);

/// Turns all triangles round where they are closed and inside out, as marching cubes often leaves them. Outlines and
/// hollows differ in weight, so which way is out counts. \returns whether it did
bool turn_outwards(const Mesh& mesh, std::vector<Triangle>& triangles);

/// Between the mesh's own coordinates and the collapser's.
class Scale {
 public:
  Scale(const Mesh& mesh, const std::vector<Triangle>& triangles);
  Vec3d to_work(const Vec3& p) const;
  Vec3 to_mesh(const Vec3d& p) const { return to_float(p * diagonal_ + center_); }
  /// To where the mesh's numbers can hold a point.
  Vec3d snap(const Vec3d& p) const { return to_work(to_mesh(p)); }
  /// The largest distance a point moves by that.
  double slack() const;

 private:
  Vec3d center_;
  double diagonal_ = 1;
};

/// Triangles over welded vertices, without those that have no area or a twin.
/// \param backs  where to note backs of two-sided sheets, which are left out then, by triangle: see Work; null: all stay
/// \throws Error(input) for an index out of range, or where nothing is left
std::vector<Triangle> clean(const Mesh& mesh, std::vector<SourceTriangle>& sources,
                            std::vector<std::uint32_t>* backs, std::vector<Warning>& warnings);

/// Renumbers to the vertices in use.
Work compact(const Mesh& mesh, std::vector<Triangle> triangles, std::vector<SourceTriangle> sources,
             std::vector<std::uint32_t> backs, const Scale& scale);

/// Group, object and material of a triangle's front, and of its back, if any; as one number.
struct Labels {
  std::vector<std::uint32_t> of;      ///< By triangle; empty: the mesh has none.
  std::vector<std::uint32_t> source;  ///< By label, a triangle of the given mesh that has it.
  std::vector<std::uint32_t>
      backs;  ///< By label, one on its back, or TwoSided::kNone; empty: none has two sides.
};
Labels labels_of(const Mesh& mesh, const Work& work);

/// The given mesh's UVs and groups at the triangles of `work`.
Layout layout_of(const Mesh& mesh, const Work& work);

std::vector<Vec3> to_floats(const std::vector<Vec3d>& points);

}  // namespace kiln
