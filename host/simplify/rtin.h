// Fast reduction of a grid of heights.
#pragma once

#include <cstddef>

#include "simplify/simplify_input.h"

namespace kiln {

/// Replaces a height field that is a full grid, two triangles per cell, by right triangles whose size adapts to the
/// heights (Evans, Kirkpatrick and Townsend 2001, "Right-Triangulated Irregular Networks"). All face up, and the
/// rectangle is kept. The time is linear in the number of cells. Rows and columns may be unevenly spaced.
/// \param work   [in, out] heights along z
/// \param faces  approximate number of triangles
/// \param error  approximate largest error of heights; more than `faces` triangles are kept if this error requires
///        them
/// \returns false if the mesh is not such a grid; it is then unchanged
bool simplify_to_rtin(Work& work, std::size_t faces, double error);

}  // namespace kiln
