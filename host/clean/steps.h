// The steps of clean_mesh(), one per source file.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/clean.h"

namespace kiln {

/// Welds vertices of open edges to others that are within a distance. The distance is at most a quarter of the shortest
/// edge at either vertex.
Cleaned weld_near(Mesh& mesh, double distance);

/// Repairs T-junctions: splits triangles with open edges at those vertices of other open edges that lie on them, within
/// a distance.
Cleaned cut_at_junctions(Mesh& mesh, double distance);

/// Finds fins below a size: parts with open edges that are attached to edges of two other triangles.
/// \returns for each triangle, 1 if it belongs to a fin; empty if there are no fins
std::vector<std::uint8_t> find_fins(const Mesh& mesh, double size, Cleaned& fins);

/// Reverses triangles so that views from outside show the fronts of parts. Sets CleanReport::turned, `inward` and
/// `faces_outwards`.
/// \param open_alone  true: parts that are closed and consistently oriented are not changed
void turn_outward(Mesh& mesh, bool open_alone, CleanReport& report);

/// Fills holes of few edges whose perimeter is at most `perimeter`.
Cleaned fill_small_holes(Mesh& mesh, double perimeter);

/// Holes that fill_large_holes() found.
struct LargeHoles {
  Cleaned filled;          ///< Holes that were filled
  std::uint64_t flat = 0;  ///< Filled holes whose patch is flat and meets the surface at an angle
  double largest = 0;      ///< Diagonal of the largest hole that was filled
  /// Holes that were not filled although their rims are closed, because they are too large or
  /// outlines of sheets
  Cleaned open;
  Cleaned open_edges;  ///< Edges that still have a single triangle after the repairs
};

/// Fills holes with any number of edges, if the bounding box of the rim has at most the given diagonal (infinity: all).
/// See make_hole_patch(). Patches get the colours, UVs, groups and materials of the nearest corners of the rim; colours
/// are interpolated smoothly. If a patch triangle spans a part of the rim within one chart, it has the UVs there. All
/// other triangles have a single UV, so that they show a colour of the rim. The outline of a sheet is no hole: the
/// faces around it enclose more than 120 degrees with the patch. With infinity, only outlines of flat sheets are left
/// open. Existing vertices and triangles stay.
LargeHoles fill_large_holes(Mesh& mesh, double diagonal);

/// Finds bodies whose diagonal is below a share of the largest body's diagonal.
/// \returns for each triangle, 1 if it belongs to a floater; empty if there are no floaters
std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters);

/// Finds parts that no view from outside shows.
/// \returns for each triangle, 1 if it belongs to such a part; empty if there are none
std::vector<std::uint8_t> find_inner_parts(const Mesh& mesh, Cleaned& inner);

}  // namespace kiln
