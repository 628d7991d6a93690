// Volumes: signs of voxels, crossings of edges with their normals, vertices of the finest contour.
//
// Algorithm: dual contouring (Ju, Losasso, Schaefer, Warren 2002, "Dual Contouring of Hermite Data",
// sections 2 and 3). A crossing lies where linear interpolation along an edge meets the iso value; its
// normal is the gradient by central differences (one-sided at the volume's border and beside creases of
// the field, where second differences show one, after Harten, Engquist, Osher, Chakravarthy 1987,
// "Uniformly High Order Accurate Essentially Non-oscillatory Schemes, III": the smoother stencil),
// interpolated linearly between the edge's ends, unless a crease lies between them. A vertex minimises E(x) = sum (n . (x - p))^2 over its sheet's crossings, from
// their mean along the eigenvectors of A = sum n n' with eigenvalues above a share of the largest
// (Lindstrom 2000, "Out-of-Core Simplification of Large Polygonal Models", section 3.3), clamped to
// the cell.
// Eigenvectors come from four cyclic Jacobi sweeps (Golub and Van Loan, section 8.5).
//
// | kernel                     | items            | local | traffic an item                               |
// |      --------------------- | ---------------- | ----- | --------------------------------------------- |
// | kiln_volume_write_signs    | words of a slab  | 64    | 64 voxels read, 8 B written                   |
// | kiln_volume_find_crossings | crossed edges    | 64    | 8 B and 12 to 32 voxels (gathered) read, 16 B written |
// | kiln_volume_place_vertices | vertices / 8     | 64    | 8 x (8 B and 3 to 12 words and crossings      |
// |                            |                  |       | (gathered) read, 80 B written)                |
//
// Defines: KILN_VOXEL=uchar, char, ushort, short or float (default): the voxels' type. Other types are converted to
// floats.
// Strengths: apart from the signs, work is proportional to the surface. Limits: 65,535 cells along an axis; a slab of
// voxels must fit a buffer.
#include "lib/vector3.clh"
#include "shared/volume.h"
#include "volume/gradient.clh"

/// Finds the index of a padded row's first word.
static size_t volume_find_row(const kiln_volume_grid* grid, uint y, uint z) {
  return ((size_t)z * (grid->size[1] + 2u) + y) * grid->words;
}

/// 1 for voxels inside the solid. Non-finite values are outside.
static int volume_is_inside(const kiln_volume_grid* grid, float value) {
  return grid->below != 0 ? (value < grid->iso && value >= -FLT_MAX)
                          : (value >= grid->iso && value <= FLT_MAX);
}

/// Sets one bit per voxel of a slab. voxels: the slab. inside: [plane, row, word], padded along x and y, but not
/// along z, so that its first plane is that of the slab.
kernel void kiln_volume_write_signs(const kiln_volume_grid grid, global const KILN_VOXEL* restrict voxels,
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
      const int8 is_inside = grid.below != 0 ? (value < grid.iso) & (value >= -FLT_MAX)
                                          : (value >= grid.iso) & (value <= FLT_MAX);
      const int8 bit = is_inside & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
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

/// Crossings of edges. edges: x, y, z of the padded voxel at which each starts, 16 bits each from the
/// lowest; then two bits for the axis, and one bit that is set if that voxel is inside.
///
/// The hint prevents vectorisation across items: Intel's compiler (2026.22) would combine 4 to 16 of them
/// with wrong masks in volume_gradient's second loop, which gives wrong normals or a crash.
kernel __attribute__((vec_type_hint(float4))) void kiln_volume_find_crossings(
    const kiln_volume_grid grid, global const KILN_VOXEL* restrict voxels,
    global const ulong* restrict edges, global kiln_volume_crossing* restrict crossings) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= grid.count) return;
  const ulong key = edges[item];
  const int axis = (int)(key >> 48 & 3ul);
  const int inside = (int)(key >> 50 & 1ul);
  const int3 a =
      (int3)((int)(key & 0xFFFFul), (int)(key >> 16 & 0xFFFFul), (int)(key >> 32 & 0xFFFFul)) - 1;
  const int3 step = (int3)(axis == 0, axis == 1, axis == 2);
  const int3 b = a + step;
  const int along = axis == 0 ? a.x : axis == 1 ? a.y : a.z;
  const uint side = axis == 0 ? grid.size[0] : axis == 1 ? grid.size[1] : grid.size[2];
  const float3 direction = convert_float3(step);
  float t;
  float3 normal;
  if (along < 0) {  // a lies outside the volume: the solid ends at b
    t = 1.0f;
    normal = -direction;
  } else if (along + 1 >= (int)side) {
    t = 0.0f;
    normal = direction;
  } else {
    const float fa = volume_fetch(&grid, voxels, a.x, a.y, a.z);
    const float fb = volume_fetch(&grid, voxels, b.x, b.y, b.z);
    const float3 along_edge = inside != 0 ? direction : -direction;
    if (volume_is_inside(&grid, fa) == volume_is_inside(&grid, fb)) {
      // Both ends of the edge are outside the solid: the edge crosses the surface that closes a gap.
      t = 0.5f;
      normal = along_edge;
    } else {
      // Values are halved, so that their difference does not overflow.
      const float rise = fb * 0.5f - fa * 0.5f;
      t = clamp((grid.iso * 0.5f - fa * 0.5f) / rise, 0.0f, 1.0f);
      if (!(t >= 0.0f)) t = 0.5f;
      const float3 at_a = volume_gradient(&grid, voxels, a);
      const float3 at_b = volume_gradient(&grid, voxels, b);
      const float3 gradient = volume_blend(fa - grid.iso, fb - grid.iso, at_a, at_b, axis, &t);
      const float outward = grid.below != 0 ? 1.0f : -1.0f;
      // If the field is constant around the edge, the normal is the direction of the edge.
      normal = volume_normalize(gradient * outward, along_edge);
    }
  }
  crossings[item].t = t;
  crossings[item].normal[0] = normal.x;
  crossings[item].normal[1] = normal.y;
  crossings[item].normal[2] = normal.z;
}

/// One Jacobi rotation that zeroes a[p][q] of symmetric matrices; r is the third index. It also
/// rotates the columns of the eigenvectors.
static void volume_rotate(float8* app, float8* aqq, float8* apq, float8* arp, float8* arq,
                          float8 vp[3], float8 vq[3]) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 off_diagonal = *apq;
  const float8 difference = *aqq - *app;
  // tan of the angle: the smaller root of t^2 + 2 theta t - 1 = 0, theta = difference / (2 off).
  const float8 scale = fabs(difference) + sqrt(difference * difference + 4.0f * off_diagonal * off_diagonal);
  const float8 doubled_off = difference < 0.0f ? -2.0f * off_diagonal : 2.0f * off_diagonal;
  const float8 tangent = scale > 0.0f ? doubled_off / scale : (float8)(0.0f);
  const float8 cosine = 1.0f / sqrt(tangent * tangent + 1.0f);
  const float8 sine = tangent * cosine;
  *app -= tangent * off_diagonal;
  *aqq += tangent * off_diagonal;
  *apq = (float8)(0.0f);
  const float8 rp = *arp;
  const float8 rq = *arq;
  *arp = cosine * rp - sine * rq;
  *arq = sine * rp + cosine * rq;
  for (int k = 0; k < 3; ++k) {
    const float8 p = vp[k];
    const float8 q = vq[k];
    vp[k] = p * cosine - q * sine;
    vq[k] = p * sine + q * cosine;
  }
}

/// Adds the component of the correction along one eigenvector.
static void volume_advance(const float8 axis[3], float8 value, float8 limit,
                           const float8 residual[3], float8 place[3]) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 product = (axis[0] * residual[0] + axis[1] * residual[1]) + axis[2] * residual[2];
  const float8 step = value > limit ? product / value : (float8)(0.0f);
  for (int k = 0; k < 3; ++k) place[k] += axis[k] * step;
}

/// Minimises E for eight vertices at once. place: in: start; out: minimum.
static void volume_solve(const float8 a[6], const float8 b[3], float8 place[3]) {
#pragma OPENCL FP_CONTRACT OFF
  float8 xx = a[0], xy = a[1], xz = a[2], yy = a[3], yz = a[4], zz = a[5];
  const float8 residual[3] = {b[0] - ((xx * place[0] + xy * place[1]) + xz * place[2]),
                              b[1] - ((xy * place[0] + yy * place[1]) + yz * place[2]),
                              b[2] - ((xz * place[0] + yz * place[1]) + zz * place[2])};
  const float8 ones = (float8)(1.0f);
  const float8 zeros = (float8)(0.0f);
  float8 vx[3] = {ones, zeros, zeros};
  float8 vy[3] = {zeros, ones, zeros};
  float8 vz[3] = {zeros, zeros, ones};
  for (int sweep = 0; sweep < 4; ++sweep) {
    volume_rotate(&xx, &yy, &xy, &xz, &yz, vx, vy);
    volume_rotate(&xx, &zz, &xz, &xy, &yz, vx, vz);
    volume_rotate(&yy, &zz, &yz, &xy, &xz, vy, vz);
  }
  const float8 limit = KILN_VOLUME_EIGEN_LIMIT * max(xx, max(yy, zz));
  volume_advance(vx, xx, limit, residual, place);
  volume_advance(vy, yy, limit, residual, place);
  volume_advance(vz, zz, limit, residual, place);
}

/// Finds the rank of a crossed edge: its index among all crossed edges.
static uint volume_find_edge(const kiln_volume_grid* grid, global const kiln_volume_word* words,
                             uint axis, uint x, uint y, uint z) {
  global const kiln_volume_word* word = words + volume_find_row(grid, y, z) + (x >> 6);
  const ulong lower_bits = (1ul << (x & 63u)) - 1ul;
  ulong rank = popcount(word->edge[axis] & lower_bits);
  if (axis > 0u) rank += popcount(word->edge[0]);
  if (axis > 1u) rank += popcount(word->edge[1]);
  return word->edge_base + (uint)rank;
}

/// Vertices from their keys (shared/volume.h), eight per item. words and crossings: of the whole
/// volume.
kernel void kiln_volume_place_vertices(const kiln_volume_grid grid, global const ulong* restrict keys,
                                       global const kiln_volume_word* restrict words,
                                       global const kiln_volume_crossing* restrict crossings,
                                       global kiln_volume_qef* restrict qefs,
                                       global kiln_volume_vertex* restrict vertices) {
#pragma OPENCL FP_CONTRACT OFF
  const uint first = (uint)get_global_id(0) * 8u;
  if (first >= grid.count) return;
  const uint lanes = min(grid.count - first, 8u);
  float a[6][8] = {{0.0f}};
  float b[3][8] = {{0.0f}};
  float middle[3][8] = {{0.0f}};
  for (uint lane = 0u; lane < lanes; ++lane) {
    const uint item = first + lane;
    const ulong key = keys[item];
    const uint cell_x = (uint)(key & 0xFFFFul);
    const uint cell_y = (uint)(key >> 16 & 0xFFFFul);
    const uint cell_z = (uint)(key >> 32 & 0xFFFFul);
    kiln_volume_qef qef;
    for (int k = 0; k < 6; ++k) qef.a[k] = 0.0f;
    float3 sum = (float3)(0.0f);
    float3 mass = (float3)(0.0f);
    float3 mean = (float3)(0.0f);
    float c = 0.0f;
    float count = 0.0f;
    for (uint remaining_edges = (uint)(key >> 48); remaining_edges != 0u; remaining_edges &= remaining_edges - 1u) {
      const uint edge = 31u - clz(remaining_edges & (0u - remaining_edges));
      const uint axis = edge >> 2;
      const uint u = edge & 1u;
      const uint v = edge >> 1 & 1u;
      // Offsets of the edge's lower end from the cell's lowest corner.
      const uint dx = axis == 1u ? v : axis == 2u ? u : 0u;
      const uint dy = axis == 2u ? v : axis == 0u ? u : 0u;
      const uint dz = axis == 0u ? v : axis == 1u ? u : 0u;
      global const kiln_volume_crossing* crossing =
          crossings + volume_find_edge(&grid, words, axis, cell_x + dx, cell_y + dy, cell_z + dz);
      const float t = crossing->t;
      const float3 n = vload3(0, crossing->normal);
      const float3 p = (float3)(axis == 0u ? t : (float)dx, axis == 1u ? t : (float)dy,
                                axis == 2u ? t : (float)dz);
      const float d = dot3(n, p);
      qef.a[0] += n.x * n.x;
      qef.a[1] += n.x * n.y;
      qef.a[2] += n.x * n.z;
      qef.a[3] += n.y * n.y;
      qef.a[4] += n.y * n.z;
      qef.a[5] += n.z * n.z;
      sum += n * d;
      c += d * d;
      mass += p;
      mean += n;
      count += 1.0f;
    }
    vstore3(sum, 0, qef.b);
    qef.c = c;
    vstore3(mass, 0, qef.mass);
    qef.count = count;
    qefs[item] = qef;
    for (int k = 0; k < 6; ++k) a[k][lane] = qef.a[k];
    for (int k = 0; k < 3; ++k) b[k][lane] = qef.b[k];
    for (int k = 0; k < 3; ++k) middle[k][lane] = qef.mass[k] / count;

    // If the crossings' normals cancel out, an arbitrary direction is used.
    const float3 normal = volume_normalize(mean, (float3)(0.0f, 0.0f, 1.0f));
    const float3 world_normal = volume_normalize((float3)(dot3(vload3(0, grid.normal_to_world), normal),
                                                     dot3(vload3(1, grid.normal_to_world), normal),
                                                     dot3(vload3(2, grid.normal_to_world), normal)),
                                      normal);
    vstore3(world_normal, 0, vertices[item].normal);
  }

  float8 matrix[6];
  float8 side[3];
  float8 place[3];
  for (int k = 0; k < 6; ++k) matrix[k] = vload8(0, a[k]);
  for (int k = 0; k < 3; ++k) {
    side[k] = vload8(0, b[k]);
    place[k] = vload8(0, middle[k]);
  }
  volume_solve(matrix, side, place);
  for (int k = 0; k < 3; ++k) vstore8(clamp(place[k], 0.0f, 1.0f), 0, middle[k]);

  for (uint lane = 0u; lane < lanes; ++lane) {
    const uint item = first + lane;
    const ulong key = keys[item];
    const float x = (float)(key & 0xFFFFul) - 1.0f + middle[0][lane];
    const float y = (float)(key >> 16 & 0xFFFFul) - 1.0f + middle[1][lane];
    const float z = (float)(key >> 32 & 0xFFFFul) - 1.0f + middle[2][lane];
    const float3 world =
        vload3(0, grid.to_world) * x + vload3(1, grid.to_world) * y + vload3(2, grid.to_world) * z;
    vstore3(world, 0, vertices[item].position);
  }
}
