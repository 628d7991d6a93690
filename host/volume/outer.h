// The outside that can be reached from the volume's border.
#pragma once

#include <cstdint>
#include <string>

#include "volume/cell_grid.h"

namespace kiln {

/// Makes outside voxels that cannot be reached count as inside: ContourOptions::outer_only says what is
/// reached. Before CellGrid::build().
///
/// Rows are cut into runs of outside voxels, and runs that touch (6 neighbours) are joined by
/// union-find, planes in parallel; the same partition whatever the order (Rosenfeld and Pfaltz 1966,
/// "Sequential Operations in Digital Picture Processing"; runs after He, Chao, Suzuki 2008, "A Run-Based
/// Two-Scan Labeling Algorithm"). Gaps are closed to the search by moving a cube instead of a voxel: the
/// solid is dilated by the cube first, and what is found dilated back.
/// \param name  of the volume, for messages. \throws Error(internal) where memory is short, Error(input) where
///              there are too many runs to be counted in 32 bits
std::uint64_t fill_unreached(CellGrid& cells, std::uint32_t gap, const std::string& name);

}  // namespace kiln
