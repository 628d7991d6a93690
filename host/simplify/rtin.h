// Fast reduction of a grid of heights.
#pragma once

#include <cstddef>

#include "simplify/simplify_input.h"

namespace kiln {

/// Replaces a height field that is a full grid, two triangles per cell, by right triangles whose size adapts to the
/// heights (Evans, Kirkpatrick and Townsend 2001, "Right-Triangulated Irregular Networks"). All face up, and the
/// rectangle is kept. Linear in the number of cells. Rows and columns may be unevenly spaced.
/// \param work   [in, out] heights along z
/// \param faces  approximate number of triangles
/// \param error  approximate largest error of heights; more triangles are kept if it needs them
/// \returns false if the mesh is no such grid, which is left as it is
bool simplify_to_rtin(Work& work, std::size_t faces, double error);

}  // namespace kiln
