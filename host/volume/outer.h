// The part of the outside that is reachable from the volume's border.
#pragma once

#include <cstdint>
#include <string>

#include "volume/cell_grid.h"

namespace kiln {

/// Makes unreachable outside voxels count as inside, as defined by ContourOptions::outer_only. To be called before
/// CellGrid::build().
///
/// Rows are divided into runs of outside voxels. Runs that touch (6-neighbourhood) are united by
/// union-find, in parallel over planes; the partition does not depend on the order (Rosenfeld and
/// Pfaltz 1966, "Sequential Operations in Digital Picture Processing"; runs after He, Chao, Suzuki
/// 2008, "A Run-Based Two-Scan Labeling Algorithm"). Gaps are closed by a morphological closing
/// with a cube: the solid is dilated by the cube before the search, and the reached region is
/// dilated by the same cube afterwards.
/// \param name  name of the volume, for messages
/// \returns the number of filled voxels
/// \throws Error(internal) if memory is short, Error(input) if there are too many runs for 32-bit numbers
std::uint64_t fill_unreached(CellGrid& cells, std::uint32_t gap, const std::string& name);

}  // namespace kiln
