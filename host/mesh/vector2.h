// Double-precision points of the plane, such as texture coordinates: GLM's types.
#pragma once

#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>

namespace kiln {

/// A variable that is declared without braces is not initialized, as with Vec3d. dot() is GLM's.
using Vec2d = glm::dvec2;

inline double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }

}  // namespace kiln
