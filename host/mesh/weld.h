// Vertices at exactly the same position made one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// For every vertex the lowest-numbered vertex at exactly the same position (+0 equals -0). Vertices
/// that are not finite stand for themselves.
std::vector<std::uint32_t> weld_vertices(std::span<const Vec3> positions);

/// A mesh's triangles, with these for corners.
std::vector<Triangle> welded_triangles(const Mesh& mesh);

}  // namespace kiln
