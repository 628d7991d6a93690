// Double-precision points of the plane, such as texture coordinates: GLM's types.
#pragma once

#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>

namespace kiln {

/// Like a Vec3d, a variable that is declared without braces is not initialized. The dot product is glm::dot().
using Vec2d = glm::dvec2;

inline double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }

}  // namespace kiln
