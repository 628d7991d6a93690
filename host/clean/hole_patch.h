// Surfaces that fill holes with many edges.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/vector.h"

namespace kiln {

/// A hole's rim, in the orientation of its patch, and the surface around it.
struct HoleRim {
  std::vector<Vec3d> points;  ///< Corners of the rim
  std::vector<Vec3d>
      face_normals;  ///< Unit normal of the face beside the edge from each corner to the next
  /// Triangles of the surface that touch the rim. Indices below the size of `points` are corners of the rim; the
  /// others continue in `surrounding_points`.
  std::vector<std::array<std::uint32_t, 3>> surrounding_triangles;
  std::vector<Vec3d> surrounding_points;  ///< Further vertices of `surrounding_triangles`
};

/// A triangulated surface that fills a hole.
struct HolePatch {
  /// Vertices; the first ones are the rim's corners
  std::vector<Vec3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Per vertex, the nearest corner of the rim along the patch's edges
  std::vector<std::uint32_t> nearest;
  bool is_flat =
      false;  ///< True if the patch meets the surface at an angle, so that it has no inner vertices
};

/// Mean cosine between the hole's plane and the faces around it, weighted by the lengths of the rim's edges. 1: the
/// surface continues across the hole; 0: walls around a lid; -1: the outline of a sheet. 0 for a rim without area.
double continuation_cosine(const HoleRim& rim);

/// Fills a hole.
///
/// 1. The rim is triangulated: seen along its normal by ear clipping and flips to a Delaunay triangulation.
/// 2. Where faces around lie at more than 70 degrees to the hole's plane, as at a box without a lid, the patch is these
///    triangles (is_flat). Elsewhere edges are split down to the lengths of the rim's edges, which may grow by 0.3 of
///    the distance from the rim, with flips to Delaunay triangles (Liepa, Filling Holes in Meshes, 2003).
/// 3. Vertices inside move to where the patch bends least and continues the surface: they minimise the squared discrete
///    Laplacian (cotangent weights; Botsch and Kobbelt, 2004) of all vertices inside and on the rim. Solved several
///    times, as the weights follow the shape. A patch over a hole of a sphere is within 1.5% of the radius up to
///    30 degrees from the hole's middle to its rim, 3.1% at 45 and 6.1% at 60.
/// An edge between two corners of the rim that is an edge of the mesh already is split, or it would have more than two
/// triangles.
/// \param is_edge  true if two corners of the rim share an edge of the mesh
HolePatch make_hole_patch(const HoleRim& rim,
                          const std::function<bool(std::uint32_t, std::uint32_t)>& is_edge);

/// Harmonic interpolation over a patch. \param values  per corner of the rim \returns values of all vertices
std::vector<Vec3d> interpolate_over_patch(const HolePatch& patch, std::span<const Vec3d> values);

}  // namespace kiln
