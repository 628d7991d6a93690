// Double-precision vectors for geometry on the host: GLM's types. Their sums and products round as if each operation
// were written out.
#pragma once

#include <cmath>
#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include "kiln/types.h"

namespace kiln {

/// A variable that is declared without braces is not initialized, so write `Vec3d sum{};` (lint/vectors). dot(),
/// cross() and length() are GLM's.
using Vec3d = glm::dvec3;

inline Vec3d to_double(const Vec3& v) { return {v.x, v.y, v.z}; }
inline const Vec3d& to_double(const Vec3d& v) { return v; }
inline Vec3 to_float(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
inline float component(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
inline bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace kiln
