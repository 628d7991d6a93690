// UVs of a mesh whose layout simplify() keeps.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// The mesh with UVs where single corners have none, or one that is not finite. They get the UV that their chart has
/// there, or else the mean of their triangles' others. Triangles without any stay so.
/// Nothing where there are none such.
/// \param warnings  where to count the triangles
std::optional<Mesh> with_finite_uvs(const Mesh& mesh, std::vector<Warning>& warnings);

/// Triangles with finite UVs, of which one lies out of the unit square.
std::uint64_t count_outside(const Mesh& mesh);

/// Largest distance of a low poly's UVs from the high poly's UV triangles; 0 if either has none that are
/// finite.
double uvs_stray(const Mesh& low, const Mesh& high);

}  // namespace kiln
