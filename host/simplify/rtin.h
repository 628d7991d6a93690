// Fast simplification of a grid of heights.
#pragma once

#include <cstddef>

#include "simplify/simplify_input.h"

namespace kiln {

/// Replaces a height field that is a complete grid, with two triangles per cell, by right triangles whose size adapts
/// to the heights (Evans, Kirkpatrick and Townsend 2001, "Right-Triangulated Irregular Networks"). All triangles face
/// up, and the outline stays a rectangle. The time is linear in the number of cells. Rows and columns may be spaced
/// unevenly.
/// \param work   [in, out] heights along z
/// \param faces  approximate number of triangles
/// \param error  approximate largest error of heights; if this error requires more than `faces` triangles, more are
///   kept
/// \returns false if the mesh is not such a grid; it is then unchanged
bool simplify_to_rtin(Work& work, std::size_t faces, double error);

}  // namespace kiln
