// UVs of meshes whose layout simplify() keeps.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Returns the mesh with UVs for corners that have no finite UV in triangles that have some. Such a corner gets the
/// UV that its chart has at that vertex, or the mean of its triangles' finite UVs. Triangles without any finite UV
/// are unchanged. Returns nullopt if there are no such corners.
/// \param warnings  receives a warning with the number of triangles
std::optional<Mesh> with_finite_uvs(const Mesh& mesh, std::vector<Warning>& warnings);

/// Number of triangles with finite UVs of which at least one lies outside of the unit square.
std::uint64_t count_outside(const Mesh& mesh);

/// Largest distance of a low poly's UVs from the high poly's UV triangles; 0 if either has no finite UVs.
double uv_deviation(const Mesh& low, const Mesh& high);

}  // namespace kiln
