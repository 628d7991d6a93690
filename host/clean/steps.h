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

/// Finds bodies whose diagonal is below a share of the largest body's.
/// \returns for each triangle, 1 if it is part of a floater; empty: no floaters
std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters);

/// Finds parts that no view from outside shows.
/// \returns for each triangle, 1 if it belongs to such a part; empty: no such parts
std::vector<std::uint8_t> find_inner(const Mesh& mesh, Cleaned& inner);

}  // namespace kiln
