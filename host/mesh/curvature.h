// Mean curvature of triangle meshes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Signed mean curvature (k1 + k2) / 2 at every vertex, over the surface in a ball B around it: the
/// normal cycle (Cohen-Steiner, Morvan, "Restricted Delaunay Triangulations and Normal Cycle", SCG
/// 2003),
///
///     H = 1 / area(B) * sum over edges of angle * length(edge in B) / 2,
///
/// with the angle between the normals of an edge's two triangles, positive where the edge is
/// convex. Edges and triangles are clipped by the ball exactly.
///
/// Vertices at one place are one. Triangles without area, or not finite, do not count. Edges count
/// that two triangles share in opposite senses; borders, edges of more triangles and edges between
/// triangles of opposite winding are flat. All of the mesh in the ball counts, also the other side
/// of a thin wall.
///
/// Parts of the mesh that fit in a box with a diagonal of 1/8 of the radius are not clipped: they
/// count by the share of the box's width that is in the ball. The ball's part of longer edges is
/// exact while its border crosses 800 long triangles, or 3,200 short, at most; where more cross it
/// (needles round one tip, sheets that lie on each other), one of some hundred in the same box
/// stands for it. So a vertex costs some hundred steps, however many edges the ball holds.
///
/// \param radius  above 0, same units as the positions. Where all of a vertex's edges are longer,
///                the ball reaches to the end of the shortest one: in less there is nothing
///                but the vertex itself.
/// \param steps   where not null, receives the number of boxes and triangles looked at
/// \returns for each vertex, in one over the positions' unit; 0 for vertices of no triangle
/// Deterministic, whatever the number of threads. Time n log n for n triangles and some ten
/// microseconds a vertex on each thread; memory about 80 bytes a triangle.
std::vector<double> mean_curvature(std::span<const Vec3> positions,
                                   std::span<const Triangle> triangles, double radius,
                                   std::uint64_t* steps = nullptr);

}  // namespace kiln
