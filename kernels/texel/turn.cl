// Directions that stand on the low poly's faces, and meet at its hard edges.
//
// Purpose: rays along averaged normals lean over whole faces of a box, and details on it come out skewed;
// rays along the faces' own normals leave gaps at edges. Between them: with s the distance to the nearest
// hard edge over the width, c = 1 - 3 s^2 + 2 s^3 (0 for s > 1) of the averaged direction, 1 - c of the
// mesh's own normal. Each edge has a width of its own, and the least s counts. Distances are taken in space,
// so the field is continuous wherever both normals are; and at hard edges, where its own normal is not, it is
// the averaged one from both sides. Painted meshes say c themselves: 1 less their weight.
//
// | kernel           | one work-item | traffic                                     |
// | kiln_texel_turn  | sample        | 32 B + 36 B a triangle + 28 B an edge near it |
// | kiln_texel_reach | sample        | 32 B + 24 B a triangle                        |
//
// Local size 64. No defines. Limits: edges near a triangle are gone through one by one.
#include "lib/shell.clh"
#include "shared/common.h"

/// Turns the samples' directions, planes 3 to 5 of `points`.
kernel void kiln_texel_turn(const uint count,
                            const uint capacity,
                            const uint painted,                      // 0 or 1
                            global const float* restrict normals,    // 9 a triangle
                            global const float* restrict weights,    // 3 a triangle, where painted
                            global const uint* restrict first_edges, // per triangle, and the end
                            global const float* restrict edges,      // 7 each: a corner, the way to the other, the width
                            global const uint* restrict triangle,
                            global const float* restrict barycentric,
                            global float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const size_t plane = capacity;
  const size_t t = triangle[i];
  const float u = barycentric[i];
  const float v = barycentric[plane + i];
  const float w = 1.0f - u - v;
  float p[3], own[3];
  float squared = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] = points[axis * plane + i];
    own[axis] = fma(v, normals[9 * t + 6 + axis],
                    fma(u, normals[9 * t + 3 + axis], w * normals[9 * t + axis]));
    squared = fma(own[axis], own[axis], squared);
  }
  if (!(squared > 1e-12f)) return;

  float s = 1.0f;
  for (uint e = first_edges[t]; e < first_edges[t + 1]; ++e) {
    global const float* edge = edges + 7 * (size_t)e;
    float along = 0.0f;
    float size = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
      along = fma(p[axis] - edge[axis], edge[3 + axis], along);
      size = fma(edge[3 + axis], edge[3 + axis], size);
    }
    const float at = min(max(along / size, 0.0f), 1.0f);
    float distance = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
      const float off = p[axis] - fma(at, edge[3 + axis], edge[axis]);
      distance = fma(off, off, distance);
    }
    s = min(s, sqrt(distance) / edge[6]);
  }
  float averaged = max(0.0f, 1.0f - s * s * (3.0f - 2.0f * s));
  if (painted != 0) {
    averaged = 1.0f - fma(v, weights[3 * t + 2], fma(u, weights[3 * t + 1], w * weights[3 * t]));
  }
  const float scale = (1.0f - averaged) / sqrt(squared);
  float d[3];
  float length = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    d[axis] = fma(averaged, points[(3 + axis) * plane + i], scale * own[axis]);
    length = fma(d[axis], d[axis], length);
  }
  if (!(length > 1e-12f)) return;
  length = sqrt(length);
  for (int axis = 0; axis < 3; ++axis) points[(3 + axis) * plane + i] = d[axis] / length;
}

/// Writes the samples' reach, plane 6 of `points`: where their rays meet a shell. It lies as far off each
/// triangle as its corners say, interpolated.
kernel void kiln_texel_reach(const uint count,
                             const uint capacity,
                             global const float* restrict shell,  // 6 a triangle: unit normal, heights
                             global const uint* restrict triangle,
                             global const float* restrict barycentric,
                             global float* restrict points) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  points[6 * (size_t)capacity + i] =
      shell_distance(shell + 6 * (size_t)triangle[i], i, capacity, barycentric, points);
}
