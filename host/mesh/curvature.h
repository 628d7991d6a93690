// Mean curvature of triangle meshes.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/edge_tree.h"

namespace kiln {

/// Signed mean curvature (k1 + k2) / 2 of a mesh at any point, averaged over the surface in a ball B around it by the
/// normal cycle (Cohen-Steiner, Morvan, "Restricted Delaunay Triangulations and Normal Cycle", SCG 2003),
///
///     H = 1 / area(B) * sum over edges of angle * length(edge in B) / 2,
///
/// with the angle between the normals of an edge's two triangles, positive if the edge is convex. Edges and triangles
/// are clipped by the ball exactly, so H depends on the surface alone and not on its triangulation, up to rounding.
/// The radius is constant for the same reason. A faceted surface thus has curvature up to a distance of one radius
/// from its edges, and none elsewhere on flat faces.
///
/// Vertices of equal position count as one. Degenerate and non-finite triangles are skipped. An edge counts if
/// exactly two triangles share it in opposite orientation; borders, edges of more triangles and edges between
/// triangles of opposite winding count as flat.
///
/// A point of a triangle has the curvature of its own sheet (Sheet): the opposite side of a thin wall, and other
/// parts that face the opposite way, do not count. The sheet consists of the triangles that are connected with the
/// point's triangle over edges within the ball, and of all others whose normals are within 127 degrees of the
/// point's. A hollow ball of outer radius R and inner radius r thus has 1/R outside and -1/r inside, however thin its
/// wall. If the ball contains a rim, both sides are connected, and both count. If over 4,096 triangles are connected,
/// faces of the opposite direction are excluded altogether.
///
/// On small triangles, on() interpolates between the values at the corners, which are computed on first use. A
/// triangle is small if its longest edge is at most 1/4 of the radius, and its corners' values differ by at most
/// 1/256 of 1 / radius. Where curvature is monotone, the error of the interpolated value is at most that difference;
/// near sharp edges its error is below 0.1 / radius.
///
/// See EdgeTree for approximations in balls with very many triangles.
class MeanCurvature {
 public:
  /// Reusable scratch memory; each thread needs its own.
  using Scratch = EdgeTree::Scratch;

  /// Prepares a mesh. Time O(n log n) for n triangles. Memory about 160 bytes per triangle, four times that for long
  /// triangles in random directions.
  /// \param positions  must outlive this object and remain unchanged; the same holds for the triangles
  /// \param radius     above 0, in units of the positions
  MeanCurvature(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                double radius);

  /// Curvature at any point, averaged over the whole surface in the ball around it. Takes microseconds.
  /// \returns the curvature in 1 / units of the positions; 0 if the ball contains no surface
  double at(const Vec3d& point, Scratch& scratch) const;
  /// Curvature of a triangle's own sheet, at the point with the barycentric coordinates u of corner 1 and v of corner
  /// 2. Thread-safe with one scratch per thread. The bits do not depend on what was evaluated before.
  double on(std::uint32_t triangle, double u, double v, Scratch& scratch) const;

 private:
  double curvature_at_vertex(std::uint32_t vertex, Scratch& scratch) const;
  double curvature_on_sheet(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;
  bool find_connected(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  double radius_;
  std::optional<EdgeTree> tree_;
  /// For each half-edge (3 * triangle + k), the next half-edge between the same two positions; these form a ring.
  std::vector<std::uint32_t> next_around_edge_;
  std::vector<std::uint32_t> first_triangle_;  // First triangle of each vertex
  // Cached curvature of each vertex; NaN if it is not computed yet
  mutable std::vector<std::atomic<double>> vertex_curvatures_;
};

/// Smallest radius of curvature maps at which facets are invisible, in units of facet_size(). On spheres of even
/// triangles, radii of 1, 2 and 3 facets give values with standard deviations of 7%, 3% and 1.5%.
inline constexpr double kMinFacetsPerRadius = 3;

/// Estimates the size of the facets that approximate smooth surfaces: the mean, over edges, of the lower height of the
/// two adjacent triangles, weighted by angle * length. Only edges with an angle of at most 1 / kMinFacetsPerRadius
/// (radians) count; sharper ones are features of the shape itself. For a cylinder, the result is the width of its
/// sides, whatever its caps; for equal equilateral triangles, it is 0.87 edge lengths. Unlike curvature, it depends on
/// the triangulation. Deterministic on any number of threads. O(n log n).
/// \returns 0 if no edge counts
double facet_size(std::span<const Vec3> positions, std::span<const Triangle> triangles);

}  // namespace kiln
