// A very high poly brought near its goal fast.
#pragma once

#include <cstddef>
#include <span>

#include "lowpoly/simplify_input.h"

namespace kiln {

/// Brings a mesh near `faces`, or less near if that would deviate by more than `error`, by
/// meshoptimizer: it places vertices less well than EdgeCollapser but is ten times as fast. Meshes of 250,000 triangles and more go piece by
/// piece, on all threads; the pieces depend on the mesh alone. Nothing is done
/// where it would not help, or where it would turn a triangle of a height field over.
/// \param untouched  where triangles stay as they are
void head_start(Work& work, std::size_t faces, double error, bool height_field,
                std::span<const Place> untouched);

}  // namespace kiln
