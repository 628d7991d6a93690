// The surface that charts are grown on: welded triangles with area, and the half-edge opposite each half-edge.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/half_edge.h"
#include "mesh/vector.h"

namespace kiln {

/// A surface as triangles and half-edges. Half-edge 3 t + k runs from corner k of triangle t to the next corner.
struct ChartSurface {
  /// Positions, translated to the origin and scaled by a power of two to a size of about 1.
  std::vector<Vec3d> positions;
  /// Triangles of positive area; their corners are welded vertices
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> source;  ///< Index in the mesh of each triangle
  /// The opposite half-edge; kNoIndex at borders and where more than two triangles meet or two are oriented
  /// inconsistently.
  std::vector<std::uint32_t> mate;
  std::vector<double> length;  ///< Length of each half-edge
  std::vector<double> area;    ///< Area of each triangle
  std::vector<Vec3d> normal;   ///< Unit normal of each triangle
  /// For each triangle, the mean over its corners of the bend, and of the squared bend. The bend at a vertex is the
  /// logarithm of (the sum of angles around the vertex / 360 degrees): 0 at a flat vertex and at borders.
  std::vector<double> bend, bend_squared;
  double total_area = 0;
  double finer_per_triangle =
      1;  ///< For a proxy: mean number of triangles of the finer surface per proxy triangle
};

/// \param mesh  mesh whose indices are in range
ChartSurface chart_surface(const Mesh& mesh);

/// Computes lengths, areas, normals and bends from positions, triangles and mates.
void measure_surface(ChartSurface& surface);

inline std::uint32_t start_of(const ChartSurface& surface, std::uint32_t h) {
  return surface.triangles[h / 3][h % 3];
}
inline std::uint32_t end_of(const ChartSurface& surface, std::uint32_t h) {
  return start_of(surface, next_half_edge(h));
}

}  // namespace kiln
