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
/// \returns by triangle, 1 on a fin; empty: none
std::vector<std::uint8_t> find_fins(const Mesh& mesh, double size, Cleaned& fins);

/// Turns triangles so that parts face where views from outside see them: sets CleanReport::turned, `inward` and
/// `faces_outwards`.
/// \param open_alone  parts that agree and are closed stay
void turn_outward(Mesh& mesh, bool open_alone, CleanReport& report);

/// Fills holes of few edges up to a perimeter.
Cleaned fill_small_holes(Mesh& mesh, double perimeter);

/// Finds bodies whose diagonal is below a share of the largest body's.
/// \returns by triangle, 1 on a floater; empty: none
std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters);

/// Finds parts that no view from outside shows.
/// \returns by triangle, 1 on such a part; empty: none
std::vector<std::uint8_t> find_inner(const Mesh& mesh, Cleaned& inner);

}  // namespace kiln
