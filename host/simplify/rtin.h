// A grid of heights brought near a number of triangles fast.
#pragma once

#include <cstddef>

#include "simplify/simplify_input.h"

namespace kiln {

/// Replaces a height field that is a full grid, of two triangles for each cell, by right triangles. They are
/// small where the heights need that (Evans, Kirkpatrick and Townsend 2001, "Right-Triangulated Irregular Networks"). All face up,
/// the rectangle stays. Linear in the number of cells. Rows and columns may be unevenly spaced.
/// \param work   in, out; heights along z
/// \param faces  how many triangles to leave, about
/// \param error  more are left where heights would else be off by more than about this
/// \returns whether it is such a grid; else nothing is done
bool simplify_to_rtin(Work& work, std::size_t faces, double error);

}  // namespace kiln
