// Volumes: signs of voxels, crossings of edges with their normals, vertices of the finest contour.
//
// Algorithm: dual contouring (Ju, Losasso, Schaefer, Warren 2002, "Dual Contouring of Hermite Data",
// sections 2 and 3). A crossing lies where linear interpolation along an edge meets the iso value; its
// normal is the gradient by central differences (one-sided at the volume's border), interpolated linearly
// between the edge's ends. A vertex minimises E(x) = sum (n . (x - p))^2 over its sheet's crossings, from
// their mean along the eigenvectors of A = sum n n' with eigenvalues above a share of the largest
// (Lindstrom 2000, "Out-of-Core Simplification of Large Polygonal Models", section 3.3), clamped to
// the cell. Eigenvectors come from four cyclic Jacobi sweeps (Golub and Van Loan, section 8.5).
//
// | kernel                | items            | local | traffic an item                               |
// | --------------------- | ---------------- | ----- | --------------------------------------------- |
// | kiln_volume_signs     | words of a slab  | 64    | 64 voxels read, 8 B written                   |
// | kiln_volume_crossings | crossed edges    | 64    | 8 B and 12 voxels (gathered) read, 16 B written |
// | kiln_volume_vertices  | vertices         | 64    | 8 B and 3 to 12 words and crossings (gathered) |
// |                       |                  |       | read, 80 B written                            |
//
// Defines: KILN_VOXEL=uchar, char, ushort, short or float (default): the voxels' type. Others come as
// floats.
// Strengths: work but for the signs grows with the surface only. Limits: 65,535 cells along an axis; a
// slab of voxels must fit a buffer.
#include "lib/vector3.clh"
#include "shared/volume.h"

#ifndef KILN_VOXEL
#define KILN_VOXEL float
#endif

/// Index of a padded row's first word.
static size_t volume_row(const kiln_volume_grid* grid, uint y, uint z) {
  return ((size_t)z * (grid->size[1] + 2u) + y) * grid->words;
}

/// 1 for voxels inside the solid. What is not finite is outside.
static int volume_is_inside(const kiln_volume_grid* grid, float value) {
  return grid->below != 0 ? (value < grid->iso && value >= -FLT_MAX)
                          : (value >= grid->iso && value <= FLT_MAX);
}

/// One bit a padded voxel of a slab.
/// voxels: the slab. inside: [padded slab, row, word], the slab's first voxel plane first, without pads
/// along z.
kernel void kiln_volume_signs(const kiln_volume_grid grid, global const KILN_VOXEL* restrict voxels,
                              global ulong* restrict inside) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t item = get_global_id(0);
  if (item >= grid.count) return;
  const uint word = (uint)(item % grid.words);
  const size_t row = item / grid.words;
  const uint y = (uint)(row % grid.size[1]);
  const uint z = (uint)(row / grid.size[1]);
  global const KILN_VOXEL* line = voxels + row * grid.size[0];
  const int first = (int)(word * 64u) - 1;  // voxel of bit 0
  const int last = (int)grid.size[0];
  ulong bits = 0;
  for (int group = 0; group < 64; group += 8) {
    const int x = first + group;
    if (x >= 0 && x + 8 <= last) {
      const float8 value = convert_float8(vload8(0, line + x));
      const int8 within = grid.below != 0 ? (value < grid.iso) & (value >= -FLT_MAX)
                                          : (value >= grid.iso) & (value <= FLT_MAX);
      const int8 bit = within & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
      const int4 half4 = bit.lo | bit.hi;
      const int2 quarter = half4.lo | half4.hi;
      bits |= (ulong)(uint)(quarter.x | quarter.y) << group;
    } else {
      for (int k = 0; k < 8; ++k) {
        if (x + k < 0 || x + k >= last) continue;
        if (volume_is_inside(&grid, (float)line[x + k])) bits |= 1ul << (group + k);
      }
    }
  }
  inside[((size_t)z * (grid.size[1] + 2u) + y + 1u) * grid.words + word] = bits;
}

/// A voxel's value by its place in the volume.
static float volume_fetch(const kiln_volume_grid* grid, global const KILN_VOXEL* voxels, int x,
                          int y, int z) {
  const float value =
      (float)voxels[((size_t)(z - (int)grid->first_z) * grid->size[1] + (size_t)y) * grid->size[0] +
                    (size_t)x];
  return fabs(value) <= FLT_MAX ? value : grid->outside;
}

/// The field's derivative along one axis by central differences; one-sided at the border.
static float volume_slope(const kiln_volume_grid* grid, global const KILN_VOXEL* voxels, int3 at,
                          int3 step, int place, int end) {
#pragma OPENCL FP_CONTRACT OFF
  const int3 a = place > 0 ? at - step : at;
  const int3 b = place + 1 < end ? at + step : at;
  const float difference =
      volume_fetch(grid, voxels, b.x, b.y, b.z) - volume_fetch(grid, voxels, a.x, a.y, a.z);
  return place > 0 && place + 1 < end ? difference * 0.5f : difference;
}

static float3 volume_gradient(const kiln_volume_grid* grid, global const KILN_VOXEL* voxels,
                              int3 at) {
  return (float3)(volume_slope(grid, voxels, at, (int3)(1, 0, 0), at.x, (int)grid->size[0]),
                  volume_slope(grid, voxels, at, (int3)(0, 1, 0), at.y, (int)grid->size[1]),
                  volume_slope(grid, voxels, at, (int3)(0, 0, 1), at.z, (int)grid->size[2]));
}

/// Unit vector along v; `fallback` where v has no direction.
static float3 volume_unit(float3 v, float3 fallback) {
#pragma OPENCL FP_CONTRACT OFF
  const float largest = max(fabs(v.x), max(fabs(v.y), fabs(v.z)));
  if (!(largest > 0.0f && largest <= FLT_MAX)) return fallback;
  const float3 scaled = v / largest;
  return scaled / sqrt(dot3(scaled, scaled));
}

/// Crossings of edges. edges: x, y, z of the padded voxel that each leaves, 16 bits each from the
/// lowest, then the axis.
kernel void kiln_volume_crossings(const kiln_volume_grid grid,
                                  global const KILN_VOXEL* restrict voxels,
                                  global const ulong* restrict edges,
                                  global kiln_volume_crossing* restrict crossings) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= grid.count) return;
  const ulong key = edges[item];
  const int axis = (int)(key >> 48);
  const int3 a =
      (int3)((int)(key & 0xFFFFul), (int)(key >> 16 & 0xFFFFul), (int)(key >> 32 & 0xFFFFul)) - 1;
  const int3 step = (int3)(axis == 0, axis == 1, axis == 2);
  const int3 b = a + step;
  const int along = axis == 0 ? a.x : axis == 1 ? a.y : a.z;
  const float3 direction = convert_float3(step);
  float t;
  float3 normal;
  if (along < 0) {  // a lies before the volume: the solid is cut off at b
    t = 1.0f;
    normal = -direction;
  } else if (along + 1 >= (int)grid.size[axis]) {
    t = 0.0f;
    normal = direction;
  } else {
    const float fa = volume_fetch(&grid, voxels, a.x, a.y, a.z);
    const float fb = volume_fetch(&grid, voxels, b.x, b.y, b.z);
    // Halved, so that nothing overflows.
    const float rise = fb * 0.5f - fa * 0.5f;
    t = clamp((grid.iso * 0.5f - fa * 0.5f) / rise, 0.0f, 1.0f);
    if (!(t >= 0.0f)) t = 0.5f;
    const float3 at_a = volume_gradient(&grid, voxels, a);
    const float3 at_b = volume_gradient(&grid, voxels, b);
    const float3 gradient = at_a + (at_b - at_a) * t;
    const float outward = grid.below != 0 ? 1.0f : -1.0f;
    // Where the field is flat around the edge, along the edge.
    normal = volume_unit(gradient * outward, rise * outward < 0.0f ? -direction : direction);
  }
  crossings[item].t = t;
  crossings[item].normal[0] = normal.x;
  crossings[item].normal[1] = normal.y;
  crossings[item].normal[2] = normal.z;
}

/// One Jacobi rotation that zeroes a[p][q] of a symmetric matrix; r is the third index. The columns of
/// the eigenvectors turn with it.
static void volume_rotate(float* app, float* aqq, float* apq, float* arp, float* arq, float3* vp,
                          float3* vq) {
#pragma OPENCL FP_CONTRACT OFF
  const float off = *apq;
  const float difference = *aqq - *app;
  // tan of the angle: the smaller root of t^2 + 2 theta t - 1 = 0, theta = difference / (2 off).
  const float scale = fabs(difference) + sqrt(difference * difference + 4.0f * off * off);
  const float tangent =
      scale > 0.0f ? (difference < 0.0f ? -2.0f * off : 2.0f * off) / scale : 0.0f;
  const float cosine = 1.0f / sqrt(tangent * tangent + 1.0f);
  const float sine = tangent * cosine;
  *app -= tangent * off;
  *aqq += tangent * off;
  *apq = 0.0f;
  const float rp = *arp;
  const float rq = *arq;
  *arp = cosine * rp - sine * rq;
  *arq = sine * rp + cosine * rq;
  const float3 p = *vp;
  const float3 q = *vq;
  *vp = p * cosine - q * sine;
  *vq = p * sine + q * cosine;
}

/// The part of the correction along one eigenvector.
static float3 volume_along(float3 axis, float value, float limit, float3 residual) {
#pragma OPENCL FP_CONTRACT OFF
  return value > limit ? axis * (dot3(axis, residual) / value) : (float3)(0.0f);
}

/// Where E is least, from `middle` on.
static float3 volume_solve(const float a[6], float3 b, float3 middle) {
#pragma OPENCL FP_CONTRACT OFF
  float xx = a[0], xy = a[1], xz = a[2], yy = a[3], yz = a[4], zz = a[5];
  const float3 residual =
      b - (float3)(dot3((float3)(xx, xy, xz), middle), dot3((float3)(xy, yy, yz), middle),
                   dot3((float3)(xz, yz, zz), middle));
  float3 vx = (float3)(1.0f, 0.0f, 0.0f);
  float3 vy = (float3)(0.0f, 1.0f, 0.0f);
  float3 vz = (float3)(0.0f, 0.0f, 1.0f);
  for (int sweep = 0; sweep < 4; ++sweep) {
    volume_rotate(&xx, &yy, &xy, &xz, &yz, &vx, &vy);
    volume_rotate(&xx, &zz, &xz, &xy, &yz, &vx, &vz);
    volume_rotate(&yy, &zz, &yz, &xy, &xz, &vy, &vz);
  }
  const float limit = KILN_VOLUME_EIGEN_LIMIT * max(xx, max(yy, zz));
  return middle + volume_along(vx, xx, limit, residual) + volume_along(vy, yy, limit, residual) +
         volume_along(vz, zz, limit, residual);
}

/// Vertices from their keys (shared/volume.h). words and crossings: of all the volume.
kernel void kiln_volume_vertices(const kiln_volume_grid grid, global const ulong* restrict keys,
                                 global const kiln_volume_word* restrict words,
                                 global const kiln_volume_crossing* restrict crossings,
                                 global kiln_volume_qef* restrict qefs,
                                 global kiln_volume_vertex* restrict vertices) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= grid.count) return;
  const ulong key = keys[item];
  const uint cell[3] = {(uint)(key & 0xFFFFul), (uint)(key >> 16 & 0xFFFFul),
                        (uint)(key >> 32 & 0xFFFFul)};
  const uint mask = (uint)(key >> 48);
  float a[6] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
  float3 b = (float3)(0.0f);
  float3 mass = (float3)(0.0f);
  float3 mean = (float3)(0.0f);
  float c = 0.0f;
  float count = 0.0f;
  for (uint rest = mask; rest != 0u; rest &= rest - 1u) {
    const uint edge = 31u - clz(rest & (0u - rest));
    const uint axis = edge >> 2;
    const uint u = edge & 1u;
    const uint v = edge >> 1 & 1u;
    // Offsets of the edge's lower end from the cell's lowest corner.
    const uint dx = axis == 1u ? v : axis == 2u ? u : 0u;
    const uint dy = axis == 2u ? v : axis == 0u ? u : 0u;
    const uint dz = axis == 0u ? v : axis == 1u ? u : 0u;
    const uint x = cell[0] + dx;
    global const kiln_volume_word* word =
        words + volume_row(&grid, cell[1] + dy, cell[2] + dz) + (x >> 6);
    const ulong before = (1ul << (x & 63u)) - 1ul;
    ulong rank = popcount(word->edge[axis] & before);
    if (axis > 0u) rank += popcount(word->edge[0]);
    if (axis > 1u) rank += popcount(word->edge[1]);
    global const kiln_volume_crossing* crossing = crossings + word->edge_base + (uint)rank;
    const float t = crossing->t;
    const float3 n = vload3(0, crossing->normal);
    const float3 p = (float3)(axis == 0u ? t : (float)dx, axis == 1u ? t : (float)dy,
                              axis == 2u ? t : (float)dz);
    const float d = dot3(n, p);
    a[0] += n.x * n.x;
    a[1] += n.x * n.y;
    a[2] += n.x * n.z;
    a[3] += n.y * n.y;
    a[4] += n.y * n.z;
    a[5] += n.z * n.z;
    b += n * d;
    c += d * d;
    mass += p;
    mean += n;
    count += 1.0f;
  }
  const float3 place = clamp(volume_solve(a, b, mass / count), 0.0f, 1.0f);

  for (int k = 0; k < 6; ++k) qefs[item].a[k] = a[k];
  vstore3(b, 0, qefs[item].b);
  qefs[item].c = c;
  vstore3(mass, 0, qefs[item].mass);
  qefs[item].count = count;

  const float3 voxel =
      (float3)((float)cell[0] - 1.0f, (float)cell[1] - 1.0f, (float)cell[2] - 1.0f);
  const float3 at = voxel + place;
  const float3 world = vload3(0, grid.to_world) * at.x + vload3(1, grid.to_world) * at.y +
                       vload3(2, grid.to_world) * at.z;
  // Crossings that cancel each other out: the cell's own first direction.
  const float3 normal = volume_unit(mean, (float3)(0.0f, 0.0f, 1.0f));
  const float3 turned = volume_unit((float3)(dot3(vload3(0, grid.normal_to_world), normal),
                                             dot3(vload3(1, grid.normal_to_world), normal),
                                             dot3(vload3(2, grid.normal_to_world), normal)),
                                    normal);
  vstore3(world, 0, vertices[item].position);
  vstore3(turned, 0, vertices[item].normal);
}
