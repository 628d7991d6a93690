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
  std::vector<bool> hard;       ///< Per edge of FaceEdges: it is hard
  std::vector<bool> hard_part;  ///< Per triangle: its part has hard edges
  /// Per triangle of a hard part, the lowest triangle of its planar region; else itself
  std::vector<std::uint32_t> regions;
  /// By these lowest triangles: area of planar regions; 0: a single triangle, or bent
  std::vector<float> region_areas;
  std::uint64_t parts = 0;         ///< Number of connected parts
  std::uint64_t hard_parts = 0;    ///< Number of parts with hard edges
  std::uint64_t split_parts = 0;   ///< Hard parts whose hard edges follow from split vertices
  double least_degrees = 180;      ///< Smallest turn of a hard edge
  double most_smooth_degrees = 0;  ///< Largest turn of a smooth edge of hard parts
};

/// Finds hard edges by the distribution of turns, separately for each connected part.
///
/// Edges connect triangles to parts. The turn of an edge is the angle between its faces' normals. Scans and
/// sculptures have all turns, large ones less often. Hard surfaces have planes, rounded edges with small equal turns,
/// and sharp edges: a gap separates the latter from the others. The rule searches the gap in a histogram of a part's
/// turns. Edges weigh by the smaller area of their two triangles, so that needles do not count; edges above a gap
/// need at least 0.02% of the weight. A gap from a (at least 20 degrees, below which edges are smooth) to b holds
/// less than a tenth of the weight above it. The gap with the largest ratio b / a is used if the ratio is at least
/// 1.5. The histogram always includes a virtual edge of 90 degrees: if all turns are equal, they are facets of a
/// round below sqrt(20 * 90) = 42 degrees, and edges above. Hard edges must also form lines: at both ends of 80% of
/// them, another hard edge or a border continues. Noise, in contrast, has loose ends.
///
/// A part without a gap has hard edges, too, if a quarter of its edges lie within exact planes: the threshold is then
/// the emptiest place of the histogram between 25 and 50 degrees, if 90% of the edges above form lines. A part whose
/// vertices lie on a lattice of its own edge length is a surface of labelled voxels (turns of 35, 45 and 55 degrees),
/// and smooth.
///
/// If a part's triangles share vertices at some places and have separate ones at others, the file itself marks hard
/// edges: split edges are hard if their median turn is 25 degrees and twice the 90% quantile of the other turns, or if
/// the least tenth of them does not turn by less than 5 degrees and twice that quantile.
/// Splits at UV seams have turns like other edges, and mean nothing. If no vertices are shared, as in STL, there is
/// no such information.
///
/// Finally, edges between planes of hard parts are corrected one at a time. Turns of 42 to 46 degrees belong to a
/// round if four equal planes in a row have equal turns (a tube of eight sides). Turns of 5 degrees or more are hard
/// if neither plane has a similar turn at another edge: the ridge of a roof is no round.
Creases find_creases(const Mesh& mesh, const FaceEdges& faces);

/// Creases from smoothing groups as in 3DS and FBX: an edge is smooth if its faces have a group in common.
/// \param masks  per triangle, one bit per group; 0: its polygon is flat
Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks);

/// Creases from an angle: edges that turn by at least `degrees` are hard.
/// \param degrees  above 0
Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees);

}  // namespace kiln
