// The steps of clean_mesh(), one file each.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/clean.h"

namespace kiln {

/// Welds vertices of open edges to others within a distance, at most a quarter of the shortest edge at either vertex.
Cleaned weld_near(Mesh& mesh, double distance);

/// Splits triangles with open edges at vertices of adjacent open edges that lie on them within a distance
/// (T-junctions).
Cleaned cut_at_junctions(Mesh& mesh, double distance);

/// Finds fins below a size: parts with open edges that are attached to edges of two other triangles.
/// \returns for each triangle, 1 if it is part of a fin; empty: no fins
std::vector<std::uint8_t> find_fins(const Mesh& mesh, double size, Cleaned& fins);

/// Reverses triangles so that views from outside show the fronts of parts. Sets CleanReport::turned, `inward` and
/// `faces_outwards`.
/// \param open_alone  true: parts that are closed and consistently oriented are not changed
void turn_outward(Mesh& mesh, bool open_alone, CleanReport& report);

/// Fills holes of few edges up to a perimeter.
Cleaned fill_small_holes(Mesh& mesh, double perimeter);

/// Holes that fill_large_holes() found.
struct LargeHoles {
  Cleaned filled;          ///< Holes that were filled
  std::uint64_t flat = 0;  ///< Filled holes whose patch meets the surface at an angle
  double largest = 0;      ///< Diagonal of the largest hole that was filled
  Cleaned open;            ///< Closed rims that were left open: too large, or outlines of sheets
  Cleaned open_edges;      ///< Edges of one triangle that remain in the mesh
};

/// Fills holes of any number of edges whose rim's bounding box has at most a diagonal; infinity: all. See
/// make_hole_patch(). Patches get the colours, UVs, groups and materials of the nearest corners of the rim; colours
/// are interpolated smoothly. A triangle that spans a part of the rim within one chart has the UVs there; others have
/// one UV, so that they show a colour of the rim. Outlines of sheets (faces around lie at more than 120 degrees to the
/// patch) are no holes; with infinity, outlines of flat sheets are none. Existing vertices and triangles stay.
LargeHoles fill_large_holes(Mesh& mesh, double diagonal);

/// Finds bodies whose diagonal is below a share of the largest body's.
/// \returns for each triangle, 1 if it is part of a floater; empty: no floaters
std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters);

/// Finds parts that no view from outside shows.
/// \returns for each triangle, 1 if it belongs to such a part; empty: no such parts
std::vector<std::uint8_t> find_inner(const Mesh& mesh, Cleaned& inner);

}  // namespace kiln
