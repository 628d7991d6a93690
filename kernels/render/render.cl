// Render: orthographic pictures of meshes, shaded to make small detail readable.
//
// The kernels of ray.cl trace the camera's rays, or those of raster.cl find each pixel's triangle; this
// file holds the steps before and after. Normals are interpolated over the hit triangle, or read from a
// normal map: the exact inverse of kernels/detail/detail.cl (tangent frames after Mikkelsen 2008,
// interpolated and not normalised). Light is a wrapped key, a fill and a rim light that travel with the
// camera, and a broad highlight. A sky is dimmed by ambient occlusion: directions with a cosine
// distribution (Malley's method on Vogel's spiral, 1979). Each pixel rotates them by an angle of the R2
// sequence (Roberts 2018). Light reflected between near surfaces follows Jimenez et al. 2016,
// "Practical Realtime Strategies for Accurate Indirect Occlusion", section 5.
//
// kernel                          global    local  memory traffic an item
// kiln_render_write_camera_rays   samples   64     writes 28 B
// kiln_render_convert_keys        pixels    64     reads 8 B + a triangle's corners (gathered), writes 12 B
// kiln_render_compute_surface     samples   64     reads 36 B + a triangle's corners (gathered), writes 36 B
// kiln_render_apply_map           samples   64     reads 24 B + 152 B + 4 texels (gathered), writes 12 B
// kiln_render_write_ambient_rays  samples   64     reads 40 B, writes 28 B
// kiln_render_count_open          samples   64     reads 2 B, writes 1 B
// kiln_render_shade               pixels    64     reads 17 B a sample, writes 12 B
//
// Strengths: the same bytes on every device (no pow, no sin: only + - * / and square roots). Limits: one
// hard-wired material; no shadows except ambient occlusion.

#include "accel/keys.clh"
#include "lib/vector3.clh"
#include "render/light.clh"
#include "shared/detail.h"
#include "shared/render.h"

#define TILE_PIXELS (KILN_RENDER_TILE * KILN_RENDER_TILE)

/// Unit vector along v; `fallback` for a vector without a direction.
static float3 render_normalize(float3 v, float3 fallback) {
#pragma OPENCL FP_CONTRACT OFF
  // The vector is scaled first, since the square of the cross product of a small triangle's edges would underflow.
  const float largest = max(fabs(v.x), max(fabs(v.y), fabs(v.z)));
  if (!(largest > 0.0f)) return fallback;
  const float3 scaled = v / largest;
  return scaled / sqrt(dot3(scaled, scaled));
}

static float3 render_load(global const float* planes, size_t index, size_t capacity) {
  return (float3)(planes[index], planes[index + capacity], planes[index + 2 * capacity]);
}

static void render_store(float3 value, global float* planes, size_t index, size_t capacity) {
  planes[index] = value.x;
  planes[index + capacity] = value.y;
  planes[index + 2 * capacity] = value.z;
}

/// Finds the column and row in the picture of a pixel of this launch's tiles. They may lie outside the picture in the
/// last tiles.
static uint2 render_locate_pixel(const kiln_render_params* params, uint pixel) {
  const uint tile = params->first_tile + pixel / TILE_PIXELS;
  const uint pixel_in_tile = pixel % TILE_PIXELS;
  return (uint2)(tile % params->tile_columns * KILN_RENDER_TILE + pixel_in_tile % KILN_RENDER_TILE,
                 tile / params->tile_columns * KILN_RENDER_TILE + pixel_in_tile / KILN_RENDER_TILE);
}

/// Writes the camera rays of this launch's samples, which start outside the mesh's bounding sphere (radius 1/2 around
/// the origin).
kernel void kiln_render_write_camera_rays(const kiln_render_params params, global float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.sample_count) return;
  const uint per_pixel = params.samples * params.samples;
  const uint2 pixel = render_locate_pixel(&params, (uint)i / per_pixel);
  const uint sub = (uint)i % per_pixel;
  const float n = (float)params.samples;
  const float x = (float)pixel.x + ((float)(sub % params.samples) + 0.5f) / n;
  const float y = (float)pixel.y + ((float)(sub / params.samples) + 0.5f) / n;
  const float3 toward = vload3(0, params.toward);
  const float3 position = vload3(0, params.right) * (params.left_edge + x * params.pixel) +
                          vload3(0, params.up) * (params.top_edge - y * params.pixel) +
                          toward * 0.75f;
  const size_t capacity = params.capacity;
  render_store(position, points, i, capacity);
  render_store(-toward, points + 3 * capacity, i, capacity);
  points[i + 6 * capacity] = 0.0f;
}

/// Converts the depth picture at the centres of the part's pixels to the form of ray hits: one sample
/// per pixel.
/// \param keys  keys of one view with the picture's pixels
kernel void kiln_render_convert_keys(const kiln_render_params params,
                                     global const ulong* restrict keys,
                                     global const uchar* restrict drawn,
                                     global const uint* restrict position_indices,
                                     global const float* restrict positions,
                                     global uint* restrict hit_triangle,
                                     global float* restrict hit_barycentric) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.pixel_count) return;
  const size_t capacity = params.capacity;
  const uint2 pixel = render_locate_pixel(&params, (uint)i);
  hit_triangle[i] = KILN_NO_TRIANGLE;
  if (pixel.x >= params.width || pixel.y >= params.height) return;
  const ulong key = keys_at(keys, drawn, keys_index(0u, params.width, pixel.x, pixel.y));
  if (key == KILN_RASTER_EMPTY) return;
  const uint triangle = (uint)key;
  const uint3 corner = vload3(triangle, position_indices);
  const float3 right = vload3(0, params.right);
  const float3 up = vload3(0, params.up);
  // Corners in the picture, relative to the pixel's centre.
  const float2 middle =
      (float2)(params.left_edge + ((float)pixel.x + 0.5f) * params.pixel,
               params.top_edge - ((float)pixel.y + 0.5f) * params.pixel);
  float2 at[3];
  for (int k = 0; k < 3; ++k) {
    const uint index = k == 0 ? corner.x : k == 1 ? corner.y : corner.z;
    const float3 p = vload3(index, positions);
    at[k] = (float2)(dot3(right, p), dot3(up, p)) - middle;
  }
  const float2 ab = at[1] - at[0];
  const float2 ac = at[2] - at[0];
  const float area = ab.x * ac.y - ab.y * ac.x;
  float u = (ac.x * at[0].y - ac.y * at[0].x) / area;
  float v = (ab.y * at[0].x - ab.x * at[0].y) / area;
  // A z-buffer's vertices are snapped to fractions of a pixel, so a centre may lie slightly outside
  // its triangle.
  if (!(u > 0.0f)) u = 0.0f;
  if (!(v > 0.0f)) v = 0.0f;
  u = min(u, 1.0f);
  v = min(v, 1.0f - u);
  hit_triangle[i] = triangle;
  hit_barycentric[i] = u;
  hit_barycentric[i + capacity] = v;
}

/// Computes the surface at each ray's hit: position, face normal, shading normal.
kernel void kiln_render_compute_surface(const kiln_render_params params,
                                        global const uint* restrict hit_triangle,
                                        global const float* restrict hit_barycentric,
                                        global const uint* restrict position_indices,
                                        global const float* restrict positions,
                                        global const uint* restrict normal_indices,
                                        global const float* restrict normals,
                                        global float* restrict surface) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.sample_count) return;
  const uint triangle = hit_triangle[i];
  if (triangle == KILN_NO_TRIANGLE) return;
  const size_t capacity = params.capacity;
  const float u = hit_barycentric[i];
  const float v = hit_barycentric[i + capacity];
  const float w = 1.0f - u - v;
  const uint3 corner = vload3(triangle, position_indices);
  const float3 a = vload3(corner.x, positions);
  const float3 b = vload3(corner.y, positions);
  const float3 c = vload3(corner.z, positions);
  const float3 toward = vload3(0, params.toward);
  const float3 outward = render_normalize(cross3(b - a, c - a), toward);
  float3 normal = outward;
  if (params.flat == 0u) {
    const uint3 index = vload3(triangle, normal_indices);
    const float3 sum = vload3(index.x, normals) * w + vload3(index.y, normals) * u +
                       vload3(index.z, normals) * v;
    normal = render_normalize(sum, outward);
  }
  const float side = dot3(outward, toward) < 0.0f ? -1.0f : 1.0f;
  render_store(a * w + b * u + c * v, surface + KILN_SURFACE_POSITION * capacity, i, capacity);
  render_store(outward * side, surface + KILN_SURFACE_FACE * capacity, i, capacity);
  render_store(normal * side, surface + KILN_SURFACE_NORMAL * capacity, i, capacity);
}

/// Loads three channels of a texel, in [0, KILN_RENDER_MAP_ONE].
static float3 render_load_texel(global const ushort* map, int x, int y, int width) {
  return convert_float3(vload3((size_t)y * (size_t)width + (size_t)x, map));
}

/// Replaces the shading normal by the map's normal, or by its colour for colour maps.
kernel void kiln_render_apply_map(const kiln_render_map_params params,
                                  global const uint* restrict hit_triangle,
                                  global const float* restrict hit_barycentric,
                                  global const kiln_low_shading* restrict shading,
                                  global const float* restrict uvs,
                                  global const ushort* restrict map,
                                  global float* restrict surface) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const uint triangle = hit_triangle[i];
  if (triangle == KILN_NO_TRIANGLE) return;
  const size_t capacity = params.capacity;
  const float u = hit_barycentric[i];
  const float v = hit_barycentric[i + capacity];
  const float w = 1.0f - u - v;

  // Interpolates the map bilinearly between texel centres, clamped to its edge. Row 0 is at v = 1.
  global const float* corner_uv = uvs + 6 * (size_t)triangle;
  const float2 uv = vload2(0, corner_uv) * w + vload2(1, corner_uv) * u + vload2(2, corner_uv) * v;
  const float x = uv.x * (float)params.width - 0.5f;
  const float y = (1.0f - uv.y) * (float)params.height - 0.5f;
  const float x_floor = floor(x);
  const float y_floor = floor(y);
  const int right = (int)params.width - 1;
  const int bottom = (int)params.height - 1;
  // Coordinates far outside the square, and NaN, are clamped to an edge.
  const int x_texel = convert_int_sat(x_floor);
  const int y_texel = convert_int_sat(y_floor);
  const int x0 = clamp(x_texel, 0, right);
  const int y0 = clamp(y_texel, 0, bottom);
  const int x1 = clamp(x_texel, -1, right - 1) + 1;
  const int y1 = clamp(y_texel, -1, bottom - 1) + 1;
  const float fx = x - x_floor;
  const float fy = y - y_floor;
  const int width = (int)params.width;
  const float3 upper_row = render_load_texel(map, x0, y0, width) * (1.0f - fx) +
                       render_load_texel(map, x1, y0, width) * fx;
  const float3 lower_row = render_load_texel(map, x0, y1, width) * (1.0f - fx) +
                       render_load_texel(map, x1, y1, width) * fx;
  const float3 texel = upper_row * (1.0f - fy) + lower_row * fy;
  if (params.space == KILN_RENDER_COLORS) {
    const float3 color = texel * (1.0f / KILN_RENDER_MAP_ONE);
    render_store(color, surface + KILN_SURFACE_NORMAL * capacity, i, capacity);
    return;
  }
  float3 value = texel * (2.0f / KILN_RENDER_MAP_ONE) - 1.0f;
  value.y *= params.y_scale;

  global const kiln_low_shading* low = shading + triangle;
  const float3 face_normal = vload3(0, low->face_normal);
  float3 normal = value;
  if (params.space == KILN_SPACE_TANGENT || params.space == KILN_SPACE_TANGENT_VERTEX) {
    const float3 n = vload3(0, low->normal) * w + vload3(1, low->normal) * u +
                     vload3(2, low->normal) * v;
    const float3 t = vload3(0, low->tangent) * w + vload3(1, low->tangent) * u +
                     vload3(2, low->tangent) * v;
    float3 b = cross3(n, t);
    if (params.space == KILN_SPACE_TANGENT_VERTEX) {
      b = cross3(vload3(0, low->normal), vload3(0, low->tangent)) * w +
          cross3(vload3(1, low->normal), vload3(1, low->tangent)) * u +
          cross3(vload3(2, low->normal), vload3(2, low->tangent)) * v;
    }
    normal = t * value.x + b * (low->sign * value.y) + n * value.z;
  } else if (params.space == KILN_SPACE_FACE) {
    const float3 t = vload3(0, low->face_tangent);
    normal = t * value.x + cross3(face_normal, t) * value.y + face_normal * value.z;
  }
  normal = render_normalize(normal, face_normal);
  const float3 facing = render_load(surface + KILN_SURFACE_FACE * capacity, i, capacity);
  if (dot3(facing, face_normal) < 0.0f) normal = -normal;
  render_store(normal, surface + KILN_SURFACE_NORMAL * capacity, i, capacity);
}

/// Writes the rays of one pass of ambient occlusion: sample s of a pixel gets direction s + pass * N * N.
/// \param disc  points of the unit disc, two floats each
kernel void kiln_render_write_ambient_rays(const kiln_render_params params,
                                           const uint pass,
                                           global const uint* restrict hit_triangle,
                                           global const float* restrict surface,
                                           global const float* restrict disc,
                                           global float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.sample_count) return;
  const size_t capacity = params.capacity;
  // If the camera ray has no hit, the ambient ray is placed outside the scene.
  float3 position = (float3)(4.0f, 4.0f, 4.0f);
  float3 direction = (float3)(0.0f, 0.0f, 1.0f);
  if (hit_triangle[i] != KILN_NO_TRIANGLE) {
    const float3 face = render_load(surface + KILN_SURFACE_FACE * capacity, i, capacity);
    position = render_load(surface + KILN_SURFACE_POSITION * capacity, i, capacity);
    position += face * 2e-5f;

    const uint per_pixel = params.samples * params.samples;
    const uint2 pixel = render_locate_pixel(&params, (uint)i / per_pixel);
    const float2 point = vload2((uint)i % per_pixel + pass * per_pixel, disc);
    // Rotates by the pixel's angle: first by multiples of 90 degrees, then by the rest, whose sine and cosine are
    // computed from the tangent of its half.
    const uint turn = pixel.x * 0xC13FA9A9u + pixel.y * 0x91E10DA5u;
    const float t = (float)(turn >> 16 & 0x3FFFu) * (1.0f / 16384.0f);
    const float scale = 1.0f / (1.0f + t * t);
    float2 angle = (float2)((1.0f - t * t) * scale, 2.0f * t * scale);
    if ((turn & 0x40000000u) != 0u) angle = (float2)(-angle.y, angle.x);
    if ((turn & 0x80000000u) != 0u) angle = -angle;
    const float x = point.x * angle.x - point.y * angle.y;
    const float y = point.x * angle.y + point.y * angle.x;
    const float z = sqrt(max(0.0f, 1.0f - (x * x + y * y)));

    // An orthonormal basis whose third axis is the normal (Duff et al. 2017).
    const float3 n = render_load(surface + KILN_SURFACE_NORMAL * capacity, i, capacity);
    const float side = n.z < 0.0f ? -1.0f : 1.0f;
    const float p = -1.0f / (side + n.z);
    const float q = n.x * n.y * p;
    const float3 s_axis = (float3)(1.0f + side * n.x * n.x * p, side * q, -side * n.x);
    const float3 t_axis = (float3)(q, side + n.y * n.y * p, -n.y);
    direction = s_axis * x + t_axis * y + n * z;
    // The hemisphere around an interpolated normal extends below the face: such directions are
    // mirrored, so that they do not hit the face itself.
    const float face_cosine = dot3(direction, face);
    if (face_cosine < 0.0f) direction -= face * (2.0f * face_cosine);
    direction = render_normalize(direction, face);
  }
  render_store(position, points, i, capacity);
  render_store(direction, points + 3 * capacity, i, capacity);
  points[i + 6 * capacity] = 0.0f;
}

/// Adds each sample's number of ambient rays without a hit in this pass.
kernel void kiln_render_count_open(const kiln_render_params params,
                                   const uint pass,
                                   global const uchar* restrict hit,
                                   global uchar* restrict open) {
  const size_t i = get_global_id(0);
  if (i >= params.sample_count) return;
  const uint previous = pass == 0u ? 0u : (uint)open[i];
  open[i] = (uchar)(previous + (hit[i] == 0 ? 1u : 0u));
}

/// Writes the part's pixels. With show_normals, writes the normal in world space as n/2 + 1/2, averaged over the
/// samples that hit, or 0 if none did; with show_colors, averages the map's channels likewise; with show_depth,
/// writes the depth, and 1 as the second channel. Otherwise, writes the shaded colour in sRGB.
kernel void kiln_render_shade(const kiln_render_params params,
                              global const uint* restrict hit_triangle,
                              global const float* restrict surface,
                              global const uchar* restrict open,
                              global float* restrict colors) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.pixel_count) return;
  const uint per_pixel = params.samples * params.samples;
  const size_t first = i * per_pixel;
  const size_t capacity = params.capacity;
  uint hits = 0u;
  uint unoccluded = 0u;
  for (size_t s = first; s < first + per_pixel; ++s) {
    if (hit_triangle[s] == KILN_NO_TRIANGLE) continue;
    ++hits;
    if (params.ambient_passes != 0u) unoccluded += open[s];
  }
  const float sky = params.ambient_passes == 0u || hits == 0u
                        ? 1.0f
                        : (float)unoccluded / (float)(hits * params.ambient_passes);

  const float3 right = vload3(0, params.right);
  const float3 up = vload3(0, params.up);
  const float3 toward = vload3(0, params.toward);
  const float3 key = vload3(0, params.key);
  const float3 half_way = vload3(0, params.half_way);
  float3 sum = (float3)(0.0f);
  for (size_t s = first; s < first + per_pixel; ++s) {
    if (hit_triangle[s] == KILN_NO_TRIANGLE) continue;
    if (params.show_depth != 0u) {
      const float3 p = render_load(surface + KILN_SURFACE_POSITION * capacity, s, capacity);
      sum += (float3)(dot3(p, toward), 1.0f, 0.0f);
      continue;
    }
    const float3 n = render_load(surface + KILN_SURFACE_NORMAL * capacity, s, capacity);
    sum += params.show_normals != 0u || params.show_colors != 0u
               ? n
               : render_shaded((float3)(dot3(n, right), dot3(n, up),
                                        dot3(n, toward)),
                               sky, key, half_way);
  }
  float3 color;
  if (params.show_colors != 0u || params.show_depth != 0u) {
    color = hits == 0u ? (float3)(0.0f) : sum / (float)hits;
  } else if (params.show_normals != 0u) {
    color = hits == 0u ? (float3)(0.0f) : render_normalize(sum, toward) * 0.5f + 0.5f;
  } else {
    const uint2 pixel = render_locate_pixel(&params, (uint)i);
    const float x = ((float)pixel.x + 0.5f) / (float)params.width - 0.5f;
    const float y = ((float)pixel.y + 0.5f) / (float)params.height - 0.45f;
    const float from_centre = min(1.0f, x * x + y * y);
    const float3 background = (float3)(0.90f, 0.91f, 0.92f) -
                              (float3)(0.36f, 0.35f, 0.33f) * from_centre;
    sum += background * (float)(per_pixel - hits);
    sum /= (float)per_pixel;
    color = (float3)(render_encode(sum.x), render_encode(sum.y), render_encode(sum.z));
  }
  vstore3(color, i, colors);
}
