// Finds hard edges of meshes without normals by the angles between their faces.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/face_edges.h"

namespace kiln {

/// Edges with a smaller angle between the normals of their faces, in degrees, are always smooth.
inline constexpr double kMinCreaseDegrees = 20;

/// Hard edges and planar regions of a mesh.
struct Creases {
  std::vector<bool> hard;       ///< True for each hard edge of FaceEdges
  std::vector<bool> hard_part;  ///< True for each triangle whose part has hard edges
  /// For each triangle of a hard part, the lowest triangle of its planar region; for other triangles, the triangle
  /// itself
  std::vector<std::uint32_t> regions;
  /// Area of each planar region, indexed by its lowest triangle; 0 for single triangles and bent regions
  std::vector<float> region_areas;
  std::uint64_t parts = 0;       ///< Number of connected parts
  std::uint64_t hard_parts = 0;  ///< Number of parts with hard edges
  std::uint64_t split_parts =
      0;  ///< Number of hard parts whose hard edges follow from vertices that the file splits
  double least_degrees = 180;      ///< Smallest angle of a hard edge, degrees
  double most_smooth_degrees = 0;  ///< Largest angle of a smooth edge in hard parts, degrees
};

/// Finds hard edges by the distribution of edge angles, separately for each connected part.
///
/// Triangles that are connected over edges form a part. The angle of an edge is that between the normals of its two
/// faces: 0 on a flat surface. In scans and sculptures, all angles occur, large ones less often. Hard surfaces have
/// planes, rounded edges with small equal angles, and sharp edges: a gap separates the angles of sharp edges from all
/// others. The rule searches for this gap in a histogram of a part's angles. The weight of an edge is the smaller area
/// of its two triangles, so that needles hardly count. Edges above a gap must have at least 0.02% of the weight. A gap
/// from a (at least 20 degrees, below which edges are smooth) to b holds less than a tenth of the weight above it. The
/// gap with the largest ratio b / a is used if the ratio is at least 1.5. The histogram always includes a virtual edge
/// of 90 degrees. If all angles are equal, the edges are therefore facets of a round shape below sqrt(20 * 90) = 42
/// degrees, and hard edges above. Hard edges must also form lines: at both ends of 80% of them, another hard edge or a
/// border continues the line. Edges of noise, in contrast, end abruptly.
///
/// A part without a gap has hard edges, too, if a quarter of its edges lie within exact planes. The threshold is then
/// the minimum of the histogram between 25 and 50 degrees, provided that 90% of the edges above it form lines. A part
/// whose vertices lie on a lattice with steps of its own edge length is a surface of labelled voxels (with angles of
/// 35, 45 and 55 degrees), and is smooth.
///
/// If triangles of a part share vertices along some edges and have separate ones along others, the file itself marks
/// hard edges. Split edges are hard if their median angle is at least 25 degrees and at least twice the 90% quantile of
/// the other edges, or if their 10% quantile is at least 5 degrees and at least twice that quantile. Splits at UV seams
/// have the same angles as other edges, and are not used. If no vertices are shared, as in STL, the file contains no
/// such information.
///
/// Finally, edges between planes of hard parts are corrected one at a time. An edge of 42 to 46 degrees belongs to a
/// round shape if four equal planes in a row have equal angles (a tube of eight sides). An edge of 5 degrees or more is
/// hard if neither of its planes has a similar angle at another edge, as at the ridge of a roof.
Creases find_creases(const Mesh& mesh, const FaceEdges& faces);

/// Creases from smoothing groups as in 3DS and FBX: an edge is smooth if its two faces have at least one group in
/// common.
/// \param masks  for each triangle, one bit per group; 0 if the polygon is flat
Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks);

/// Creases from a threshold: edges with an angle of at least `degrees` are hard.
/// \param degrees  smallest angle of hard edges, above 0
Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees);

}  // namespace kiln
