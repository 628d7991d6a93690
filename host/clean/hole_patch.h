// Surfaces that fill holes with many edges.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/vector.h"

namespace kiln {

/// The rim of a hole, in the orientation of its patch, and the surface around it.
struct HoleRim {
  std::vector<Vec3d> points;  ///< Corners of the rim
  std::vector<Vec3d>
      /// For each corner, the unit normal of the face at the edge to the next corner
      face_normals;
  /// Triangles of the surface that touch the rim. An index below the size of `points` is a corner of the rim; higher
  /// indices continue in `surrounding_points`.
  std::vector<std::array<std::uint32_t, 3>> surrounding_triangles;
  std::vector<Vec3d> surrounding_points;  ///< Further vertices of `surrounding_triangles`
};

/// A triangulated surface that fills a hole.
struct HolePatch {
  /// Vertices; the first ones are the rim's corners
  std::vector<Vec3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// For each vertex, the nearest corner of the rim, measured along the patch's edges
  std::vector<std::uint32_t> nearest;
  bool is_flat =
      /// True if the patch is flat and meets the surface at an angle; it then has no inner vertices
      false;
};

/// Mean cosine between the hole's plane and the faces around the hole, weighted by the lengths of the rim's edges. 1:
/// the surface continues across the hole; 0: the hole is the open end of walls; -1: the rim is the outline of a sheet.
/// 0 for a rim without area.
double continuation_cosine(const HoleRim& rim);

/// Fills a hole.
///
/// 1. The rim is triangulated as it appears along its normal: by ear clipping, then flips to a Delaunay triangulation.
/// 2. If the faces around the hole enclose more than 70 degrees with its plane, as at a box without a lid, these
///    triangles are the patch (is_flat). Otherwise, edges are split until they are about as long as the rim's edges
///    plus 0.3 of the distance from the rim, with flips to Delaunay triangulations (Liepa, Filling Holes in Meshes,
///    2003).
/// 3. Inner vertices move to where the patch bends least and continues the surface: they minimize the squared discrete
///    Laplacian (cotangent weights; Botsch and Kobbelt, 2004) of all vertices inside and on the rim. This is solved
///    several times, since the weights depend on the shape. A patch over a hole of a sphere is within 1.5% of the
///    radius if the angle from the hole's middle to its rim is at most 30 degrees, 3.1% at 45 and 6.1% at 60 degrees.
///
/// If an edge between two corners of the rim is an edge of the mesh already, it is split; otherwise it would have more
/// than two triangles.
/// \param is_edge  true if two corners of the rim share an edge of the mesh
HolePatch make_hole_patch(const HoleRim& rim,
                          const std::function<bool(std::uint32_t, std::uint32_t)>& is_edge);

/// Harmonic interpolation of values over a patch.
/// \param values  for each corner of the rim, its value
/// \returns the values of all vertices
std::vector<Vec3d> interpolate_over_patch(const HolePatch& patch, std::span<const Vec3d> values);

}  // namespace kiln
