// Which edges of a mesh without normals are hard, by how its faces turn.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/face_edges.h"

namespace kiln {

/// What turns less is smooth, degrees, whatever else a part has.
inline constexpr double kLeastCut = 20;

/// What the rule found of one mesh.
struct Creases {
  std::vector<bool> hard;       ///< Per edge of FaceEdges
  std::vector<bool> hard_part;  ///< Per triangle: its part has hard edges
  std::vector<std::uint32_t>
      regions;  ///< Per triangle of a hard part, the lowest of its plane's; else itself
  std::vector<float> region_areas;  ///< By these, of planes alone; 0: of one triangle, or bent
  std::uint64_t parts = 0;          ///< Connected parts
  std::uint64_t hard_parts = 0;     ///< Parts among them with hard edges
  std::uint64_t split_parts = 0;    ///< Parts among these whose split vertices said so
  double least_degrees = 180;       ///< Least turn of a hard edge
  double most_smooth_degrees = 0;   ///< Greatest turn of a smooth edge of these parts
};

/// Finds hard edges by the distribution of turns, part by part.
///
/// Parts are what edges connect. Scans and sculptures turn by all angles, with ever fewer edges of greater ones. Hard
/// surfaces are flats, rounds of small equal turns, and edges: between both kinds of turns there is a gap. The rule
/// looks for it in a histogram of a part's turns, each edge weighted by the lesser area of its two triangles, so that
/// needles count for nothing; what lies above a gap has 0.02% of it at least. A gap runs from a (20 degrees at least:
/// what turns less is smooth) to b, has less than a tenth of the weight that lies above it, and the widest, b / a, is
/// taken where it is at least 1.5. A right angle is always thought to be there: of turns x alone, those below sqrt(20
/// * 90) = 42 are taken for facets of a round, those above for edges. The edges above a gap shall be lines, too: at
/// both ends of four fifths of them, another one or a border goes on. Turns of noise have loose ends.
///
/// A part without such a gap is hard, too, where a quarter of it is planes to the last digit: then edges from the
/// emptiest place of the histogram between 25 and 50 degrees on are hard if nine tenths of them are lines. A part
/// whose vertices lie on a lattice of its own edges' size is the surface of labelled voxels, cut at 35, 45 and 55
/// degrees, and smooth.
///
/// Where a part's triangles share some vertices and have others of their own at one place, the file says which edges
/// are hard: if those that are split turn by 25 degrees at the median and twice as much as others mostly do, they are
/// the hard ones. Splits at seams of UVs turn no more than other edges, and say nothing. Where nothing is shared, as
/// in STL, nothing is said.
///
/// In hard parts single edges are then seen to, where planes meet. Turns of 42 to 46 degrees are a round's where four
/// equal planes in a row turn alike: a tube of eight sides. Turns of 5 degrees or more are hard where neither plane
/// turns alike at another edge: a roof's ridge is no round.
Creases find_creases(const Mesh& mesh, const FaceEdges& faces);

/// The same of smoothing groups as 3DS and FBX have them: an edge is smooth where its faces share one.
/// \param masks  a bit a group, per triangle; 0: its polygon is flat
Creases creases_between(const Mesh& mesh, const FaceEdges& faces,
                        std::span<const std::uint32_t> masks);

/// The same of an angle: edges that turn by this or more are hard. \param degrees  above 0
Creases creases_from(const Mesh& mesh, const FaceEdges& faces, double degrees);

}  // namespace kiln
