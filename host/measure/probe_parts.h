// Encodes and interpolates the normals of probes, which render a low poly with its map.
#pragma once

#include "kiln/types.h"
#include "mesh/low_shading.h"
#include "mesh/vector.h"

namespace kiln {

/// Encodes a direction of any length as n/2 + 1/2.
inline void encode_normal(const Vec3d& normal, float* pixel) {
  const double size = length(normal);
  const Vec3 n = to_float(size > 0 ? normal * (0.5 / size) : normal);
  pixel[0] = n.x + 0.5F;
  pixel[1] = n.y + 0.5F;
  pixel[2] = n.z + 0.5F;
}

template <typename T>
Vec3d interpolate_corners(const T& a, const T& b, const T& c, float u, float v) {
  return to_double(a) * (1.0 - u - v) + to_double(b) * double{u} + to_double(c) * double{v};
}

inline Vec3d vector_at(const kiln_float* values) { return {values[0], values[1], values[2]}; }

}  // namespace kiln
