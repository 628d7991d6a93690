// UVs of meshes for which simplify() keeps the layout.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Returns the mesh with UVs for corners that have no finite UV although other corners of their triangle do. Such a
/// corner gets the UV that its chart has at that vertex, or else the mean of its triangles' finite UVs. Triangles
/// without any finite UV are unchanged. Returns nullopt if there are no such corners.
/// \param warnings  receives a warning with the number of triangles
std::optional<Mesh> with_finite_uvs(const Mesh& mesh, std::vector<Warning>& warnings);

/// Number of triangles with finite UVs that have at least one UV outside of the unit square.
std::uint64_t count_outside(const Mesh& mesh);

/// Largest distance, in UV space, of a low poly's UVs from the high poly's UV triangles; 0 if either mesh has no finite
/// UVs.
double uv_deviation(const Mesh& low, const Mesh& high);

}  // namespace kiln
