// Ray directions: the low poly's shading normals on faces, blended into averaged normals at its hard edges.
//
// Purpose: rays along averaged normals lean over whole faces of a box, and details on it come out skewed;
// rays along the faces' own normals leave gaps at edges. So both are blended: with s the distance to the
// nearest hard edge divided by the edge's width, c = 1 - 3 s^2 + 2 s^3 (0 for s > 1) is the weight of the
// averaged direction, 1 - c that of the shading normal. Each edge has its own width, and the smallest s
// counts. Distances are Euclidean, so the field is continuous wherever both normals are; at hard edges, where
// the shading normal is not, it equals the averaged one from both sides. Painted meshes specify 1 - c
// directly as their weight.
//
// | kernel                      | one work-item | traffic                                       |
// | kiln_texel_blend_directions | sample        | 32 B + 36 B a triangle + 28 B an edge near it |
// | kiln_texel_write_reach      | sample        | 32 B + 24 B a triangle                        |
//
// Local size 64. No defines. Limits: edges near a triangle are tested one by one.
#include "lib/shell.clh"
#include "shared/common.h"

/// Blends the samples' directions, which are planes 3 to 5 of `points`.
kernel void kiln_texel_blend_directions(const uint count,
                                        const uint capacity,
                                        const uint painted,                    // 1: `weights` are used; else 0
                                        // 9 per triangle: a normal for each corner
                                        global const float* restrict normals,
                                        // 3 per triangle, one per corner; only read if painted
                                        global const float* restrict weights,
                                        // index of each triangle's first edge; the extra last entry
                                        // is the number of edges
                                        global const uint* restrict first_edges,
                                        // 7 per edge: its first corner (3), the vector to the second (3), its width
                                        global const float* restrict edges,
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
    float projection = 0.0f;
    float size = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
      projection = fma(p[axis] - edge[axis], edge[3 + axis], projection);
      size = fma(edge[3 + axis], edge[3 + axis], size);
    }
    const float at = min(max(projection / size, 0.0f), 1.0f);
    float distance = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
      const float delta = p[axis] - fma(at, edge[3 + axis], edge[axis]);
      distance = fma(delta, delta, distance);
    }
    s = min(s, sqrt(distance) / edge[6]);
  }
  float averaged_weight = max(0.0f, 1.0f - s * s * (3.0f - 2.0f * s));
  if (painted != 0) {
    averaged_weight = 1.0f - fma(v, weights[3 * t + 2], fma(u, weights[3 * t + 1], w * weights[3 * t]));
  }
  const float scale = (1.0f - averaged_weight) / sqrt(squared);
  float d[3];
  float length = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    d[axis] = fma(averaged_weight, points[(3 + axis) * plane + i], scale * own[axis]);
    length = fma(d[axis], d[axis], length);
  }
  if (!(length > 1e-12f)) return;
  length = sqrt(length);
  for (int axis = 0; axis < 3; ++axis) points[(3 + axis) * plane + i] = d[axis] / length;
}

/// Writes the samples' reach, plane 6 of `points`: the distance at which their rays meet a shell, whose
/// height over a triangle is interpolated from its corners.
kernel void kiln_texel_write_reach(const uint count,
                                   const uint capacity,
                                   // 6 per triangle: unit normal, then the shell's height at each corner
                                   global const float* restrict shell,
                                   global const uint* restrict triangle,
                                   global const float* restrict barycentric,
                                   global float* restrict points) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  points[6 * (size_t)capacity + i] =
      shell_distance(shell + 6 * (size_t)triangle[i], i, capacity, barycentric, points);
}
