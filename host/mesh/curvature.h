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

/// Signed mean curvature (k1 + k2) / 2 of a mesh at any point, over the surface in a ball B around it: the
/// normal cycle (Cohen-Steiner, Morvan, "Restricted Delaunay Triangulations and Normal Cycle", SCG
/// 2003),
///
///     H = 1 / area(B) * sum over edges of angle * length(edge in B) / 2,
///
/// with the angle between the normals of an edge's two triangles, positive where the edge is
/// convex. Edges and triangles are clipped by the ball exactly, so H is a property of the surface: however flat faces
/// are cut into triangles, it is the same, to rounding. The radius is the same everywhere for the same reason: one that
/// follows the edges would follow how the surface is cut. So a faceted surface has its curvature within a radius of its
/// edges, and none on flat faces.
///
/// Vertices at one place are one. Triangles without area, or not finite, do not count. Edges count
/// that two triangles share in opposite senses; borders, edges of more triangles and edges between
/// triangles of opposite winding are flat.
///
/// A point of a triangle has the curvature of its own sheet (Sheet): the other side of a thin wall does not count, nor
/// does another part that looks the other way. What counts in the ball is the patch of triangles that are connected
/// with the point's, across edges which the ball reaches, and everything else whose normal is within 127 degrees of
/// the point's. So a hollow ball of radius R has 1/R outside, however thin its wall, and -1/r inside. At a rim, where
/// the ball reaches round it, both sides are one patch and count. Where the patch has over 4,096 triangles, faces that
/// look the other way do not count at all.
///
/// On triangles that are small, on()'s values are interpolated between those at the corners, found when first asked for: the
/// longest edge is at most 1/4 of the radius, and the corners' values differ by at most 1/256 of one over the radius.
/// Between these the exact value lies as well wherever it changes in one direction; at worst it is off by what
/// interpolation over so short a way misses of sharp edges, below 0.1 over the radius.
///
/// EdgeTree tells where balls that hold very many triangles are less than exact.
class MeanCurvature {
 public:
  /// Scratch memory that evaluations use again. One a thread.
  using Scratch = EdgeTree::Scratch;

  /// \param positions  with the triangles, to stay as they are for as long as this is in use
  /// \param radius     above 0, same units as the positions
  /// Time n log n for n triangles; memory about 160 bytes a triangle, four times that where long ones lie in all
  /// directions.
  MeanCurvature(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                double radius);

  /// At a point anywhere, of all sheets in the ball. \returns in one over the positions' unit; 0 where the ball holds
  /// no surface. Some microseconds.
  double at(const Vec3d& point, Scratch& scratch) const;
  /// At a point of a triangle, of its own sheet, by the weights of its corners 1 and 2. Any number of threads may ask at once, each with
  /// its own scratch: the value is the same to the bit, whatever was asked before.
  double on(std::uint32_t triangle, double u, double v, Scratch& scratch) const;

 private:
  double at_vertex(std::uint32_t vertex, Scratch& scratch) const;
  double on_sheet(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;
  bool flood(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  double radius_;
  std::optional<EdgeTree> tree_;
  /// Per edge (3 * triangle + k), the next one between the same two places: a ring through all triangles there.
  std::vector<std::uint32_t> across_;
  std::vector<std::uint32_t> first_triangle_;           // with each vertex
  mutable std::vector<std::atomic<double>> at_vertex_;  // NaN: not asked for yet
};

/// Facets in a radius, so that MeanCurvature does not show them: on spheres of even triangles, a radius of 1, 2 and 3
/// facets has values that differ by 7%, 3% and 1.5% (standard deviation).
inline constexpr double kFacetsARadius = 3;

/// Size of the facets that smooth surfaces were cut into: the mean, by angle * length, over edges that bend by at most
/// 1 / kFacetsARadius, of the lower height of both triangles over the edge. The width of a cylinder's sides, whatever
/// its caps are; 0.87 edges where triangles are all alike. Edges that bend by more are the shape itself: a ball of
/// kFacetsARadius such facets would be larger than the radius of their curvature. Unlike curvature, it follows how the
/// surface is cut. \returns 0 where no edge bends so; the same to the bit on any number of threads. Time n log n.
double facet_size(std::span<const Vec3> positions, std::span<const Triangle> triangles);

}  // namespace kiln
