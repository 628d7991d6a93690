// The steps of clean_mesh(), each in a file of its own.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/clean.h"

namespace kiln {

/// Moves vertices of open edges to those within a distance, never farther than a quarter of the shortest edge at both.
Cleaned weld_near(Mesh& mesh, double distance);

/// Cuts triangles whose open edges run along open edges of others, whose ends lie on them within a distance.
Cleaned cut_at_junctions(Mesh& mesh, double distance);

/// Finds fins below a size: parts with open edges that hang on edges which two other triangles share. \returns which
/// triangles are of such; empty: none
std::vector<std::uint8_t> find_fins(const Mesh& mesh, double size, Cleaned& fins);

/// Turns triangles so that parts face where views from outside see them: sets CleanReport::turned, `inward` and
/// `faces_outwards`.
/// \param open_alone  parts that agree and are closed stay
void turn_outward(Mesh& mesh, bool open_alone, CleanReport& report);

/// Fills holes of few edges up to a perimeter.
Cleaned fill_small_holes(Mesh& mesh, double perimeter);

/// Finds bodies with a diagonal below a share of the largest one's. \returns which triangles are of such; empty: none
std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters);

/// Finds parts of which views from outside see nothing. \returns which triangles are of such; empty: none
std::vector<std::uint8_t> find_inner(const Mesh& mesh, Cleaned& inner);

}  // namespace kiln
