// Finds hard edges of meshes without normals, from the angles between faces.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/face_edges.h"

namespace kiln {

/// Turn in degrees below which an edge is always smooth.
inline constexpr double kMinCreaseDegrees = 20;

/// Result of the crease rules for one mesh.
struct Creases {
  std::vector<bool> hard;       ///< True for each hard edge of FaceEdges
  std::vector<bool> hard_part;  ///< True for each triangle whose part has hard edges
  /// For each triangle of a hard part, the lowest triangle of its planar region; for others, the triangle itself
  std::vector<std::uint32_t> regions;
  /// Area of each planar region, indexed by its lowest triangle; 0 for single triangles and bent regions
  std::vector<float> region_areas;
  std::uint64_t parts = 0;       ///< Number of connected parts
  std::uint64_t hard_parts = 0;  ///< Number of parts with hard edges
  std::uint64_t split_parts =
      0;  ///< Number of hard parts whose hard edges follow from vertices that the file splits
  double least_degrees = 180;      ///< Smallest turn of a hard edge
  double most_smooth_degrees = 0;  ///< Largest turn of a smooth edge of hard parts
};

/// Finds hard edges by the distribution of turns, separately for each connected part.
///
/// Triangles connected over edges form parts. The turn of an edge is the angle between its faces' normals. In scans
/// and sculptures, all turns occur, large ones less often. Hard surfaces have planes, rounded edges with small equal
/// turns, and sharp edges: a gap separates the turns of sharp edges from all others. The rule searches for this gap
/// in a histogram of a part's turns. The weight of an edge is the smaller area of its two triangles, so that needles
/// hardly count; edges above a gap need at least 0.02% of the weight. A gap from a (at least 20 degrees, below which
/// edges are smooth) to b holds less than a tenth of the weight above it. The gap with the largest ratio b / a is
/// used if the ratio is at least
/// 1.5. The histogram always includes a virtual edge of 90 degrees: if all turns are equal, they are facets of a
/// round below sqrt(20 * 90) = 42 degrees, and edges above. Hard edges must also form lines: at both ends of 80% of
/// them, another hard edge or a border continues. Edges of noise, in contrast, end abruptly.
///
/// A part without a gap has hard edges, too, if a quarter of its edges lie within exact planes: the threshold is then
/// the minimum of the histogram between 25 and 50 degrees, if 90% of the edges above form lines. A part whose
/// vertices lie on a lattice of its own edge length is a surface of labelled voxels (turns of 35, 45 and 55 degrees),
/// and is smooth.
///
/// If a part's triangles share vertices along some edges and have separate ones along others, the file itself marks
/// hard edges: split edges are hard if their median turn is 25 degrees and twice the 90% quantile of the other turns,
/// or if their 10% quantile is at least 5 degrees and twice that quantile. Splits at UV seams have the same turns as
/// other edges, and are not used. If no vertices are shared, as in STL, the file contains no such information.
///
/// Finally, edges between planes of hard parts are corrected one at a time. Turns of 42 to 46 degrees belong to a
/// round if four equal planes in a row have equal turns (a tube of eight sides). Turns of 5 degrees or more are hard
/// if neither plane has a similar turn at another edge: this is the case at the ridge of a roof.
Creases find_creases(const Mesh& mesh, const FaceEdges& faces);

/// Creases from smoothing groups as in 3DS and FBX: an edge is smooth if its faces have a group in common.
/// \param masks  for each triangle, one bit per group; 0: the polygon is flat
Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks);

/// Creases from an angle: edges whose turn is at least `degrees` are hard.
/// \param degrees  minimum turn, above 0
Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees);

}  // namespace kiln
