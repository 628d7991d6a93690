// Welds vertices at exactly equal positions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// For each vertex, the lowest vertex at exactly the same position (+0 equals -0). Vertices that are not finite are not
/// welded.
std::vector<std::uint32_t> weld_vertices(std::span<const Vec3> positions);

/// A mesh's triangles with welded corners.
std::vector<Triangle> welded_triangles(const Mesh& mesh);

}  // namespace kiln
