// The surface that charts grow on: usable triangles, welded, with the half-edge across every edge.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/half_edge.h"
#include "mesh/vector.h"

namespace kiln {

/// Half-edge 3 t + k runs from corner k of triangle t to the next corner.
struct ChartSurface {
  std::vector<Vec3d> positions;       ///< Moved to the origin, scaled by a power of two to about 1.
  std::vector<Triangle> triangles;    ///< With area only; corners are welded.
  std::vector<std::uint32_t> source;  ///< Their places in the mesh.
  std::vector<std::uint32_t> mate;  ///< The half-edge opposite; kNoIndex at borders and where more
                                    ///< than two triangles meet or two disagree in orientation.
  std::vector<double> length;       ///< Per half-edge.
  std::vector<double> area;         ///< Per triangle.
  std::vector<Vec3d> normal;        ///< Per triangle, unit.
  /// Per triangle, means over its corners: how far each is from lying flat, and the square of that. It is the
  /// logarithm of the angle around the corner over a full turn. 0 at borders.
  std::vector<double> bend, bend_squared;
  double total_area = 0;
  double finer = 1;  ///< For a proxy: triangles of the surface it stands for, over its own.
};

/// \param mesh  indices in range
ChartSurface chart_surface(const Mesh& mesh);

/// Fills in lengths, areas, normals and bends, of positions, triangles and mates.
void measure_surface(ChartSurface& surface);

inline std::uint32_t start_of(const ChartSurface& surface, std::uint32_t h) {
  return surface.triangles[h / 3][h % 3];
}
inline std::uint32_t end_of(const ChartSurface& surface, std::uint32_t h) {
  return start_of(surface, next_half_edge(h));
}

}  // namespace kiln
