// Charts: the connected pieces of a mesh's UV layout.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// The chart of every triangle, numbered from 0 in the order of their first triangles.
///
/// Two triangles are of one chart where a chain of shared edges connects them. An edge is shared
/// where both its ends have the same position and the same UV, by value. So meshes with split
/// vertices (along hard edges, say) come out like welded ones. Charts that lie edge to edge in the
/// layout alone stay apart. Triangles that touch in a corner only are not connected. Corners that
/// are not finite are the same only where their indices are.
///
/// Deterministic. About 0.5 s for a million triangles.
/// \param mesh  with UVs; indices in range
std::vector<std::uint32_t> uv_charts(const Mesh& mesh);

/// The sum of the areas of UV triangles, where the unit square's is 1. Those that are not finite do not count.
double uv_area(const Mesh& mesh);

}  // namespace kiln
